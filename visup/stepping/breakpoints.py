"""Stop conditions: a phase, an event, a rule, a stage, an object, a time, or a predicate.

Each condition evaluates a step and the mind before it, and returns a sentence when it is met.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from visup.agent import Mind, ObjectBelief, Truth
from visup.agent.contract.phases import Phase
from visup.agent.model.step import Step
from visup.rules.safety.expression import Expression, ExpressionResult
from visup.rules.safety.queries import verdicts
from visup.rules.safety.reasoner import rule_memory

Predicate = Callable[[Step], bool]


@runtime_checkable
class StopCondition(Protocol):
    """A condition to stop at."""

    @property
    def text(self) -> str:
        """Its source for `parse_condition`."""
        ...

    def met(self, before: Mind, step: Step) -> str:
        """Why to stop after a step, or an empty text."""
        ...


@dataclass(frozen=True, slots=True)
class PhaseStop:
    """Stops inside each cycle after a phase."""

    phase: Phase

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"phase {self.phase.value}"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`; earlier phases are met inside the cycle."""
        return "after act" if self.phase is Phase.ACT else ""


@dataclass(frozen=True, slots=True)
class EventStop:
    """Stops at events of one kind."""

    kind: str

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"event {self.kind}"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        return next((f"{e.kind}: {e.text}" for e in step.events if e.kind == self.kind), "")


@dataclass(frozen=True, slots=True)
class RuleStop:
    """Stops when a rule becomes true for some objects, or changes in any way.

    Attributes:
        name: The rule.
        changes: Whether to stop at every change of its verdict.
    """

    name: str
    changes: bool = False
    _last: _VerdictCache = field(default_factory=lambda: _VerdictCache(), compare=False, repr=False)

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"rule {self.name}" + (" changes" if self.changes else "")

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        was = self._last.of(before, self.name)
        now = self._last.of(step.mind, self.name)
        return _change_text(self.name, was, now, self.changes)


@dataclass(slots=True)
class _VerdictCache:
    """Caches the verdicts of two minds: the mind after a step is the one before the next."""

    _entries: list[tuple[Mind, Mapping[tuple[int, ...], Truth]]] = field(default_factory=list)

    def of(self, mind: Mind, rule: str) -> Mapping[tuple[int, ...], Truth]:
        for cached, verdicts_of_mind in self._entries:
            if cached is mind:
                return verdicts_of_mind
        self._entries = [*self._entries[-1:], (mind, rule_verdicts(mind, rule))]
        return self._entries[-1][1]


@dataclass(frozen=True, slots=True)
class StageStop:
    """Stops when a stage becomes the current one or its status changes."""

    stage: str

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"stage {self.stage}"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        was, now = _stage_statuses(before, self.stage), _stage_statuses(step.mind, self.stage)
        changed = [task for task in now if now[task] != was.get(task, ("pending", False))]
        return "; ".join(_stage_text(self.stage, *now[task]) for task in changed)


@dataclass(frozen=True, slots=True)
class ObjectStop:
    """Stops when the presence or the identity of an object changes."""

    object_id: int

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"object {self.object_id}"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        was = _object_text(before.objects.get(self.object_id))
        now = _object_text(step.mind.objects.get(self.object_id))
        return f"object {self.object_id}: {was} -> {now}" if was != now else ""


@dataclass(frozen=True, slots=True)
class TimeStop:
    """Stops at the first frame not before a time, in seconds."""

    time: float

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"time {self.time:g}"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        reached = step.time >= self.time and (before.frame_index < 0 or before.time < self.time)
        return f"{step.time:.2f} s" if reached else ""


@dataclass(frozen=True, slots=True)
class FrameStop:
    """Stops at the first frame with at least this number."""

    frame: int

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"frame {self.frame}"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        reached = before.frame_index < self.frame <= step.frame_index
        return f"frame {step.frame_index}" if reached else ""


@dataclass(frozen=True, slots=True)
class WhenStop:
    """Stops when an expression becomes true; for a quantity, or with `changes`, when it changes.

    The history of an expression with windows begins when it is first evaluated, or when the stepper last went
    back.
    """

    expression: Expression
    changes: bool = False
    _monitor: ExpressionMonitor = field(
        default_factory=lambda: ExpressionMonitor(), compare=False, repr=False
    )

    @property
    def text(self) -> str:
        """See `StopCondition`."""
        return f"{'change' if self.changes else 'when'} {self.expression.text}"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        was, now = self._monitor(self.expression, before, step.mind)
        changes = self.changes or self.expression.quantity
        if not changes:
            truths = {k: v for k, v in now.truths.items() if isinstance(v, Truth)}
            old = {k: v for k, v in was.truths.items() if isinstance(v, Truth)} if was else {}
            return _change_text(self.expression.text, old, truths, False)
        if was is None:
            return ""
        new_verdicts = {r.objects: str(r) for r in now.readings}
        old_verdicts = {r.objects: str(r) for r in was.readings}
        return next(
            (
                f"{self.expression.text} {_arguments(ids)}: {old_verdicts.get(ids, 'nothing')} -> {text}"
                for ids, text in new_verdicts.items()
                if text != old_verdicts.get(ids)
            ),
            "",
        )


@dataclass(slots=True)
class ExpressionMonitor:
    """Evaluates an expression from mind to mind; restarts at a mind that does not follow the last one."""

    mind: Mind | None = None
    result: ExpressionResult | None = None

    def __call__(
        self, expression: Expression, before: Mind, after: Mind
    ) -> tuple[ExpressionResult | None, ExpressionResult]:
        """Its values before and after a step."""
        if before is not self.mind:
            self.result = expression.judge(before) if before.frame_index >= 0 else None
        was = self.result
        self.mind, self.result = after, expression.judge(after, was)
        return was, self.result


@dataclass(frozen=True, slots=True)
class PredicateStop:
    """Stops when a function of the step returns true."""

    predicate: Predicate
    text: str = "predicate"

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        return self.text if self.predicate(step) else ""


@dataclass(frozen=True, slots=True)
class AnyStop:
    """Stops when any of several conditions is met, for ambiguous words."""

    text: str
    stops: tuple[StopCondition, ...]

    def met(self, before: Mind, step: Step) -> str:
        """See `StopCondition`."""
        return "; ".join(filter(None, (s.met(before, step) for s in self.stops)))


def stage_names(mind: Mind) -> tuple[str, ...]:
    """The stages of all tasks; none before the first step."""
    return tuple(dict.fromkeys(s.stage for t in mind.tasks for s in t.stages))


def rule_names(mind: Mind) -> tuple[str, ...]:
    """The rules of a mind; none before its first step."""
    return tuple(rule.name for rule in rule_memory(mind).rules)


def rule_verdicts(mind: Mind, name: str) -> Mapping[tuple[int, ...], Truth]:
    """The verdict of a rule for every assignment of objects; empty before the first step."""
    return verdicts(mind, name) if rule_memory(mind).now is not None else {}


def _change_text(
    name: str,
    was: Mapping[tuple[int, ...], Truth],
    now: Mapping[tuple[int, ...], Truth],
    changes: bool,
) -> str:
    """A text about the first assignment of objects for which a rule became true, or changed."""
    for ids in sorted({*was, *now}):
        # Rules are unknown for objects that have vanished, and were unknown for new ones.
        old, new = was.get(ids, Truth.UNKNOWN), now.get(ids, Truth.UNKNOWN)
        if old is not new and (changes or new is Truth.TRUE):
            return f"{name}{_arguments(ids)} is {new.value} (was {old.value})"
    return ""


def _arguments(ids: tuple[int, ...]) -> str:
    return f"({', '.join(map(str, ids))})" if ids else ""


def _stage_statuses(mind: Mind, stage: str) -> dict[str, tuple[str, bool]]:
    return {
        task.task: (s.status.value, task.current == stage)
        for task in mind.tasks
        for s in task.stages
        if s.stage == stage
    }


def _stage_text(stage: str, status: str, current: bool) -> str:
    return f"stage {stage} is {status}" + (", and current" if current else "")


def _object_text(belief: ObjectBelief | None) -> str:
    if belief is None:
        return "not known"
    return f"{belief.name}, {belief.presence.value}"
