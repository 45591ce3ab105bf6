"""The meaning of formulas over whole histories, as slow and as plain as can be.

It shares no code with the operators of `visup.rules`: every value is sought anew in the list of all
samples, as `docs/rules.md` words it. What it is for is to be compared with.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from math import exp, inf, isnan

from visup.rules.formula.nodes import (
    And,
    Comparison,
    Formula,
    FutureOperator,
    Last,
    Let,
    Literal,
    MOfN,
    Not,
    Or,
    PastOperator,
    Previous,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.terms import (
    Arithmetic,
    Measure,
    Negative,
    PointwiseFunction,
    Term,
    Variable,
    WindowFunction,
)
from visup.rules.formula.units import Number

Interval = tuple[float, float]
Join = Callable[[Interval, Interval], Interval]
Sample = tuple[int, dict[str, Interval]]
"""Moment in microseconds; what each signal is then."""
Values = list[Interval]

ANYTHING: Interval = (-inf, inf)
SPEAKS = 500_000
"""How long a sample speaks for what follows it, microseconds."""
LEAST = 1e-300


@dataclass(frozen=True)
class Signal:
    """A formula's value at each sample, told `delay` microseconds late."""

    values: Values
    delay: int = 0


@dataclass(frozen=True)
class Piece:
    """A stretch of time from `start` up to, and without, `end`; `value` of each signal in it."""

    start: float
    end: float
    value: tuple[Interval, ...]


def robustness(formula: Formula, history: Sequence[Sample]) -> Values:
    """The robustness interval of a formula without objects at every sample.

    Args:
        formula: Its quantities are the signals.
        history: All samples, in order.

    Returns:
        One interval for each sample, from what was known then.

    Raises:
        TypeError: The formula speaks of objects.
    """
    return _Oracle(history).formula(formula).values


class _Oracle:
    def __init__(self, history: Sequence[Sample]) -> None:
        self.history = history
        self.times = [t for t, _ in history]

    def formula(self, f: Formula) -> Signal:
        match f:
            case Comparison():
                return self.comparison(f)
            case Literal(value=value):
                return Signal([(inf, inf) if value else (-inf, -inf)] * len(self.times))
            case Previous(part=part):
                return self.previous(self.formula(part))
            case Not(part=part):
                s = self.formula(part)
                return Signal([(-h, -low) for low, h in s.values], s.delay)
            case And(parts=parts):
                return self.joined([self.formula(p) for p in parts], _both)
            case Or(parts=parts):
                return self.joined([self.formula(p) for p in parts], _either)
            case PastOperator(kind=kind, part=part, window=None):
                s = self.formula(part)
                join = _both if kind == "always" else _either
                return Signal(
                    self.each(lambda k: _fold([p.value[0] for p in self.so_far(k, s)], join)),
                    s.delay,
                )
            case PastOperator(kind=kind, part=part, window=TimeWindow(low=low, high=high)):
                join = _both if kind == "always" else _either
                return self.past(self.formula(part), join, _micro(low), _micro(high))
            case FutureOperator(kind=kind, part=part, window=TimeWindow(low=low, high=high)):
                join = _either if kind == "eventually" else _both
                s, a, b = self.formula(part), _micro(low), _micro(high)
                late = s.delay + b

                def ahead(k: int) -> Interval:
                    moment = self.times[k] - late
                    return _fold(self.meeting(k, moment + a, moment + b, s), join)

                return Signal(self.each(ahead), late)
            case Since(left=left, right=right, window=window):
                return self.since(self.formula(left), self.formula(right), window)
            case Until(left=left, right=right, window=TimeWindow(low=low, high=high)):
                a, b = _micro(low), _micro(high)
                return self.until(self.formula(left), self.formula(right), a, b)
            case MOfN():
                return self.often(f)
            case Let(part=part):
                return self.formula(part)
            case Last(part=part, duration=age):
                return self.last(self.formula(part), _micro(age))
        raise TypeError(f"the oracle knows signals, not objects: {f}")

    def each(self, value: Callable[[int], Interval]) -> Values:
        return [value(k) for k in range(len(self.times))]

    def pieces(self, k: int, *signals: Signal) -> list[Piece]:
        """Signals of one delay as pieces of time, with what is known at sample k."""
        late = signals[0].delay
        found = [Piece(-inf, self.times[0] - late, (ANYTHING,) * len(signals))]
        for j in range(k + 1):
            start = self.times[j]
            end = self.times[j + 1] if j < k else inf
            value = tuple(s.values[j] for s in signals)
            found.append(Piece(start - late, min(end, start + SPEAKS) - late, value))
            if j < k and end > start + SPEAKS:
                found.append(Piece(start + SPEAKS - late, end - late, (ANYTHING,) * len(signals)))
        return found

    def meeting(self, k: int, low: float, high: float, signal: Signal) -> Values:
        """Its values at all moments from `low` to `high`, _both included."""
        return [p.value[0] for p in self.pieces(k, signal) if p.start <= high and p.end > low]

    def so_far(self, k: int, *signals: Signal) -> list[Piece]:
        """The pieces that begin at the first sample or later."""
        return [p for p in self.pieces(k, *signals) if p.start >= self.times[0]]

    def past(self, s: Signal, join: Join, a: int, b: int) -> Signal:
        def back(k: int) -> Interval:
            moment = self.times[k] - s.delay
            return _fold(self.meeting(k, moment - b, moment - a, s), join)

        return Signal(self.each(back), s.delay)

    def waited(self, signals: list[Signal]) -> list[Signal]:
        """The same signals, all told as late as the latest of them."""
        late = max(s.delay for s in signals)

        def at(s: Signal, k: int) -> Interval:
            moment = self.times[k] - late
            (value,) = self.meeting(k, moment, moment, s)
            return value

        return [Signal([at(s, k) for k in range(len(self.times))], late) for s in signals]

    def joined(self, signals: list[Signal], join: Join) -> Signal:
        signals = self.waited(signals)
        values = [_fold(list(v), join) for v in zip(*(s.values for s in signals), strict=True)]
        return Signal(values, signals[0].delay)

    def since(self, left: Signal, right: Signal, window: TimeWindow | None) -> Signal:
        left, right = self.waited([left, right])

        def at(k: int) -> Interval:
            pieces, now = self.pieces(k, left, right), self.times[k] - left.delay
            if window is None:
                pieces = self.so_far(k, left, right)
                begin, end = -inf, inf
            else:
                begin, end = now - _micro(window.high), now - _micro(window.low)
            found = [
                _fold([p.value[1], *(later.value[0] for later in pieces[i + 1 :])], _both)
                for i, p in enumerate(pieces)
                if p.end > begin and p.start <= end
            ]
            return _fold(found, _either)

        return Signal(self.each(at), left.delay)

    def until(self, left: Signal, right: Signal, a: int, b: int) -> Signal:
        left, right = self.waited([left, right])
        late = left.delay + b

        def at(k: int) -> Interval:
            begin = self.times[k] - late
            inner = [p for p in self.pieces(k, left, right) if p.end > begin]
            found = [
                _fold([p.value[1], *(earlier.value[0] for earlier in inner[:i])], _both)
                for i, p in enumerate(inner)
                if p.end > begin + a
            ]
            return _fold(found, _either)

        return Signal(self.each(at), late)

    def previous(self, s: Signal) -> Signal:
        def at(k: int) -> Interval:
            heard = k > 0 and self.times[k] - self.times[k - 1] <= SPEAKS
            return s.values[k - 1] if heard else ANYTHING

        return Signal(self.each(at), s.delay)

    def often(self, f: MOfN) -> Signal:
        s = self.formula(f.part)
        need = f.least.base

        def samples(k: int) -> Interval:
            last = self.pieces(k, s)[1:][-round(f.of.base) :]
            missing = round(f.of.base) - len(last)
            surely = sum(p.value[0][0] > 0 for p in last)
            possibly = sum(p.value[0][1] >= 0 for p in last) + missing
            return surely - need + LEAST, possibly - need + LEAST

        def share(k: int) -> Interval:
            span, now = _micro(f.of), self.times[k] - s.delay
            surely = possibly = 0.0
            for p in self.pieces(k, s):
                stands = max(0.0, min(p.end, now) - max(p.start, now - span))
                surely += stands * (p.value[0][0] > 0)
                possibly += stands * (p.value[0][1] >= 0)
            enough = round(need * span)
            return (surely - enough) / span + LEAST, (possibly - enough) / span + LEAST

        return Signal(self.each(samples if f.counts_samples else share), s.delay)

    def last(self, s: Signal, age: int) -> Signal:
        def at(k: int) -> Interval:
            for j in range(k, -1, -1):
                if self.times[k] - self.times[j] <= age and s.values[j] != ANYTHING:
                    return s.values[j]
            return ANYTHING

        return Signal(self.each(at), s.delay)

    def comparison(self, f: Comparison) -> Signal:
        enter = self.compared(f.operator, f.left, f.right)
        if f.leave is None:
            return Signal(enter)
        leave = self.compared(f.operator, f.left, f.leave)
        entered, values = False, []
        for by_enter, by_leave in zip(enter, leave, strict=True):
            low, high = by_leave if entered else by_enter
            entered = True if low > 0 else False if high < 0 else entered
            values.append((low, high))
        return Signal(values)

    def compared(self, operator: str, left: Term, right: Term) -> Values:
        if operator in ("==", "!="):
            values = zip(self.term(left), self.term(right), strict=True)
            apart = [
                _absolute((_number(v[0] - w[1], -inf), _number(v[1] - w[0], inf)))
                for v, w in values
            ]
            if operator == "!=":
                return [(low - LEAST, high - LEAST) for low, high in apart]
            return [(-high + LEAST, -low + LEAST) for low, high in apart]
        by = LEAST if "=" in operator else -LEAST
        more, less = (left, right) if ">" in operator else (right, left)
        values = zip(self.term(more), self.term(less), strict=True)
        return [
            (_number(v[0] - w[1], -inf) + by, _number(v[1] - w[0], inf) + by) for v, w in values
        ]

    def term(self, t: Term) -> Values:
        match t:
            case Number():
                return [(t.base, t.base)] * len(self.times)
            case Measure(name=name):
                return [known.get(name, ANYTHING) for _, known in self.history]
            case Negative(part=part):
                return [(-h, -low) for low, h in self.term(part)]
            case PointwiseFunction(name="abs", parts=(part,)):
                return [_absolute(v) for v in self.term(part)]
            case PointwiseFunction(name="sqrt", parts=(part,)):
                roots = [(max(v[0], 0.0), v[1]) for v in self.term(part)]
                return [ANYTHING if h < 0 else (low**0.5, h**0.5) for low, h in roots]
            case PointwiseFunction(name="exp", parts=(part,)):
                return [(_exp(low), _exp(h)) for low, h in self.term(part)]
            case PointwiseFunction(name="power", parts=(part, Number(base=exponent))):
                return [_power(v, exponent) for v in self.term(part)]
            case PointwiseFunction(name=name, parts=parts):
                join = _both if name == "min" else _either
                return [_fold(list(v), join) for v in zip(*map(self.term, parts), strict=True)]
            case Arithmetic(left=left, operator=operator, right=right):
                sides = zip(self.term(left), self.term(right), strict=True)
                return [_computed(operator, v, w) for v, w in sides]
            case Variable(part=part, at=at) if part is not None:
                values, noted = self.term(part), self.formula(at).values
                true = [k for k in range(len(noted)) if noted[k][0] > 0]
                before = ([j for j in true if j <= k] for k in range(len(noted)))
                return [values[js[-1]] if js else ANYTHING for js in before]
            case WindowFunction(name="last", part=part, duration=age):
                return self.last(Signal(self.term(part)), _micro(age)).values
            case WindowFunction(name="lowest" | "highest" as name, part=part, duration=span):
                join = _both if name == "lowest" else _either
                return self.past(Signal(self.term(part)), join, 0, _micro(span)).values
            case WindowFunction(name="before", part=part, duration=span):
                return self.past(Signal(self.term(part)), _both, _micro(span), _micro(span)).values
            case WindowFunction(part=part, duration=span):
                now = self.term(part)
                then = self.past(Signal(now), _both, _micro(span), _micro(span)).values
                return [
                    (_number(v[0] - w[1], -inf) / span.base, _number(v[1] - w[0], inf) / span.base)
                    for v, w in zip(now, then, strict=True)
                ]
        raise TypeError(f"the oracle knows signals, not objects: {t}")


def _exp(x: float) -> float:
    return inf if x > 700 else exp(x)


def _power(v: Interval, whole: float) -> Interval:
    """A whole power of an interval: of its ends, and of 0 where it lies between them."""
    inner = [0.0] if v[0] < 0.0 < v[1] else []
    found = [x**whole for x in (*v, *inner)]
    return min(found), max(found)


def _both(v: Interval, w: Interval) -> Interval:
    return min(v[0], w[0]), min(v[1], w[1])


def _either(v: Interval, w: Interval) -> Interval:
    return max(v[0], w[0]), max(v[1], w[1])


def _fold(values: Values, join: Join) -> Interval:
    return reduce(join, values) if values else ANYTHING


def _micro(n: Number) -> int:
    return round(n.base * 1_000_000)


def _number(value: float, otherwise: float) -> float:
    return otherwise if isnan(value) else value


def _absolute(v: Interval) -> Interval:
    ends = sorted((abs(v[0]), abs(v[1])))
    return (0.0 if v[0] <= 0 <= v[1] else ends[0], ends[1])


def _computed(operator: str, v: Interval, w: Interval) -> Interval:
    if operator in "+-":
        w = w if operator == "+" else (-w[1], -w[0])
        return _number(v[0] + w[0], -inf), _number(v[1] + w[1], inf)
    if operator == "/":
        if w[0] <= 0 <= w[1]:
            return ANYTHING
        ends = [_number(p / q, 0.0) for p in v for q in w]
    else:
        ends = [0.0 if 0.0 in (p, q) else p * q for p in v for q in w]
    return min(ends), max(ends)
