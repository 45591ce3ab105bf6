"""The virtual machine: compiled loops that execute many steps for all bindings of objects per call.

A program is laid out (`linker`) as rows of numbers: operation, positions of the intervals it reads and of
those it writes. All intervals of a sample are in one array, the lower bounds of a step before its upper ones;
so are the states of point operators. A step is cheap per binding, and there are few bindings: the number of
calls dominates the cost.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.rules.monitoring._interval_jit import (
    absolute,
    added,
    compared,
    exponential,
    latched,
    mirrored,
    powered,
    product,
    quotient,
    rate,
    recalled,
    rooted,
    shifted,
    subtracted,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Codes = NDArray[np.int8]

(OP, DEST, A, B, CELLS, STATE, MASK_A, MASK, AXIS, APART) = range(10)
"""Columns of an instruction: operation; destination; sources; number of bindings; position of its state; axes
(bits) of what it reads and of what it writes; for a quantifier its axis, and the axes whose objects it
excludes. """
WIDTH = 10
CHOICE_BITS = 32
"""Bits of a binding's number."""

(FACT, SPREAD, NUMBER, NOT, ABS, LEAST, MOST, SHIFT, BELOW, COMPARE, PLUS, MINUS) = range(12)
(TIMES, OVER, RATE, ROOT, EXP, POWER, SOME, EVERY) = range(12, 20)
(ALWAYS, ONCE, SINCE, LASTS, HAPPENED, LATCH, RECALL, NOTE) = range(20, 28)


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
    """Execute some steps for one sample.

    Args:
        code: (I, WIDTH) instructions.
        numbers: (I, 2) their constants.
        begin: First instruction to execute.
        end: One past the last.
        n: Number of objects.
        now: Microseconds.
        facts: Codes of facts: above 0 true, below 0 false.
        arena: All intervals; earlier steps are read, these are written.
        before: States of point operators.
        after: Output: the states after the sample.

    Returns:
        Whether any state has changed.
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
                v = mirrored((arena[a + k], arena[a + c + k]), p, q)
                arena[out + k], arena[out + c + k] = v
        elif op == SHIFT:
            for k in range(c):
                v = shifted((arena[a + k], arena[a + c + k]), p, q)
                arena[out + k], arena[out + c + k] = v
        elif op == NUMBER:
            arena[out], arena[out + 1] = p, q
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
    """Arithmetic of quantities; see `_interval_jit`."""
    for k in range(c):
        v, w = (arena[a + k], arena[a + c + k]), (arena[b + k], arena[b + c + k])
        if op == ABS:
            v = absolute(v, p, 0.0)
        elif op == PLUS:
            v = added(v, w, p)
        elif op == MINUS:
            v = subtracted(v, w, p)
        elif op == COMPARE:
            v = compared(v, w, p)
        elif op == RATE:
            v = rate(v, w, p)
        elif op == ROOT:
            v = rooted(v, p, 0.0)
        elif op == EXP:
            v = exponential(v, p, 0.0)
        elif op == POWER:
            v = powered(v, w, p)
        elif op == TIMES:
            v = product(v, w, p)
        else:
            v = quotient(v, w, p)
        arena[out + k], arena[out + c + k] = v


@compiled
def _read_facts(facts: Codes, row: Ints, n: int, arena: Floats) -> None:
    """True becomes [inf, inf], false [-inf, -inf]; negated on request."""
    c, out, turned = row[CELLS], row[DEST], row[AXIS]
    for k in range(c):
        code = facts[row[A] + (k % n * n + k // n if turned else k)]
        arena[out + k] = np.inf if code > 0 else -np.inf
        arena[out + c + k] = -np.inf if code < 0 else np.inf


@compiled
def _strides(mask: int, n: int) -> tuple[int, int, int]:
    """Strides along each axis; 0 for absent axes."""
    third = 1 if mask & 4 else 0
    second = (n if mask & 4 else 1) if mask & 2 else 0
    first = ((n if mask & 4 else 1) * (n if mask & 2 else 1)) if mask & 1 else 0
    return first, second, third


@compiled
def _along_axis(row: Ints, n: int, arena: Floats) -> None:
    """Broadcast intervals to further objects, on which they do not depend.

    Or reduce by maximum (`exists`) or minimum (`forall`) along an axis, over objects not excluded.
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
    """Update one point operator; returns whether its state has changed."""
    op = row[OP]
    if op == RECALL:
        return _recall(row, now, span, arena, before, after)
    if op == LATCH:
        return _latch(row, arena, before, after)
    if op == NOTE:
        return _note(row, arena, before, after)
    if op in (LASTS, HAPPENED):
        return _boolean_window(row, now, span, arena, before, after)
    return _accumulate(row, arena, before, after)


@compiled
def _recall(
    row: Ints, now: float, span: float, arena: Floats, before: Floats, after: Floats
) -> bool:
    c, out, a, low, changed = row[CELLS], row[DEST], row[A], row[STATE], False
    for k in range(c):
        high, at = low + c + k, low + 2 * c + k
        v, kept = (arena[a + k], arena[a + c + k]), (before[low + k], before[high])
        v, kept, then = recalled(v, kept, before[at], now, span)
        arena[out + k], arena[out + c + k] = v
        after[low + k], after[high], after[at] = kept[0], kept[1], then
        changed |= then != before[at]
    return changed


@compiled
def _latch(row: Ints, arena: Floats, before: Floats, after: Floats) -> bool:
    c, out, a, b, state, changed = row[CELLS], row[DEST], row[A], row[B], row[STATE], False
    for k in range(c):
        enter, leave = (arena[a + k], arena[a + c + k]), (arena[b + k], arena[b + c + k])
        v, entered = latched(enter, leave, before[state + k] > 0.0)
        arena[out + k], arena[out + c + k] = v
        after[state + k] = 1.0 if entered else 0.0
        changed |= after[state + k] != before[state + k]
    return changed


@compiled
def _note(row: Ints, arena: Floats, before: Floats, after: Floats) -> bool:
    """The value of a quantity when a formula was last true."""
    c, out, a, b, state, changed = row[CELLS], row[DEST], row[A], row[B], row[STATE], False
    for k in range(c):
        holds = arena[b + k] > 0.0
        for m in (k, c + k):
            new = arena[a + m] if holds else before[state + m]
            arena[out + m] = after[state + m] = new
            changed |= new != before[state + m]
    return changed


@compiled
def _boolean_window(
    row: Ints, now: float, span: float, arena: Floats, before: Floats, after: Floats
) -> bool:
    """State per bound: infinite while it is as required, else the time until which it was not."""
    op, c, out, a, state, changed = row[OP], row[CELLS], row[DEST], row[A], row[STATE], False
    for k in range(2 * c):
        kept, value, at = before[state + k], arena[a + k], out + k
        if op == HAPPENED:
            # For `within`, unknown values widen the upper bound, which is stored first.
            other = k + c if k < c else k - c
            value, at = -arena[a + other], out + other
        new = np.inf if value < 0.0 else now if kept == np.inf else kept
        arena[at] = -np.inf if (new > now - span) == (op == LASTS) else np.inf
        after[state + k] = new
        changed |= new != kept
    return changed


@compiled
def _accumulate(row: Ints, arena: Floats, before: Floats, after: Floats) -> bool:
    """`always`, `once`, `since` over all samples."""
    op, out, a, b, state, changed = row[OP], row[DEST], row[A], row[B], row[STATE], False
    for k in range(2 * row[CELLS]):
        kept, value = before[state + k], arena[a + k]
        new = max(kept, value) if op == ONCE else min(kept, value)
        if op == SINCE:
            new = max(arena[b + k], new)
        arena[out + k] = after[state + k] = new
        changed |= new != kept
    return changed


@compiled
def find_true(rules: Ints, n: int, arena: Floats, found: Ints) -> int:
    """Find all bindings of objects for which a rule is true and not suspended.

    Args:
        rules: (R, 6) per rule: position of `when` and its axes (bits); position of `unless`, or -1, and
            its axes; number of variables; pairs of these that must be distinct (bits: 01, 02, 12).

        n: Number of objects.
        arena: All intervals.
        found: Output: rule number shifted by `CHOICE_BITS`, plus the number of the binding.

    Returns:
        Number of bindings found.
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
    """Axes as a bit mask."""
    return sum(1 << axis for axis in axes)
