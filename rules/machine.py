"""The loops that judge formulas for all choices of objects: one call does many steps of a program.

A program is laid out (`layout`) as rows of numbers: what to do, where the intervals stand that it reads
and where those go that it makes. All intervals of one sample stand in one array, the lower bounds
of a step before its upper ones; so do the states of what keeps but a moment. A step does next to
nothing for one choice of objects, and there are few choices: what counts is the number of calls.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Codes = NDArray[np.int8]

(OP, DEST, A, B, CELLS, STATE, MASK_A, MASK, AXIS, APART) = range(10)
"""Columns of an instruction: what to do; where to; where from; of how many choices of objects; where its
state stands; axes (bits) of what it reads and of what it makes; of a quantifier its axis, and axes
whose objects it leaves out."""
WIDTH = 10
CHOICE_BITS = 32
"""There are fewer choices of objects than 2 to that."""

(FACT, SPREAD, NUMBER, NOT, ABS, LEAST, MOST, SHIFT, BELOW, COMPARE, PLUS, MINUS) = range(12)
(TIMES, OVER, RATE, SOME, EVERY, ALWAYS, ONCE, SINCE, LASTS, HAPPENED, LATCH, RECALL) = range(
    12, 24
)


@compiled
def run(
    code: Whole,
    numbers: Floats,
    begin: int,
    end: int,
    n: int,
    now: float,
    facts: Codes,
    arena: Floats,
    before: Floats,
    after: Floats,
) -> bool:
    """Do some steps at one sample.

    Args:
        code: (I, WIDTH) instructions.
        numbers: (I, 2) their constants.
        begin: The first one to be done.
        end: The first one not to be.
        n: Number of objects.
        now: Microseconds.
        facts: Codes of facts: above 0 true, below it false.
        arena: All intervals; those of steps done before are read, those of these are written.
        before: States of what keeps but a moment.
        after: The same after the sample; written.

    Returns:
        Whether any of their states has changed.
    """
    changed = False
    for i in range(begin, end):
        row = code[i]
        op, c = row[OP], row[CELLS]
        out, a, b = arena[row[DEST] :], arena[row[A] :], arena[row[B] :]
        p, q = numbers[i, 0], numbers[i, 1]
        if op == LEAST:
            for k in range(2 * c):
                out[k] = a[k] if a[k] < b[k] else b[k]
        elif op == MOST:
            for k in range(2 * c):
                out[k] = a[k] if a[k] > b[k] else b[k]
        elif op == NOT:
            for k in range(c):
                out[k], out[c + k] = -a[c + k], -a[k]
        elif op == FACT:
            _told(facts, row, n, out)
        elif op == SPREAD:
            _spread(a, row, n, out)
        elif op == SHIFT:
            for k in range(2 * c):
                out[k] = a[k] + p + q
        elif op == BELOW:
            for k in range(c):
                out[k], out[c + k] = -a[c + k] + p + q, -a[k] + p + q
        elif op in (SOME, EVERY):
            _quantified(a, row, n, out)
        elif op >= ALWAYS:
            if _kept(row, a, b, out, now, p, before[row[STATE] :], after[row[STATE] :]):
                changed = True
        elif op == NUMBER:
            out[0], out[1] = p, p
        elif op == ABS:
            for k in range(c):
                low, high = a[k], a[c + k]
                out[k], out[c + k] = max(low, -high, 0.0), max(-low, high)
        else:
            _computed(op, c, a, b, p, out)
    return changed


@compiled
def _computed(op: int, c: int, a: Floats, b: Floats, p: float, out: Floats) -> None:
    """Arithmetic of two quantities; what is no number is unknown, 0 times what is without end is 0."""
    for k in range(c):
        low, high, other_low, other_high = a[k], a[c + k], b[k], b[c + k]
        if op in (TIMES, OVER):
            divides = op == OVER
            if divides and other_low <= 0.0 <= other_high:
                out[k], out[c + k] = -np.inf, np.inf
                continue
            if divides:
                other_low, other_high = 1.0 / other_high, 1.0 / other_low
            one, two = _product(low, other_low), _product(low, other_high)
            three, four = _product(high, other_low), _product(high, other_high)
            out[k] = min(min(one, two), min(three, four))
            out[c + k] = max(max(one, two), max(three, four))
            continue
        if op == PLUS:
            low, high = low + other_low, high + other_high
        else:
            low, high = low - other_high, high - other_low
        low, high = -np.inf if low != low else low, np.inf if high != high else high
        if op == COMPARE:
            low, high = low + p, high + p
        elif op == RATE:
            low, high = low * p, high * p
        out[k], out[c + k] = low, high


@compiled
def _product(p: float, q: float) -> float:
    return 0.0 if p == 0.0 or q == 0.0 else p * q


@compiled
def _told(facts: Codes, row: Whole, n: int, out: Floats) -> None:
    """What is true is [inf, inf], what is false [-inf, -inf]; the other way round if so asked."""
    c, turned = row[CELLS], row[AXIS]
    for k in range(c):
        at = k % n * n + k // n if turned else k
        code = facts[row[A] + at]
        out[k] = np.inf if code > 0 else -np.inf
        out[c + k] = -np.inf if code < 0 else np.inf


@compiled
def _strides(mask: int, n: int) -> tuple[int, int, int]:
    """How far apart neighbours along each axis stand; 0 along axes that are not there."""
    third = 1 if mask & 4 else 0
    second = (n if mask & 4 else 1) if mask & 2 else 0
    first = ((n if mask & 4 else 1) * (n if mask & 2 else 1)) if mask & 1 else 0
    return first, second, third


@compiled
def _spread(a: Floats, row: Whole, n: int, out: Floats) -> None:
    """The same intervals for more objects, on which they do not depend."""
    mask, c = row[MASK], row[CELLS]
    first, second, third = _strides(row[MASK_A], n)
    width = 1
    for axis in range(3):
        if row[MASK_A] >> axis & 1:
            width *= n
    k = 0
    for x in range(n if mask & 1 else 1):
        for y in range(n if mask & 2 else 1):
            for z in range(n if mask & 4 else 1):
                at = x * first + y * second + z * third
                out[k], out[c + k] = a[at], a[width + at]
                k += 1


@compiled
def _quantified(a: Floats, row: Whole, n: int, out: Floats) -> None:
    """The greatest (`exists`) or the least (`forall`) along an axis, of objects that are not left out."""
    mask, c, axis, apart = row[MASK], row[CELLS], row[AXIS], row[APART]
    strides = _strides(row[MASK_A], n)
    width = 1
    for other in range(3):
        if row[MASK_A] >> other & 1:
            width *= n
    along, some, k = strides[axis], row[OP] == SOME, 0
    for x in range(n if mask & 1 else 1):
        for y in range(n if mask & 2 else 1):
            for z in range(n if mask & 4 else 1):
                at = x * strides[0] + y * strides[1] + z * strides[2]
                low = high = -np.inf if some else np.inf
                for w in range(n):
                    if (apart & 1 and x == w) or (apart & 2 and y == w) or (apart & 4 and z == w):
                        continue
                    v, u = a[at + w * along], a[width + at + w * along]
                    low = max(low, v) if some else min(low, v)
                    high = max(high, u) if some else min(high, u)
                out[k], out[c + k] = low, high
                k += 1


@compiled
def _kept(
    row: Whole,
    a: Floats,
    b: Floats,
    out: Floats,
    now: float,
    span: float,
    before: Floats,
    after: Floats,
) -> bool:
    """One operator that keeps but a moment of each choice of objects."""
    op, c, changed = row[OP], row[CELLS], False
    if op in (LASTS, HAPPENED):
        # Up to when either bound was not as wanted; without end while it is not. Of `within` it is the
        # upper bound that what is not known makes so, and which stands first.
        for k in range(2 * c):
            other = k + c if k < c else k - c
            broken = a[k] < 0.0 if op == LASTS else a[other] > 0.0
            until = np.inf if broken else now if before[k] == np.inf else before[k]
            after[k] = until
            changed |= until != before[k]
            shown = until > now - span
            if op == LASTS:
                out[k] = -np.inf if shown else np.inf
            else:
                out[other] = np.inf if shown else -np.inf
    elif op == LATCH:
        for k in range(c):
            entered = before[k] > 0.0
            low, high = (b[k], b[c + k]) if entered else (a[k], a[c + k])
            out[k], out[c + k] = low, high
            after[k] = 1.0 if low > 0.0 or (entered and high >= 0.0) else 0.0
            changed |= after[k] != before[k]
    elif op == RECALL:
        for k in range(c):
            known = a[k] > -np.inf or a[c + k] < np.inf
            for part in range(2):
                after[part * c + k] = a[part * c + k] if known else before[part * c + k]
            after[2 * c + k] = now if known else before[2 * c + k]
            recent = now - after[2 * c + k] <= span
            out[k], out[c + k] = (after[k], after[c + k]) if recent else (-np.inf, np.inf)
            changed |= known
    else:
        for k in range(2 * c):
            v = max(before[k], a[k]) if op == ONCE else min(before[k], a[k])
            if op == SINCE:
                v = max(b[k], v)
            out[k] = after[k] = v
            changed |= v != before[k]
    return changed


@compiled
def choices(rules: Whole, n: int, arena: Floats, found: Whole) -> int:
    """Every choice of objects for which a rule is true and not suspended.

    Args:
        rules: (R, 6) of each where `when` stands and its axes (bits); where `unless` stands, or -1, and
            its axes; how many variables it has; pairs of these that must not be one object (bits: 01,
            02, 12).
        n: Number of objects.
        arena: All intervals.
        found: The number of the rule, times 2 to the `CHOICE_BITS`, and that of the choice; written.

    Returns:
        How many were found.
    """
    count = 0
    for r in range(len(rules)):
        when, mask, unless, other, variables, apart = rules[r]
        first, second, third = _strides(mask, n)
        u_first, u_second, u_third = _strides(other, n)
        k = 0
        for x in range(n if variables > 0 else 1):
            for y in range(n if variables > 1 else 1):
                for z in range(n if variables > 2 else 1):
                    k += 1
                    if (
                        (apart & 1 and x == y)
                        or (apart & 2 and x == z)
                        or (apart & 4 and y == z)
                        or not arena[when + x * first + y * second + z * third] > 0.0
                    ):
                        continue
                    if (
                        unless >= 0
                        and arena[unless + x * u_first + y * u_second + z * u_third] > 0.0
                    ):
                        continue
                    found[count] = (r << CHOICE_BITS) + k - 1
                    count += 1
    return count


def bits(axes: Any) -> int:
    """Axes as one number."""
    return sum(1 << axis for axis in axes)
