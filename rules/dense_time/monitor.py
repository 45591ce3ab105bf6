"""A dense-time monitor of one formula over plain signals."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Literal

from visup.rules.dense_time.compiler import PieceCompiler, horizon
from visup.rules.dense_time.operators import SoFar
from visup.rules.dense_time.sweep import Piece, append
from visup.rules.formula.nodes import Formula
from visup.rules.formula.units import TICKS, ticks
from visup.rules.monitoring.intervals import UNKNOWN, Interval, as_ended
from visup.rules.monitoring.signals import Signals, known_interval, later

Reading = Literal["samples", "held", "linear"]
"""A signal between two samples: not evaluated, the earlier value, or a straight line."""
Before = Literal["unknown", "cut"]
After = Literal["unknown", "weak", "strong", "cut", "lasting"]
NAN = float("nan")


@dataclass(frozen=True, slots=True)
class Ends:
    """Semantics outside a recording, and how long a sample is valid.

    Attributes:
        before: Before the first sample: unknown, or no part of any window ('cut').
        after: After the last one, once the recording is over: unknown; unknown, with undecided verdicts
            resolved to the best ('weak') or worst ('strong') possible; no part of any window ('cut');
            or the last value ('lasting').
        hold_s: How long a sample is valid when no other comes, seconds; for linear signals the largest
            gap that is interpolated.
    """

    before: Before = "unknown"
    after: After = "unknown"
    hold_s: float = inf


UNKNOWN_ENDS = Ends()


@dataclass(frozen=True, slots=True)
class TimedVerdict:
    """The verdict on a formula in an interval of time.

    Attributes:
        begin_s: Seconds.
        end_s: Seconds, exclusive.
        robustness: Interval; see `intervals.verdict`.
    """

    begin_s: float
    end_s: float
    robustness: Interval


class DenseTimeMonitor:
    """Evaluates a formula at all times in order, reporting each verdict as soon as it is decided.

    >>> from visup.rules.language.parser import parse_formula
    >>> from visup.rules.predicates.vocabulary import signals
    >>> monitor = DenseTimeMonitor(parse_formula("x() > 1 within 0.2 s", signals("x")), ends=Ends("cut"))
    >>> [monitor.step(t, {"x": x}) for t, x in ((0.0, 3.0), (0.25, 0.0))]
    [[], [TimedVerdict(begin_s=0.0, end_s=0.25, robustness=(2.0, 2.0))]]
    >>> monitor.step(0.6, {"x": 2.0})[-1]
    TimedVerdict(begin_s=0.45, end_s=0.6, robustness=(-1.0, -1.0))

    Args:
        formula: Its quantities are the signals, written `name()`.
        reading: 'held': a sample's value lasts until the next one. 'linear': values are interpolated
            between samples; verdicts are then exact, and robustness is infinite. 'samples': as
            'held', but `since` and `until` are evaluated sample by sample, as in `Monitor`.
        ends: Semantics outside the recording.

    Attributes:
        delay: Longest wait of a verdict for the future, seconds, not counting the next sample.

    Raises:
        RuleError: The formula has no exact value for this reading of signals.
    """

    def __init__(
        self,
        formula: Formula,
        reading: Reading = "held",
        ends: Ends = UNKNOWN_ENDS,
    ) -> None:
        compiler = PieceCompiler(reading)
        self._at = compiler.formula(formula)
        self._program = compiler.program
        self._linear, self._before, self._after = reading == "linear", ends.before, ends.after
        self._hold = inf if ends.hold_s == inf else ticks(ends.hold_s)
        self.delay = horizon(formula) / TICKS
        self._begin, self._end = 0, 0
        self._then: int | None = None
        self._values: dict[str, Interval] = {}

    def step(self, time: float, values: Signals) -> list[TimedVerdict]:
        """Process one sample.

        Args:
            time: Seconds, later than all before.
            values: Number or interval of each signal; None, NaN or left out when unknown.

        Returns:
            The verdicts decided by it, each moment once.

        Raises:
            SettingsError: As of `Monitor.step`.
        """
        now = later(time, self._then)
        known = {n: known_interval(values.get(n)) for n in self._program.signals.values()}
        if self._then is None:
            found = self._started(now)
        else:
            found = self._run(self._between(self._then, now, known), (self._then, now))
        self._then, self._values = now, known
        return _verdicts(found)

    def foreseen(self) -> Interval:
        """The formula's value at the last sample as known now, with an unknown future.

        So `eventually[60 s] f` is true as soon as f is, and `henceforth[60 s] f` false as soon as f is.
        Its cost grows with the windows; the state is unchanged.
        """
        if self._then is None:
            return UNKNOWN
        twin = copy.deepcopy(self)
        twin._after = "unknown"
        moment = self._then / TICKS
        values = (v.robustness for v in twin.finish() if v.begin_s <= moment < v.end_s)
        return next(values, UNKNOWN)

    def finish(self, end_s: float | None = None) -> list[TimedVerdict]:
        """End the recording: the remaining verdicts.

        Args:
            end_s: When the recording ends, seconds; with the last sample by default.
        """
        if self._then is None:
            return []
        begin, end = self._then, self._then + 1
        if end_s is not None:
            end = max(end, later(end_s, None))
        self._end = end
        rows = {n: [Piece(begin, end, self._ends(n))] for n in self._values}
        span: tuple[float, float] = (begin, end)
        if self._after == "lasting":
            rows = {n: [Piece(begin, inf, p[0].value)] for n, p in rows.items()}
            span = (begin, inf)
        elif self._after != "cut":
            held = end if end_s is not None or self._linear else begin + self._hold
            held = end if held == inf else held
            rows = {
                n: [Piece(begin, held, p[0].value), Piece(held, inf, self._nothing)]
                for n, p in rows.items()
            }
            span = (begin, inf)
        found = self._run(rows, span, end if self._after == "cut" else inf)
        if self._after in ("weak", "strong"):
            found = [Piece(b, e, as_ended(v, self._after)) for b, e, v in found]
        return _verdicts(found)

    @property
    def _nothing(self) -> object:
        return (NAN, NAN) if self._linear else UNKNOWN

    def _started(self, now: int) -> list[Piece]:
        """The time before the first sample, where it counts."""
        self._begin = now
        for step in self._program.steps:
            if step is not None and isinstance(step[0], SoFar):
                step[0].begins(now)
        if self._before == "cut":
            return []
        names = self._program.signals.values()
        return self._run({n: [Piece(-inf, now, self._nothing)] for n in names}, (-inf, now))

    def _between(
        self, then: int, now: int, known: Mapping[str, Interval]
    ) -> dict[str, list[Piece]]:
        if self._linear:
            joined = now - then <= self._hold
            return {
                n: [Piece(then, now, _line(v, known[n]) if joined else (NAN, NAN))]
                for n, v in self._values.items()
            }
        until = min(now, then + self._hold)
        rows = {n: [Piece(then, until, v)] for n, v in self._values.items()}
        if until < now:
            for row in rows.values():
                append(row, Piece(until, now, UNKNOWN))
        return rows

    def _ends(self, name: str) -> object:
        value = self._values[name]
        return _line(value, value) if self._linear else value

    def _run(
        self,
        rows: Mapping[str, list[Piece]],
        span: tuple[float, float],
        end: float | None = None,
    ) -> list[Piece]:
        """New pieces of the formula from new pieces of the signals; the last ones if `end` is given."""
        program, found = self._program, list[list[Piece]]()
        for place, step in enumerate(program.steps):
            if step is None:
                constant = place in program.constants
                found.append(
                    [Piece(*span, program.constants[place])]
                    if constant
                    else rows[program.signals[place]]
                )
                continue
            operator, parts = step
            new = operator.take([found[p] for p in parts])
            found.append(new if end is None else new + operator.finish(end))
        last = inf if end is None else self._end
        clipped = (Piece(max(b, self._begin), min(e, last), v) for b, e, v in found[self._at])
        return [p for p in clipped if p.begin < p.end]


def judge_recording(
    formula: Formula,
    samples: Iterable[tuple[float, Signals]],
    reading: Reading = "held",
    ends: Ends = UNKNOWN_ENDS,
    end_s: float | None = None,
) -> list[TimedVerdict]:
    """Evaluate a formula over a whole recording; arguments as for `DenseTimeMonitor` and its `finish`.

    Returns:
        Consecutive intervals of time, neighbours with different values.
    """
    monitor = DenseTimeMonitor(formula, reading, ends)
    found = [v for time, values in samples for v in monitor.step(time, values)]
    return _merged([*found, *monitor.finish(end_s)])


def _merged(verdicts: list[TimedVerdict]) -> list[TimedVerdict]:
    found: list[TimedVerdict] = []
    for verdict in verdicts:
        if found and found[-1].robustness == verdict.robustness:
            verdict = TimedVerdict(found.pop().begin_s, verdict.end_s, verdict.robustness)
        found.append(verdict)
    return found


def _verdicts(pieces: list[Piece]) -> list[TimedVerdict]:
    return _merged([TimedVerdict(p.begin / TICKS, p.end / TICKS, p.value) for p in pieces])


def _line(first: Interval, last: Interval) -> tuple[float, float]:
    """A line between two numbers; NaN if an end is not a single number."""
    if first[0] != first[1] or last[0] != last[1]:
        return NAN, NAN
    return first[0], last[0]
