"""Explains why something has not happened: the unmet conditions with their margins."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

from visup.agent import (
    Mind,
    ObjectBelief,
    Observation,
    Presence,
    Reasoner,
    Status,
    TaskBelief,
    Truth,
)
from visup.agent.model.errors import SettingsError
from visup.agent.model.fast_replace import replace
from visup.rules.coupling.reasoner import CouplingReasoner
from visup.rules.identity.identification import IdentityReasoner
from visup.rules.identity.votes import object_votes
from visup.rules.presence.reasoner import PresenceReasoner
from visup.rules.safety.explain import RuleExplanation
from visup.rules.safety.queries import evaluation_of, explain, object_choices, rule_named
from visup.rules.safety.reasoner import rule_memory
from visup.rules.wording.conditions import Condition, DecisionLog
from visup.rules.wording.sentences import short
from visup.stepping.explanations.evidence import Why, explanation_tree

STATUS_CLAUSES = {
    Status.ACTIVE: "no part of it has been seen yet",
    Status.DONE: "is complete",
    Status.FAILED: "has failed",
    Status.UNKNOWN: "cannot be evaluated",
}
"""Clauses for statuses of stages."""


def rule_unmet(mind: Mind, name: str, ids: tuple[int, ...] = ()) -> Why:
    """Why a rule is not true.

    Args:
        mind: The mind.
        name: The rule.
        ids: Objects; by default the assignment closest to true.

    Returns:
        Its false or unknown conditions with their margins; what suspends it; or that it is true.

    Raises:
        RuleError: There is no such rule, or it is not evaluated for these objects.
    """
    found = [explain(mind, name, *ids)] if ids else _all_explanations(mind, name)
    if not found:
        count = len(rule_named(evaluation_of(mind), name).variables)
        return Why(f"{name} is about {count} object(s), and that many are not in view")
    nearest = max(found, key=lambda e: (e.verdict is Truth.TRUE, *e.parts[0].interval))
    if nearest.verdict is Truth.TRUE:
        return Why(f"{nearest.text} is true", (explanation_tree(nearest),))
    when, *unless = nearest.parts
    parts = [
        Why(f"suspended: {u.line()}", (explanation_tree(u),))
        for u in unless
        if u.verdict is Truth.TRUE
    ]
    if when.verdict is not Truth.TRUE:
        parts.append(Why(when.line(), tuple(_unmet(when))))
    return Why(nearest.line(), tuple(parts), mind.frame_index, mind.time)


def _all_explanations(mind: Mind, name: str) -> list[RuleExplanation]:
    values = evaluation_of(mind)
    return [explain(mind, name, *ids) for ids in object_choices(values, rule_named(values, name))]


def _unmet(node: RuleExplanation) -> Iterator[Why]:
    """The parts of a formula that are not true; comparisons with their quantities."""
    for part in node.parts:
        if part.verdict is None:
            yield Why(part.line())
        elif part.verdict is not Truth.TRUE or " not " in f" {node.text}":
            yield Why(part.line(), tuple(_unmet(part)))


def stage_unmet(mind: Mind, stage: str) -> Why:
    """Why a stage is not active.

    Raises:
        SettingsError: There is no such stage.
    """
    for task in mind.tasks:
        for number, s in enumerate(task.stages):
            if s.stage != stage:
                continue
            if s.status is not Status.PENDING:
                status = STATUS_CLAUSES.get(s.status, f"is {s.status.value}")
                why = f": {s.evidence}" if s.evidence else ""
                return Why(f"stage {stage} has begun, and {status}{why}")
            return Why(
                f"stage {stage} is pending", tuple(_missing_before_stage(mind, task, number))
            )
    known = ", ".join(s.stage for t in mind.tasks for s in t.stages) or "no task was given"
    raise SettingsError(f"there is no stage '{stage}'", expected=known)


def _missing_before_stage(mind: Mind, task: TaskBelief, number: int) -> Iterator[Why]:
    for b in task.bindings:
        if b.object_id is None:
            yield Why(f"{b.actor} ({' or '.join(b.models)}) is not bound to any object")
    for s in task.stages[:number]:
        if s.status is not Status.DONE:
            yield Why(f"before it, {s.stage} is {s.status.value}: {s.evidence or 'not begun'}")
    if task.verdict.value in ("interrupted", "failed", "succeeded"):
        yield Why(f"the task is {task.verdict.value}: {task.evidence}")
    for required in task.expected:
        r = mind.relation(required.relation, *required.objects)
        names = ", ".join(short(mind, i) for i in required.objects)
        if r is None or r.truth is not Truth.TRUE:
            truth = "not evaluated" if r is None else r.truth.value
            value = "" if r is None or r.value is None else f"; its value is {r.value:.3g}"
            yield Why(f"awaited: {required.relation}({names}) is {truth}{value}")


@dataclass(frozen=True, slots=True)
class LastStep:
    """The last step, for re-evaluation by reasoners that explain themselves.

    Attributes:
        mind: The mind after the step.
        before: The mind before it, or None before the first step.
        observation: Its observation.
        reasoners: All reasoners in order.
    """

    mind: Mind
    before: Mind | None
    observation: Observation | None
    reasoners: Sequence[Reasoner]

    def conditions(
        self, kind: type[ExplainingReasoner], decision: str, objects: tuple[int, ...]
    ) -> tuple[Condition, ...]:
        """The conditions of a reasoner's decision in this step."""
        if self.before is None or self.observation is None:
            return (Condition("a step has been taken", False),)
        observation = self.observation
        mind = replace(
            self.before,
            time=observation.time,
            frame_index=observation.frame_index,
            frame_size=observation.frame_size,
            answers=MappingProxyType({**self.before.answers, **self.mind.answers}),
        )
        for reasoner in self.reasoners:
            unwrapped = getattr(reasoner, "reasoner", reasoner)  # unwrap `AssumingReasoner`
            if isinstance(unwrapped, kind):
                return unwrapped.explain(mind, observation).get((decision, objects), ())
            mind = reasoner(mind, observation).mind
        return (Condition("there is a reasoner that decides it", False),)


class ExplainingReasoner(Protocol):
    """A reasoner that gives the conditions of its decisions."""

    def explain(self, mind: Mind, observation: Observation) -> DecisionLog:  # noqa: D102
        ...


def entry_unmet(step: LastStep, object_id: int) -> Why:
    """Why the entry of an object was not reported."""
    belief = _belief(step.mind, object_id)
    if belief.confirmed:
        return Why(f"object {object_id} has entered; first seen at {belief.first_seen:.2f} s")
    unmet = _conditions(step, PresenceReasoner, "entry", (object_id,))
    last = Why(f"last seen at {belief.last_seen:.2f} s")
    return Why(f"object {object_id} has not entered", (*unmet, last))


_CHANGES = {
    Presence.LEFT: "exit",
    Presence.HIDDEN: "occlusion",
    Presence.SEEN: "reappearance",
}
"""Presence -> the decision that leads to it."""


def presence_unmet(step: LastStep, object_id: int, presence: Presence) -> Why:
    """Why an object is not believed to be hidden, gone or seen."""
    belief = _belief(step.mind, object_id)
    if belief.presence is presence:
        return Why(f"object {object_id} is {presence.value}")
    present_state = Why(f"it is {belief.presence.value}, last seen at {belief.last_seen:.2f} s")
    unmet = _conditions(step, PresenceReasoner, _CHANGES[presence], (object_id,))
    return Why(
        f"object {object_id} is not believed to be {presence.value}", (present_state, *unmet)
    )


def identity_unmet(step: LastStep, object_id: int) -> Why:
    """Why an object was not identified."""
    belief = _belief(step.mind, object_id)
    votes = object_votes(step.mind, object_id)
    if votes.reported is not None and votes.reported == belief.name:
        return Why(f"object {object_id} was identified as {votes.reported}")
    parts = [*_conditions(step, IdentityReasoner, "identified", (object_id,))]
    last_match = "never" if votes.last_matched is None else f"at {votes.last_matched:.2f} s"
    parts.append(Why(f"last matched against the models: {last_match}"))
    if not belief.confirmed:
        parts.append(entry_unmet(step, object_id))
    return Why(f"object {object_id} is not identified", tuple(parts))


def coupling_unmet(step: LastStep, a: int, b: int) -> Why:
    """Why two objects are not believed to be coupled."""
    low, high = sorted((a, b))
    for object_id in (low, high):
        _belief(step.mind, object_id)
    if step.mind.coupled(low, high):
        return Why(f"objects {low} and {high} are coupled")
    touching = step.mind.relation("touching", low, high)
    touching_state = Why(f"touching is {touching.truth.value if touching else 'not evaluated'}")
    unmet = _conditions(step, CouplingReasoner, "coupled", (low, high))
    return Why(f"objects {low} and {high} are not believed to be coupled", (touching_state, *unmet))


def _conditions(
    step: LastStep, kind: type[ExplainingReasoner], decision: str, objects: tuple[int, ...]
) -> tuple[Why, ...]:
    return tuple(Why(c.line()) for c in step.conditions(kind, decision, objects))


def relation_unmet(mind: Mind, name: str, objects: tuple[int, ...]) -> Why:
    """Why a relation is not true."""
    r = mind.relation(name, *objects)
    call = f"{name}({', '.join(map(str, objects))})"
    if r is None:
        absent = [i for i in objects if i not in {b.id for b in mind.present()}]
        parts = tuple(Why(f"object {i} is not believed to be there") for i in absent)
        return Why(f"{call} is not evaluated", parts)
    reasons = []
    if r.value is not None:
        spread = "" if r.sigma is None else f" ± {r.sigma:.3g}"
        reasons.append(Why(f"its value is {r.value:.3g}{spread}"))
    for i in objects:
        belief = mind.objects[i]
        if belief.last_seen < mind.time:
            reasons.append(Why(f"object {i} was last seen at {belief.last_seen:.2f} s"))
    return Why(f"{call} has been {r.truth.value} since {r.since:.2f} s", tuple(reasons))


def alert_unmet(mind: Mind, kind: str, objects: tuple[int, ...]) -> Why:
    """Why no alert of a kind is open, if a rule raises it."""
    for alert in mind.alerts:
        if alert.kind == kind and (not objects or set(alert.objects) == set(objects)):
            return Why(f"alert {alert.id} is open since {alert.opened:.2f} s: {alert.cause}")
    why = rule_unmet(mind, kind, objects)
    cooldowns = rule_memory(mind).cooling.items()
    cooling_down = [
        Why(f"it rests for objects {sorted(who)} until {until:.2f} s")
        for (rule, who), until in cooldowns
        if rule == kind
    ]
    return Why(why.text, (*why.parts, *cooling_down), why.frame_index, why.time)


def _belief(mind: Mind, object_id: int) -> ObjectBelief:
    if object_id not in mind.objects:
        known = ", ".join(map(str, sorted(mind.objects))) or "none yet"
        raise SettingsError(f"there is no object {object_id}", expected=known)
    return mind.objects[object_id]
