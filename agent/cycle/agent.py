"""The cogitation-action cycle (paper, section 2; after CoCo), on one screen: `Agent.step`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from visup.agent.contract.behaviour import Behaviour, Outcome, Reasoner
from visup.agent.contract.limits import Limits
from visup.agent.contract.phases import AgentSnapshot, Phase
from visup.agent.contract.saving import Saveable
from visup.agent.cycle.alerts import alert_events, fault_conditions, update_alerts
from visup.agent.cycle.answers import apply_answers, resolve_answer
from visup.agent.cycle.outcomes import merge_outcomes
from visup.agent.cycle.system_alerts import REASONING_FAILED
from visup.agent.execution.behaviour_slot import BehaviourSlot
from visup.agent.execution.pipeline import ordered_slots, perceive
from visup.agent.execution.runners import error_line
from visup.agent.model.events import AlertCondition, Directive, Severity
from visup.agent.model.fast_replace import replace
from visup.agent.model.mind import Mind, Zone
from visup.agent.model.records import Frame, Observation
from visup.agent.model.step import Observer, Step


@dataclass(frozen=True, slots=True)
class Reasoners:
    """The reasoners of an agent by phase, each in the order in which they run.

    Attributes:
        update: Percepts enter the mind.
        cogitate: Relations and rules are evaluated, events derived.
        match: Stages of tasks are matched and verified.
        attend: Objects that need closer observation are chosen, behaviours are activated, and runtime
            faults become alert conditions.
    """

    update: tuple[Reasoner, ...] = ()
    cogitate: tuple[Reasoner, ...] = ()
    match: tuple[Reasoner, ...] = ()
    attend: tuple[Reasoner, ...] = ()

    def by_phase(self) -> tuple[tuple[Phase, tuple[Reasoner, ...]], ...]:
        """The reasoning phases in order, each with its reasoners."""
        return (
            (Phase.UPDATE, self.update),
            (Phase.COGITATE, self.cogitate),
            (Phase.MATCH, self.match),
            (Phase.ATTEND, self.attend),
        )

    def __iter__(self) -> Iterator[Reasoner]:
        """All reasoners, in the order in which they run."""
        return (reasoner for _, reasoners in self.by_phase() for reasoner in reasoners)


@dataclass(slots=True)
class Agent:
    """A mind with the behaviours and reasoners that maintain it.

    Agents share nothing: ids, time and state belong to the instance, and the same frames give the
    same steps.

    Attributes:
        behaviours: The perception routines.
        reasoners: The reasoners, by phase.
        actors: Actor name -> model names, known before the first frame.
        zones: Parts of the scene that rules can name.
        observers: Called after each step.
        models: Further names of models that the operator may answer with.
        cast: Actors of the tasks with their models; the operator may also answer with these.
        limits: Limits of time and memory for behaviours.
        mind: The current mental model.
    """

    behaviours: Sequence[Behaviour] = ()
    reasoners: Reasoners = field(default_factory=Reasoners)
    actors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    observers: Sequence[Observer] = ()
    zones: Sequence[Zone] = ()
    models: Sequence[str] = ()
    cast: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    limits: Limits = field(default_factory=Limits)
    mind: Mind = field(init=False)
    directives: tuple[Directive, ...] = field(default=(), init=False)
    _slots: list[BehaviourSlot] = field(init=False, repr=False)
    _alerts_opened: int = field(default=0, init=False, repr=False)
    _answers: dict[int, str] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        self.mind = Mind(actors=MappingProxyType(dict(self.actors)), zones=tuple(self.zones))
        self._slots = ordered_slots(self.behaviours, self.limits)

    def step(self, frame: Frame) -> Step:
        """Perceive, update, cogitate, match, attend, act: one turn of the cycle.

        Args:
            frame: The next frame; its time must not be before that of the last one.

        Returns:
            The complete record of the step; `mind` is now `Step.mind`.
        """
        step = self.reason(self.perceive(frame))
        for observer in self.observers:
            observer(step, frame)
        return step

    def perceive(self, frame: Frame) -> Observation:
        """Perceive only: run the behaviours on the frame, without changing the mind."""
        return perceive(self._slots, frame, self.directives)

    def reason(self, observation: Observation, answers: Mapping[int, str] | None = None) -> Step:
        """Reason about an observation, live or recorded; observers are not called.

        Args:
            observation: The percepts of the next frame.
            answers: The operator's answers before that step of a recorded run: object id ->
                model name, as in its 'answer' events. None for a live run.

        Returns:
            The complete record of the step; `mind` is now `Step.mind`.
        """
        *_, (_, conclusions) = self.phases(observation, answers)
        return self.act(observation, conclusions)

    def phases(
        self, observation: Observation, answers: Mapping[int, str] | None = None
    ) -> Iterator[tuple[Phase, Outcome]]:
        """Run update, cogitate, match and attend one by one, for inspection; the mind does not change.

        Args:
            observation: The percepts of the next frame.
            answers: As in `reason`.

        Yields:
            Each completed phase, with all conclusions so far; pass the last one to `act`.
        """
        begin = replace(
            self.mind,
            time=observation.time,
            frame_index=observation.frame_index,
            frame_size=observation.frame_size,
        )
        begin, answered = apply_answers(begin, self._answers if answers is None else answers)
        self._answers = {}
        outcome = Outcome(begin, answered)
        for phase, reasoners in self.reasoners.by_phase():
            for reasoner in reasoners:
                try:
                    outcome = merge_outcomes(
                        outcome, reasoner(outcome.mind, observation), observation
                    )
                except (Exception, SystemExit) as fault:
                    # The unfinished mind is dropped: beliefs stay unchanged, and all observations count as
                    # unknown.
                    yield (
                        phase,
                        replace(
                            _failed_outcome(begin, observation, reasoner, fault), events=answered
                        ),
                    )
                    return
            yield phase, outcome

    def act(self, observation: Observation, conclusions: Outcome) -> Step:
        """The last phase: alerts and directives; the conclusions become the mind."""
        conditions = (*conclusions.conditions, *fault_conditions(observation))
        alerts, opened, closed = update_alerts(
            self.mind.alerts,
            conditions,
            observation.time,
            self._alerts_opened + 1,
            conclusions.mind.unknown,
        )
        self._alerts_opened += len(opened)
        events = (
            *conclusions.events,
            *alert_events(opened, closed, observation.time, observation.frame_index),
        )
        step = Step(
            frame_index=observation.frame_index,
            time=observation.time,
            observation=observation,
            mind=replace(conclusions.mind, alerts=alerts),
            events=events,
            alerts=(*opened, *closed),
            directives=conclusions.directives,
        )
        self.mind, self.directives = step.mind, step.directives
        return step

    def snapshot(self) -> AgentSnapshot:
        """The current beliefs, to return to with `restore`; a few references, no copy."""
        answers = MappingProxyType(dict(self._answers))
        return AgentSnapshot(self.mind, self.directives, self._alerts_opened, answers)

    def restore(self, snapshot: AgentSnapshot) -> None:
        """Return to the beliefs of a snapshot, of this or another agent; behaviours are not affected."""
        self.mind, self.directives = snapshot.mind, snapshot.directives
        self._alerts_opened, self._answers = snapshot.alerts_opened, dict(snapshot.answers)

    def close(self) -> None:
        """Release the threads and processes of behaviours, which would also end with the agent itself."""
        for slot in self._slots:
            slot.runner.close()

    def run(
        self, frames: Iterable[Frame], until: Callable[[Step], bool] | None = None
    ) -> Step | None:
        """Step over frames until they end or a condition holds.

        Args:
            frames: A source; a further run continues where this one stopped.
            until: Evaluated after each step.

        Returns:
            The last step, or None when there was no frame.
        """
        last = None
        for last in self.steps(frames):
            if until is not None and until(last):
                break
        return last

    def steps(self, frames: Iterable[Frame]) -> Iterator[Step]:
        """Each step over frames, one at a time."""
        return (self.step(frame) for frame in frames)

    def answer(self, object_id: int, name: str) -> None:
        """Say what an object is; a fact from the next step on, reported by an 'answer' event.

        Args:
            object_id: The object.
            name: A model, an actor, or 'unknown' for none of the models.

        Raises:
            SettingsError: There is no such object, or the name is unknown.
        """
        self._answers[object_id] = resolve_answer(
            self.mind, object_id, name, self.models, self.cast
        )

    def save(self) -> Mapping[str, Any]:
        """The complete state of this agent, for `visup.agent.storage.checkpoint`.

        Returns:
            `mind`, and `behaviours` by name, or None if one of them cannot save its state.
        """
        all_saveable = all(s.is_saveable for s in self._slots)
        saveable = {s.behaviour.contract.name: s.behaviour for s in self._slots if s.is_saveable}
        return {
            "mind": (self.mind, self.directives, self._alerts_opened, self._answers),
            "behaviours": {n: _saved(b) for n, b in saveable.items()} if all_saveable else None,
            "slots": {s.behaviour.contract.name: s.state_dict() for s in self._slots},
        }

    def load(self, state: Mapping[str, Any]) -> bool:
        """Load the state of an agent with the same settings; `state` is consumed.

        Returns:
            Whether the behaviours were restored as well; otherwise only the mind was.
        """
        self.mind, self.directives, self._alerts_opened, self._answers = state["mind"]
        behaviours = state["behaviours"]
        for slot in self._slots if behaviours is not None else ():
            name = slot.behaviour.contract.name
            slot.behaviour.load(behaviours[name])  # type: ignore[attr-defined]  # it gave its state
            slot.load_state_dict(state["slots"][name])
        return behaviours is not None


def _saved(behaviour: Behaviour) -> Mapping[str, Any]:
    assert isinstance(behaviour, Saveable)
    return behaviour.save()


def _failed_outcome(
    mind: Mind, observation: Observation, reasoner: Reasoner, fault: BaseException
) -> Outcome:
    name = getattr(reasoner, "__name__", type(reasoner).__name__)
    condition = AlertCondition(
        REASONING_FAILED,
        (),
        Severity.CRITICAL,
        f"Reasoning failed in '{name}'; beliefs are as before this frame and may be stale.",
        (error_line(fault),),
        key=name,
        needs=(),
    )
    current_conditions = tuple(
        AlertCondition(a.kind, a.objects, a.severity, a.cause, a.evidence, a.key, a.needs)
        for a in mind.alerts
    )
    unknown = frozenset(kind for r in observation.reports for kind in r.gives)
    return Outcome(
        replace(mind, unknown=mind.unknown | unknown), (), (*current_conditions, condition)
    )
