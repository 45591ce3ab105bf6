"""Rules over signals only, evaluated in dense time.

Frames are samples, and rules are evaluated at frames. Signals from a table also have values between its rows,
so a rule that uses only signals has an exact value at every moment.
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
"""Values of signals at a moment, by name: numbers, truth values, words."""
SignalEvaluator = Callable[[Values], SignalValue]
"""A plain signal computed from these values."""
NONE = Number(0.0)


@dataclass(frozen=True, slots=True)
class RuleSpan:
    """An interval of time in which a rule is true, or undecided.

    Attributes:
        rule: Its name.
        begin_s: Seconds.
        end_s: Seconds, exclusive.
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
    """When a rule is true in a recording of signals; `hold` and `cooldown` concern alerts and are ignored.

    Args:
        rule: A rule over signals only.
        samples: Times in seconds and values, in order.
        reading: Signals between samples, as for `DenseTimeMonitor`.
        ends: Semantics outside the recording.
        end_s: When the recording ends, seconds; with the last sample by default.

    Raises:
        RuleError: The rule uses objects, or has no exact value for this reading of signals.
        SettingsError: A time is not later than the previous one.
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
    """Convert a formula to plain signals, with their samples."""
    evaluators: dict[str, SignalEvaluator] = {}
    formula_over_signals: Any = rebuilt(
        formula, lambda node: _signal(rule, node, evaluators, reading)
    )
    return formula_over_signals, [
        (t, {key: evaluate(row) for key, evaluate in evaluators.items()}) for t, row in rows
    ]


def _at(verdicts: list[TimedVerdict], time: float) -> Truth:
    """The truth from a moment on; false where there is no verdict."""
    robustness = (v.robustness for v in verdicts if v.begin_s <= time < v.end_s)
    return verdict(next(robustness, (-inf, -inf)))


def _signal(
    rule: Rule, node: Node, evaluators: dict[str, SignalEvaluator], reading: str
) -> Node | None:
    """Convert a signal word to a plain signal, recorded under a name."""
    if not isinstance(node, Predicate | Measure):
        return None
    key, words = str(node), node.arguments
    if isinstance(node, Measure) and node.name == "signal":
        evaluators[key] = lambda values: number_of(values.get(words[0]))
        return Measure(key, (), node.span)
    fact = _FACTS.get(node.name) if isinstance(node, Predicate) else None
    if fact is None:
        what, hint = f"'{node}' is not about signals", AT_FRAMES
        raise _refused(rule, node.span, what, "signals alone", hint)
    if reading == "linear":
        what, hint = f"'{node}' has no line between samples", HELD
        raise _refused(rule, node.span, what, "numbers alone", hint)
    evaluators[key] = lambda values: _SIGNAL_OF[fact(values, *words)]
    return Comparison(Measure(key, (), node.span), ">", NONE, None, node.span)


AT_FRAMES = "rules about objects are evaluated at frames: `visup watch --rules FILE`"
HELD = "words, and what is on or off, stand until the next row: `--between held`"


def _refused(rule: Rule, span: Span, what: str, expected: str, hint: str) -> RuleError:
    return RuleError(
        f"{what} (rule '{rule.name}')",
        where=f"{rule.file}:{span.line}" if rule.file else "",
        expected=expected,
        hint=hint,
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
_SIGNAL_OF: Mapping[bool | None, SignalValue] = {True: TRUE, False: FALSE, None: None}
