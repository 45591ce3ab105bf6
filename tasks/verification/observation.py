"""Records: the observation of an action at one moment, and the state of facts between moments."""

from __future__ import annotations

from dataclasses import dataclass

from visup.agent import Relation, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.actions.rhythm import Beats
from visup.tasks.automaton.states import RunningDeadline, TaskStep
from visup.tasks.verification.pauses import NO_PAUSES, PauseRecord


@dataclass(frozen=True, slots=True)
class ActionObservation:
    """The observation of an action between its actors.

    Attributes:
        holds: Whether the action holds.
        held_by: A true relation by which it holds, or None.
        helps: A true relation by which it holds or progresses, or None.
        entry: A true relation by which it begins, or None.
        contrary: A true relation by which it fails, or None.
        decisive: Whether the contrary counts even while the action holds, because the course states it.
        over: Whether the end condition of its course holds; None when the course has none.
        observed: Whether anything is known about it; False while an actor is not found or its object
            is hidden.
        new_trend: A trend by which it begins that has just set in, and has not lasted yet, or None.
        round: Whether its entry is a trend that is due to one actor moving around the other.
        paused: Whether the work on it is paused: then there is no observation of it.
        pauses: All pauses of the task so far.
        absent: Whether one of its actors is optional and has no object: then the step is not due.
        moves_on: Whether it holds by a contact at which neither body has slowed down yet.
        unreached: Time since when an approach, or carrying, is over without having reached its goal, or None.
        distance: Gap between the outlines of its two actors, pixels; None if unknown, or without two actors.
        carried_past: Whether it would begin by a contact, but one actor is only carried past the other.
        carried: Whether either of its actors is held by a third object.
        passed_since: If it begins by a contact, but one actor passes the other: since when, seconds; or None.
    """

    holds: Truth = Truth.UNKNOWN
    held_by: Relation | None = None
    helps: Relation | None = None
    entry: Relation | None = None
    contrary: Relation | None = None
    decisive: bool = False
    over: Truth | None = None
    observed: bool = False
    new_trend: Relation | None = None
    round: bool = False
    paused: bool = False
    pauses: PauseRecord = NO_PAUSES
    absent: bool = False
    moves_on: bool = False
    carried_past: bool = False
    carried: bool = False
    passed_since: float | None = None
    unreached: float | None = None
    distance: float | None = None

    def elapsed(self, step: TaskStep, since: float, now: float) -> float:
        """Seconds from one time to another in which the work on a step was not paused."""
        pauses = step.pauses if step.conditions else ()
        return self.pauses.elapsed(pauses, since, now) if pauses else now - since

    @property
    def settled(self) -> ActionObservation:
        """The observation that counts for a stage: without a contact at which neither body slows down."""
        if not self.moves_on:
            return self
        return replace(self, holds=Truth.UNKNOWN, held_by=None, helps=None, entry=None)


UNOBSERVED = ActionObservation()


def overdue(step: TaskStep, seen: ActionObservation, now: float) -> RunningDeadline | None:
    """The first expired `within` around the step, or None; it is suspended in pauses around it."""

    def left(due: RunningDeadline) -> float:
        if not due.pauses:
            return due.at - now
        return due.seconds - seen.pauses.elapsed(due.pauses, due.at - due.seconds, now)

    return next((d for d in step.deadlines if left(d) < 0.0), None)


@dataclass(frozen=True, slots=True)
class ObservationMemory:
    """State of the facts of a task at one moment, for the next.

    Attributes:
        time: Time of that moment, seconds; None before the first.
        lasting: (key, time since when it has been true) of each fact that is not a relation of the mind.
        beats: Occurrences of periodic facts, by key.
        pauses: All pauses so far.
    """

    time: float | None = None
    lasting: tuple[tuple[str, float], ...] = ()
    beats: tuple[tuple[str, Beats], ...] = ()
    pauses: PauseRecord = NO_PAUSES


NO_MEMORY = ObservationMemory()
