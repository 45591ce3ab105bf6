"""One task at one moment: the objects that play its actors, and the observations of its actions."""

from __future__ import annotations

from functools import cached_property

from visup.agent import Binding, Mind, Relation, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.states import TaskStep
from visup.tasks.grammar.conditions import Condition
from visup.tasks.grammar.nodes import Hold
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.verification.motion_onset import SETTING_OUT, moving_bodies
from visup.tasks.verification.observation import NO_MEMORY, ActionObservation, ObservationMemory
from visup.tasks.verification.observe import RelationLookup
from visup.tasks.verification.observe import observe as observe_action
from visup.tasks.verification.passing import gap_between, vanished_into
from visup.tasks.verification.stage_conditions import ConditionEvaluator


class TaskSnapshot:
    """One task at one moment: the objects that play its actors, and the observations of its actions.

    Args:
        mind: The mind.
        bindings: The casting.
        model: The task with the meanings of its actions.
        before: The state of the facts after the previous step.
    """

    def __init__(
        self,
        mind: Mind,
        bindings: tuple[Binding, ...],
        model: MonitoredPhases,
        before: ObservationMemory = NO_MEMORY,
    ) -> None:
        self.mind = mind
        self.bindings = bindings
        self._actions = model.actions
        self._objects = {b.actor: b.object_id for b in bindings}
        self._spare = model.spare
        self._relations = RelationLookup(mind, model.evaluators, before, model.rhythms)
        self._conditions = ConditionEvaluator(model.task, self._holds, self._relations)
        self._seen: dict[tuple[str, tuple[str, ...]], ActionObservation] = {}
        self._observed: dict[int, tuple[TaskStep, ActionObservation]] = {}
        self._pausing = model.pauses
        self.pauses = before.pauses.noted(
            model.pauses,
            lambda c: self._conditions.relation(c.condition, c.lasting),
            mind.time if before.time is None else before.time,
            mind.time,
            model.settings.unseen_s,
        )

    def observe(self, step: TaskStep) -> ActionObservation:
        """The present observation of a step."""
        # Cached by identity, which is fast, as steps are requested about a hundred times per frame. The step
        # is stored as well, so that its id is not reused.
        found = self._observed.get(id(step))
        if found is None:
            found = self._observed[id(step)] = step, self._judge(step)
        return found[1]

    def _judge(self, step: TaskStep) -> ActionObservation:
        """The observation of a step, with the conditions that the course states for it."""
        if not step.conditions:
            return self._required(step)
        if self.pauses.now(step.pauses) is not None:
            return ActionObservation(paused=True, pauses=self.pauses)
        seen = replace(self._required(step), pauses=self.pauses)
        return self._conditions.apply(step, seen)

    def _required(self, step: TaskStep) -> ActionObservation:
        """The observation of a required action; an object that vanished into another one touches it."""
        seen = self._observe_action(step.action, step.actors).settled
        if seen.holds is not Truth.UNKNOWN or "touching" not in self._actions[step.action].holds:
            return seen
        objects = self.objects(step.actors)
        since = vanished_into(self.mind, objects)
        if since is None:
            return seen
        contact = Relation("touching", objects, Truth.TRUE, since)
        return replace(
            seen, holds=Truth.TRUE, held_by=contact, helps=contact, entry=contact, observed=True
        )

    @cached_property
    def setting_out(self) -> frozenset[int]:
        """Ids of the bodies that move now, fast enough to have set out."""
        return moving_bodies(self.mind, SETTING_OUT)

    def holds(self, condition: Condition, lasting: Hold | None) -> Truth:
        """Whether a condition holds, and has for the required time."""
        return self._conditions.relation(condition, lasting).truth

    @property
    def memory(self) -> ObservationMemory:
        """The state of the facts for the next step."""
        # Facts are not evaluated during a pause: they keep their state.
        return self._relations.memory(self.pauses, self.pauses.now(self._pausing) is not None)

    def _observe_action(self, action: str, actors: tuple[str, ...]) -> ActionObservation:
        key = (action, actors)
        if key not in self._seen:
            objects = tuple(self._objects.get(a) for a in actors)
            seen = observe_action(self._actions[action], objects, self._relations)
            absent = any(
                o is None and a in self._spare for a, o in zip(actors, objects, strict=True)
            )
            gap = gap_between(self.mind, objects)
            self._seen[key] = replace(seen, absent=absent, distance=gap)
        return self._seen[key]

    def _holds(self, action: str, actors: tuple[str, ...]) -> Truth:
        return self._observe_action(action, actors).holds

    def found(self, actors: tuple[str, ...]) -> bool:
        """Whether all the given actors are bound to objects."""
        return all(self._objects.get(a) is not None for a in actors)

    def objects(self, actors: tuple[str, ...]) -> tuple[int, ...]:
        """Ids of the objects of the given actors, without unbound ones."""
        ids = (self._objects.get(a) for a in actors)
        return tuple(i for i in ids if i is not None)
