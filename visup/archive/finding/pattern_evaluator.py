"""Evaluates a condition step by step in a run, as rules are evaluated."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from visup.agent import Mind, Truth
from visup.agent.model.step import Step
from visup.archive.value_intervals import IntervalCollector, StepTime
from visup.rules.safety.compiled_rules import compile_rules
from visup.rules.safety.expression import Expression, ExpressionResult
from visup.rules.safety.reasoner import rule_memory

Objects = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Hit:
    """An interval in which a condition was true or unknown.

    Attributes:
        objects: Ids in the order of the condition's names.
        names: Their identities at the beginning.
        truth: 'true' or 'unknown'.
        begin: Seconds.
        end: Time of the first step at which it no longer was, or of the last step, seconds.
        open: Whether the run ended meanwhile.
        confidence: Lowest confidence of the condition's relations that were true meanwhile; None without any.
        rule: Name of the rule, if rules were searched for.
    """

    objects: Objects
    names: tuple[str, ...]
    truth: str
    begin: float
    end: float
    open: bool
    confidence: float | None = None
    rule: str = ""


@dataclass(slots=True)
class PatternEvaluator:
    """Evaluates a condition step by step."""

    pattern: Expression
    before: ExpressionResult | None = None
    last: StepTime | None = None
    intervals: IntervalCollector[tuple[int, ...], tuple[str, Objects]] = field(
        default_factory=IntervalCollector
    )
    names: dict[tuple[int, int], str] = field(default_factory=dict)
    confidences: dict[tuple[Objects, int], float] = field(default_factory=dict)

    def __call__(self, step: Step) -> None:
        """Evaluate it after one step."""
        self.evaluate(before_tasks(step.mind))

    def evaluate(self, mind: Mind) -> None:
        """Evaluate it in the next mind of a run, given as rules see it."""
        number = self.last.number + 1 if self.last else 0
        self.last = StepTime(number, mind.frame_index, mind.time)
        self.before = self.pattern.judge(mind, self.before)
        self.intervals.add(self.last, self._values(mind, self.before))

    def hits(self) -> tuple[Hit, ...]:
        """All hits so far, by time."""
        found = self.intervals.finish(self.last) if self.last else []
        return tuple(
            Hit(
                s.value[1],
                tuple(self.names[s.begin.number, i] for i in s.value[1]),
                s.value[0],
                s.begin.time,
                s.end.time,
                s.open,
                self._confidence(s.value[1], s.begin.number, s.begin.number + s.columns[3])
                if s.value[0] == Truth.TRUE
                else None,
            )
            for s in sorted(found, key=lambda s: (s.begin.number, s.key))
        )

    def _values(
        self, mind: Mind, judged: ExpressionResult
    ) -> dict[tuple[int, ...], tuple[str, Objects]]:
        """Set of objects -> the truth and the assignment for which it holds, true before unknown."""
        found: dict[tuple[int, ...], tuple[str, Objects]] = {}
        assert self.last is not None
        for reading in judged.readings:
            key, truth = tuple(sorted(reading.objects)), reading.truth
            if truth is None or truth is Truth.FALSE:
                continue
            if key not in found or (truth is Truth.TRUE and found[key][0] != Truth.TRUE):
                found[key] = truth.value, reading.objects
            if truth is Truth.TRUE:
                self._record_confidence(mind, reading.objects)
        for objects in found:
            self.names.update({(self.last.number, i): mind.objects[i].name for i in objects})
        return found

    def _record_confidence(self, mind: Mind, objects: Objects) -> None:
        rule = self.pattern.rule
        assignment = dict(zip(rule.variables, objects, strict=True))
        for call in compile_rules((rule,)).related(rule):
            found = mind.relation(call.name, *(assignment[w] for w in call.arguments))
            if found is not None and found.truth is Truth.TRUE and self.last is not None:
                at = objects, self.last.number
                self.confidences[at] = min(self.confidences.get(at, 1.0), found.confidence)

    def _confidence(self, objects: Objects, first: int, end: int) -> float | None:
        found = [
            self.confidences[objects, n]
            for n in range(first, end)
            if (objects, n) in self.confidences
        ]
        return round(min(found), 6) if found else None


def before_tasks(mind: Mind) -> Mind:
    """A mind with the task beliefs that the rules of its step were evaluated with."""
    return replace(mind, tasks=rule_memory(mind).tasks)
