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
Ints = NDArray[np.int64]
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
    code: Ints,
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
        op, out, a, b, c = code[i, OP], code[i, DEST], code[i, A], code[i, B], code[i, CELLS]
        p, q = numbers[i, 0], numbers[i, 1]
        if op == LEAST:
            for k in range(2 * c):
                arena[out + k] = min(arena[a + k], arena[b + k])
        elif op == MOST:
            for k in range(2 * c):
                arena[out + k] = max(arena[a + k], arena[b + k])
        elif op in (NOT, BELOW):
            for k in range(c):
                arena[out + k] = -arena[a + c + k] + p + q
                arena[out + c + k] = -arena[a + k] + p + q
        elif op == SHIFT:
            for k in range(2 * c):
                arena[out + k] = arena[a + k] + p + q
        elif op == NUMBER:
            arena[out], arena[out + 1] = p, p
        elif op == FACT:
            _read_facts(facts, code[i], n, arena)
        elif op in (SPREAD, SOME, EVERY):
            _along_axis(code[i], n, arena)
        elif op >= ALWAYS:
            if _update_states(code[i], now, p, arena, before, after):
                changed = True
        else:
            _arithmetic(op, c, a, b, p, out, arena)
    return changed


@compiled
def _arithmetic(op: int, c: int, a: int, b: int, p: float, out: int, arena: Floats) -> None:
    """Arithmetic of quantities; what is no number is unknown, 0 times what is without end is 0."""
    for k in range(c):
        low, high = arena[a + k], arena[a + c + k]
        other_low, other_high = arena[b + k], arena[b + c + k]
        if op == ABS:
            low, high = max(max(low, -high), 0.0), max(-low, high)
        elif op == OVER and other_low <= 0.0 <= other_high:
            low, high = -np.inf, np.inf
        elif op in (TIMES, OVER):
            if op == OVER:
                other_low, other_high = 1.0 / other_high, 1.0 / other_low
            one, two = _product(low, other_low), _product(low, other_high)
            three, four = _product(high, other_low), _product(high, other_high)
            low = min(min(one, two), min(three, four))
            high = max(max(one, two), max(three, four))
        else:
            if op == PLUS:
                low, high = low + other_low, high + other_high
            else:
                low, high = low - other_high, high - other_low
            low, high = -np.inf if low != low else low, np.inf if high != high else high
            if op == COMPARE:
                low, high = low + p, high + p
            elif op == RATE:
                low, high = low * p, high * p
        arena[out + k], arena[out + c + k] = low, high


@compiled
def _product(p: float, q: float) -> float:
    return 0.0 if p == 0.0 or q == 0.0 else p * q


@compiled
def _read_facts(facts: Codes, row: Ints, n: int, arena: Floats) -> None:
    """What is true is [inf, inf], what is false [-inf, -inf]; the other way round if so asked."""
    c, out, turned = row[CELLS], row[DEST], row[AXIS]
    for k in range(c):
        code = facts[row[A] + (k % n * n + k // n if turned else k)]
        arena[out + k] = np.inf if code > 0 else -np.inf
        arena[out + c + k] = -np.inf if code < 0 else np.inf


@compiled
def _strides(mask: int, n: int) -> tuple[int, int, int]:
    """How far apart neighbours along each axis stand; 0 along axes that are not there."""
    third = 1 if mask & 4 else 0
    second = (n if mask & 4 else 1) if mask & 2 else 0
    first = ((n if mask & 4 else 1) * (n if mask & 2 else 1)) if mask & 1 else 0
    return first, second, third


@compiled
def _along_axis(row: Ints, n: int, arena: Floats) -> None:
    """The same intervals for more objects, on which they do not depend.

    Or the greatest (`exists`) or the least (`forall`) along an axis, of objects that are not left out.
    """
    op, mask, c, axis, apart = row[OP], row[MASK], row[CELLS], row[AXIS], row[APART]
    first, second, third = _strides(row[MASK_A], n)
    along = first if axis == 0 else second if axis == 1 else third
    upper = n ** ((row[MASK_A] & 1) + (row[MASK_A] >> 1 & 1) + (row[MASK_A] >> 2 & 1))
    out, sign = row[DEST], -1.0 if op == EVERY else 1.0
    for x in range(n if mask & 1 else 1):
        for y in range(n if mask & 2 else 1):
            for z in range(n if mask & 4 else 1):
                at = row[A] + x * first + y * second + z * third
                low = high = -np.inf
                if op == SPREAD:
                    low, high = arena[at], arena[at + upper]
                else:
                    for w in range(n):
                        left_out = (
                            (apart & 1 and x == w)
                            or (apart & 2 and y == w)
                            or (apart & 4 and z == w)
                        )
                        if not left_out:
                            low = max(low, sign * arena[at + w * along])
                            high = max(high, sign * arena[at + upper + w * along])
                arena[out], arena[out + c] = sign * low, sign * high
                out += 1


@compiled
def _update_states(
    row: Ints, now: float, span: float, arena: Floats, before: Floats, after: Floats
) -> bool:
    """One operator that keeps but a moment of each choice of objects."""
    op, c, out, a, b, changed = row[OP], row[CELLS], row[DEST], row[A], row[B], False
    state = row[STATE]
    if op == RECALL:
        for k in range(c):
            known = arena[a + k] > -np.inf or arena[a + c + k] < np.inf
            for part in range(2):
                kept = before[state + part * c + k]
                after[state + part * c + k] = arena[a + part * c + k] if known else kept
            at = state + 2 * c + k
            after[at] = now if known else before[at]
            recent = now - after[at] <= span
            arena[out + k] = after[state + k] if recent else -np.inf
            arena[out + c + k] = after[state + c + k] if recent else np.inf
            changed |= known
        return changed
    if op == LATCH:
        for k in range(c):
            entered = before[state + k] > 0.0
            read = b if entered else a
            low, high = arena[read + k], arena[read + c + k]
            arena[out + k], arena[out + c + k] = low, high
            after[state + k] = 1.0 if low > 0.0 or (entered and high >= 0.0) else 0.0
            changed |= after[state + k] != before[state + k]
        return changed
    for k in range(2 * c):
        kept, value, at = before[state + k], arena[a + k], out + k
        if op in (LASTS, HAPPENED):
            # Up to when either bound was not as wanted; without end while it is not. Of `within` it
            # is the upper bound that what is not known makes so, and which stands first.
            if op == HAPPENED:
                other = k + c if k < c else k - c
                value, at = -arena[a + other], out + other
            new = np.inf if value < 0.0 else now if kept == np.inf else kept
            arena[at] = -np.inf if (new > now - span) == (op == LASTS) else np.inf
        else:
            new = max(kept, value) if op == ONCE else min(kept, value)
            if op == SINCE:
                new = max(arena[b + k], new)
            arena[at] = new
        after[state + k] = new
        changed |= new != kept
    return changed


@compiled
def find_true(rules: Ints, n: int, arena: Floats, found: Ints) -> int:
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
