"""Rules about signals alone, exact between samples, with ends as one chooses.

Frames are samples, and rules are evaluated at frames. Signals that come from a table have values between
its rows, too, so that a rule which speaks of signals alone has an exact value at every moment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import Any

from visup.agent import Truth
from visup.agent.model.errors import RuleError
from visup.rules.dense_time import Ends, judge_recording
from visup.rules.dense_time.monitor import UNKNOWN_ENDS, Reading, TimedVerdict
from visup.rules.formula.nodes import Comparison, Formula, Node, Predicate, Rule
from visup.rules.formula.rebuilding import rebuilt
from visup.rules.formula.terms import Measure
from visup.rules.formula.units import Number, Span
from visup.rules.monitoring.intervals import FALSE, TRUE, verdict
from visup.rules.monitoring.signals import SignalValue
from visup.rules.predicates.signals import number_of

Values = Mapping[str, Any]
"""What is known of signals at a moment, by name: numbers, truth values, words."""
Look = Callable[[Values], SignalValue]
"""What a plain signal is by what is known."""
NONE = Number(0.0)


@dataclass(frozen=True, slots=True)
class RuleSpan:
    """A stretch of time in which a rule is true, or in which it is not decided.

    Attributes:
        rule: Its name.
        begin_s: Seconds.
        end_s: Seconds, without.
        truth: True or unknown.
    """

    rule: str
    begin_s: float
    end_s: float
    truth: Truth

    def __str__(self) -> str:
        what = "true" if self.truth is Truth.TRUE else "unknown"
        return f"{self.rule}: {what} from {self.begin_s:g} s to {self.end_s:g} s"


def judge_rule(
    rule: Rule,
    samples: Iterable[tuple[float, Values]],
    reading: Reading = "held",
    ends: Ends = UNKNOWN_ENDS,
    end_s: float | None = None,
) -> list[RuleSpan]:
    """When a rule is true of a recording of signals; `hold` and `cooldown` are of alerts, and left out.

    Args:
        rule: It must be about signals alone.
        samples: Times in seconds and what is known then, in order.
        reading: What signals are between samples, as of `DenseTimeMonitor`.
        ends: What is outside the recording.
        end_s: When the recording ends, seconds; with the last sample when left out.

    Raises:
        RuleError: The rule is about objects, or has no exact value as signals are read.
        SettingsError: A time does not come after the one before.
    """
    rows = list(samples)
    when, *others = (
        judge_recording(*_plain(rule, formula, rows, reading), reading, ends, end_s)
        for formula in (rule.when, rule.unless)
        if formula is not None
    )
    unless = others[0] if others else []
    edges = sorted({t for v in (*when, *unless) for t in (v.begin_s, v.end_s)})
    found: list[RuleSpan] = []
    for begin, end in pairwise(edges):
        truth = _at(when, begin)
        if truth is Truth.FALSE or _at(unless, begin) is Truth.TRUE:
            continue
        if found and found[-1].end_s == begin and found[-1].truth is truth:
            begin = found.pop().begin_s
        found.append(RuleSpan(rule.name, begin, end, truth))
    return found


def _plain(
    rule: Rule, formula: Formula, rows: list[tuple[float, Values]], reading: Reading
) -> tuple[Formula, list[tuple[float, dict[str, SignalValue]]]]:
    """A formula over plain signals, and the samples of these."""
    looks: dict[str, Look] = {}
    plain: Any = rebuilt(formula, lambda node: _signal(rule, node, looks, reading))
    return plain, [(t, {key: look(row) for key, look in looks.items()}) for t, row in rows]


def _at(verdicts: list[TimedVerdict], time: float) -> Truth:
    """What holds from a moment on; false where nothing is told of it."""
    told = (v.robustness for v in verdicts if v.begin_s <= time < v.end_s)
    return verdict(next(told, (-inf, -inf)))


def _signal(rule: Rule, node: Node, looks: dict[str, Look], reading: str) -> Node | None:
    """What a word of signals is in plain signals, each under a name that it is noted by."""
    if not isinstance(node, Predicate | Measure):
        return None
    key, words = str(node), node.words
    if isinstance(node, Measure) and node.name == "signal":
        looks[key] = lambda values: number_of(values.get(words[0]))
        return Measure(key, (), node.span)
    fact = _FACTS.get(node.name) if isinstance(node, Predicate) else None
    if fact is None:
        raise _refused(rule, node.span, f"'{node}' is not about signals", "signals alone")
    if reading == "linear":
        raise _refused(rule, node.span, f"'{node}' has no line between samples", "numbers alone")
    looks[key] = lambda values: _TOLD[fact(values, *words)]
    return Comparison(Measure(key, (), node.span), ">", NONE, None, node.span)


def _refused(rule: Rule, span: Span, what: str, expected: str) -> RuleError:
    return RuleError(
        f"{what} (rule '{rule.name}')",
        where=f"{rule.file}:{span.line}" if rule.file else "",
        expected=expected,
        hint="rules about objects are evaluated at frames: `visup watch --rules FILE`",
    )


def _on(values: Values, name: str) -> bool | None:
    value = values.get(name)
    return bool(value) if isinstance(value, bool) or number_of(value) is not None else None


def _is(values: Values, name: str, word: str) -> bool | None:
    value = values.get(name)
    return None if value is None else value == word


_FACTS: Mapping[str, Callable[..., bool | None]] = {
    "signal_on": _on,
    "signal_is": _is,
    "signal_known": lambda values, name: values.get(name) is not None,
}
_TOLD: Mapping[bool | None, SignalValue] = {True: TRUE, False: FALSE, None: None}
