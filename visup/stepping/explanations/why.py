"""Explains alerts, beliefs, stages and verdicts, down to the percepts."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import Any, Protocol

from visup.agent import (
    Alert,
    Coupling,
    Event,
    Mind,
    ObjectBelief,
    Observation,
    Relation,
    ReportState,
    StageBelief,
    TaskBelief,
    Truth,
)
from visup.agent.cycle.system_alerts import BEHAVIOUR_FAILED
from visup.agent.model.errors import SettingsError
from visup.rules.coupling.evidence import COUPLING
from visup.rules.safety.queries import explain
from visup.rules.safety.reasoner import rule_memory
from visup.rules.wording.sentences import short
from visup.stepping.explanations.evidence import (
    Why,
    explanation_tree,
    percept_reason,
    region_percepts,
)

MAX_STEPS_BACK = 250
"""Steps to search backwards for the latest percepts that identify an object."""


REPORTED_HEADING = "what was last reported of it:"
"""Heading of the latest events of a stage."""


class RunTimeline(Protocol):
    """The part of a stepper that explanations use."""

    @property
    def at(self) -> int: ...  # noqa: D102
    @property
    def begin(self) -> int: ...  # noqa: D102
    @property
    def mind(self) -> Mind: ...  # noqa: D102

    def mind_at(self, number: int) -> Mind: ...  # noqa: D102
    def observation_at(self, number: int) -> Observation: ...  # noqa: D102
    def events(self, first: int = 1, last: int | None = None) -> Any: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class ReasonFinder:
    """Finds reasons for the beliefs after one step.

    Attributes:
        timeline: Gives access to past steps.
        number: The step.
        mind: The mind after it.
    """

    timeline: RunTimeline
    number: int
    mind: Mind

    def after(self, number: int) -> ReasonFinder:
        """The same for another step."""
        if number == self.number:
            return self
        return ReasonFinder(self.timeline, number, self.timeline.mind_at(number))

    def of(self, what: object) -> Why:
        """Explain a belief.

        Raises:
            SettingsError: It cannot be explained.
        """
        match what:
            case Alert():
                return self.alert(what.id)
            case Event():
                return self.event(what)
            case Relation():
                return self.relation(what.name, what.objects)
            case Coupling():
                return self.relation("coupled", what.objects)
            case ObjectBelief():
                return self.object(what.id)
            case TaskBelief():
                return self.verdict(what.task)
            case StageBelief():
                return self.stage(what.stage)
        raise SettingsError(f"a {type(what).__name__} cannot be explained")

    def alert(self, alert_id: int) -> Why:
        """Why an alert was opened, and why it stays open; closed alerts are found, too."""
        number, event = self._opening_event(alert_id)
        at_opening = self.after(number)
        open_alert = next((a for a in self.mind.alerts if a.id == alert_id), None)
        text = f"alert {alert_id}, {event.data['alert_kind']}: {event.text}"
        parts = [at_opening._cause(str(event.data["alert_kind"]), event)]
        if open_alert is None:
            parts.append(Why("it is closed"))
        elif open_alert.updated < self.mind.time:
            parts.append(Why(f"it last held at {open_alert.updated:.2f} s, and is not over yet"))
        return Why(text, tuple(parts), event.frame_index, event.time)

    def _opening_event(self, alert_id: int) -> tuple[int, Event]:
        for number, event in self.timeline.events(last=self.number):
            if event.kind == "alert" and event.data.get("alert") == alert_id:
                return number, event
        known = ", ".join(str(a.id) for a in self.mind.alerts) or "none is open now"
        raise SettingsError(f"no alert {alert_id} has been raised so far", expected=known)

    def _cause(self, kind: str, event: Event) -> Why:
        """Why an alert condition held after this step."""
        if kind in {rule.name for rule in rule_memory(self.mind).rules}:
            return self.rule(kind, event.objects)
        evidence = tuple(Why(str(e)) for e in event.data.get("evidence", ()))
        if kind == "stage_failing":
            stages = [s.stage for t in self.mind.tasks for s in t.stages if s.evidence]
            failing = tuple(self.stage(s) for s in stages if f"`{s}`" in event.text)
            if failing:  # these include their actors
                return Why("because", (*evidence, *failing))
        if kind == BEHAVIOUR_FAILED:
            evidence += self._failures()
        return Why("because", (*evidence, *self._objects(event.objects)))

    def _failures(self) -> tuple[Why, ...]:
        observation = self.timeline.observation_at(self.number)
        frame = observation.frame_index, observation.time
        failed = (
            r for r in observation.reports if r.state not in (ReportState.RAN, ReportState.RESTED)
        )
        return tuple(Why(f"{r.behaviour} {r.state.value}: {r.error}", (), *frame) for r in failed)

    def rule(self, name: str, objects: tuple[int, ...]) -> Why:
        """Why a rule is true, false or unknown for some objects, with the beliefs about them.

        Raises:
            RuleError: There is no such rule, or it is not evaluated for these objects.
        """
        orders = list(permutations(objects))
        found = [explain(self.mind, name, *ids) for ids in orders[: 6 if len(objects) < 4 else 1]]
        best = next((e for e in found if e.verdict is Truth.TRUE), found[0])
        reason = explanation_tree(best)
        return Why(
            reason.text,
            (*reason.parts, *self._objects(objects)),
            self.mind.frame_index,
            self.mind.time,
        )

    def relation(self, name: str, objects: tuple[int, ...], *, with_regions: bool = True) -> Why:
        """Why a relation has its truth: its quantity, since when, and the regions of its objects.

        Args:
            name: The relation.
            objects: Ids.
            with_regions: Whether to include the regions.

        Raises:
            SettingsError: It is not evaluated.
        """
        r = self.mind.relation(name, *objects)
        if r is None:
            named = f"{name}({', '.join(map(str, objects))})"
            raise SettingsError(
                f"{named} is not evaluated", expected="a relation of objects in view"
            )
        names = ", ".join(short(self.mind, i) for i in objects)
        # Some false relations have no start time: their `since` is the time of the step.
        dated = r.since < self.mind.time
        state = (
            f"has been {r.truth.value} since {r.since:.2f} s" if dated else f"is {r.truth.value}"
        )
        text = f"{name}({names}) {state}, confidence {r.confidence:.2f}"
        parts = self._measured(r) + (self._coupling(objects) if name == "coupled" else ())
        sightings = tuple(self._last_sighting(i) for i in objects) if with_regions else ()
        return Why(text, (*parts, *sightings), *self._position)

    def _measured(self, r: Relation) -> tuple[Why, ...]:
        if r.value is None:
            return ()
        spread = "" if r.sigma is None else f" ± {r.sigma:.3g}"
        return (Why(f"its value is {r.value:.3g}{spread}"),)

    def _coupling(self, objects: tuple[int, ...]) -> tuple[Why, ...]:
        low, high = sorted(objects)
        pending = self.mind.recall(COUPLING).get((low, high))
        since = {
            "they last converged at": getattr(pending, "converged_at", None),
            "apart, or leaving each other, since": getattr(pending, "apart_since", None),
        }
        reasons = [Why(f"{text} {t:.2f} s") for text, t in since.items() if t is not None]
        if pending is not None:
            reasons.append(
                Why(f"log odds that they touch and are at rest: {pending.rest_odds:.3g}")
            )
        return (
            *reasons,
            *(
                self.relation(n, (low, high), with_regions=False)
                for n in self._if_evaluated("touching", low, high)
            ),
        )

    def _if_evaluated(self, name: str, *objects: int) -> tuple[str, ...]:
        return (name,) if self.mind.relation(name, *objects) is not None else ()

    def object(self, object_id: int) -> Why:
        """Why an object is believed to be present, and its identity."""
        b = self._belief(object_id)
        return Why(
            f"object {b.id} is believed to be {b.presence.value}; it is {_display_name(b)}",
            (self._last_sighting(object_id), self.identity(object_id)),
            *self._position,
        )

    def identity(self, object_id: int) -> Why:
        """Explain an identity: answer, votes, and the latest matches."""
        b = self._belief(object_id)
        answer = self.mind.answers.get(object_id)
        answered = (Why(f"the operator said that it is {answer}"),) if answer else ()
        votes = tuple(
            Why(
                f"{c.name}: {c.votes:.2f} votes, share {c.share:.2f}, likelihood {c.confidence:.2f}"
            )
            for c in b.candidates
        )
        unnamed = Why(f"none of the models: likelihood {b.unknown:.2f}")
        matches = self._identity_percepts(b)
        return Why(
            f"object {b.id} is {_display_name(b)}",
            (*answered, *votes, unnamed, *matches),
            *self._position,
        )

    def _identity_percepts(self, b: ObjectBelief) -> tuple[Why, ...]:
        """The latest percepts about its identity."""
        number = self._step_of(b.last_seen)
        for earlier in range(number, max(self.timeline.begin, number - MAX_STEPS_BACK), -1):
            observation = self.timeline.observation_at(earlier)
            found = region_percepts(observation, b.region.id, names=True)
            identifying = tuple(w for w in found if w.percept and w.percept.kind != "region")
            if identifying:
                return identifying
        return (Why("no recent percept is about its identity"),)

    def _last_sighting(self, object_id: int) -> Why:
        """When and as which region an object was last seen."""
        b = self._belief(object_id)
        observation = self.timeline.observation_at(self._step_of(b.last_seen))
        name = f"object {b.id}, {short(self.mind, b.id)}" if b.candidates else f"object {b.id}"
        text = f"{name}, first seen at {b.first_seen:.2f} s, was last seen at {b.last_seen:.2f} s"
        return Why(text, region_percepts(observation, b.region.id))

    def _objects(self, objects: tuple[int, ...]) -> tuple[Why, ...]:
        return tuple(self.object(i) for i in objects if i in self.mind.objects)

    def stage(self, stage: str) -> Why:
        """Explain the status of a stage: evidence, requirements, actors.

        Raises:
            SettingsError: There is no such stage.
        """
        for task in self.mind.tasks:
            for s in task.stages:
                if s.stage == stage:
                    return self._stage(task, s)
        known = ", ".join(s.stage for t in self.mind.tasks for s in t.stages) or "no task was given"
        raise SettingsError(f"there is no stage '{stage}'", expected=known)

    def _stage(self, task: TaskBelief, s: StageBelief) -> Why:
        reported = [
            Why(e.text, (), e.frame_index, e.time)
            for _, e in self.timeline.events(last=self.number)
            if e.kind.startswith("stage_") and e.data.get("stage") == s.stage
        ]
        parts = [Why(s.evidence)] if s.evidence else []
        parts += [Why(REPORTED_HEADING, tuple(reported[-3:]))] if reported else []
        parts += self._required_relations(task) if task.current == s.stage else []
        text = f"stage {s.stage}: {s.status.value} since {s.since:.2f} s"
        return Why(f"{text}, confidence {s.confidence:.2f}", (*parts, *self._actors(task)))

    def _required_relations(self, task: TaskBelief) -> list[Why]:
        required = [(e.relation, e.objects) for e in task.expected]
        return [
            self.relation(n, o, with_regions=False)
            for n, o in required
            if self.mind.relation(n, *o) is not None
        ]

    def _actors(self, task: TaskBelief) -> tuple[Why, ...]:
        return tuple(
            Why(f"{b.actor} ({', '.join(b.models)}) is not bound to any object yet")
            if b.object_id is None
            else Why(
                f"{b.actor} is bound to object {b.object_id}, strength {b.strength:.2f}",
                (self.object(b.object_id),) if b.object_id in self.mind.objects else (),
            )
            for b in task.bindings
        )

    def verdict(self, name: str | None = None) -> Why:
        """Why the verdict on a task is what it is; by default the only task.

        Raises:
            SettingsError: There is no such task.
        """
        tasks = [t for t in self.mind.tasks if name in (None, t.task)]
        if not tasks:
            known = ", ".join(t.task for t in self.mind.tasks) or "no task was given"
            raise SettingsError(
                f"there is no task '{name}'" if name else "there is no verdict", expected=known
            )
        return self._verdict(tasks[0])

    def _verdict(self, task: TaskBelief) -> Why:
        stages = tuple(
            self._stage(task, s)
            if s.stage == task.current or s.status.value in ("failing", "failed")
            else Why(f"stage {s.stage}: {s.status.value} since {s.since:.2f} s")
            for s in task.stages
        )
        alerts = tuple(
            self.alert(a.id) for a in self.mind.alerts if a.cause.rstrip(".") == task.evidence
        )
        text = f"the verdict on {task.task} is {task.verdict.value}"
        evidence = (Why(task.evidence),) if task.evidence else ()
        return Why(text, (*evidence, *alerts, *stages), *self._position)

    def event(self, event: Event) -> Why:
        """Explain an event in the mind that reported it."""
        number = self._step_of(event.time)
        at_event = self.after(number)
        return Why(event.text, at_event._event_reasons(event), event.frame_index, event.time)

    def _event_reasons(self, event: Event) -> tuple[Why, ...]:
        data: Mapping[str, Any] = event.data
        if event.kind in ("alert", "alert_closed"):
            return (self.alert(int(data["alert"])),)
        if event.kind.startswith("stage_") and "stage" in data:
            return (self.stage(str(data["stage"])),)
        if event.kind == "verdict":
            return (self.verdict(data.get("task")),)
        if event.kind in ("coupled", "decoupled"):
            return (self.relation("coupled", event.objects),)
        if event.kind == "relation" and "relation" in data:
            return (self.relation(str(data["relation"]), event.objects),)
        if event.kind in ("identified", "question", "answer"):
            return tuple(self.identity(i) for i in event.objects)
        observation = self.timeline.observation_at(self.number)
        percepts = (
            ()
            if event.objects
            else tuple(
                percept_reason(p, observation)
                for r in observation.reports
                for p in r.percepts
                if p.kind == event.kind
            )
        )
        return (*self._objects(event.objects), *percepts)

    def _belief(self, object_id: int) -> ObjectBelief:
        belief = self.mind.objects.get(object_id)
        if belief is None:
            known = ", ".join(map(str, sorted(self.mind.objects))) or "none yet"
            raise SettingsError(f"there is no object {object_id}", expected=known)
        return belief

    def _step_of(self, time: float) -> int:
        """The step of the frame at a time, or the first known one after it."""
        numbers = range(self.timeline.begin + 1, self.number + 1)
        index = bisect_left(numbers, time, key=lambda n: self.timeline.observation_at(n).time)
        return numbers[min(index, len(numbers) - 1)]

    @property
    def _position(self) -> tuple[int, float]:
        return self.mind.frame_index, self.mind.time


def _display_name(b: ObjectBelief) -> str:
    return f"{b.name}, likelihood {b.confidence:.2f}"
