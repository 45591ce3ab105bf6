"""The state of supervision between steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from visup.agent import TaskBelief
from visup.tasks.automaton.states import TaskStep
from visup.tasks.casting.equals import Settled
from visup.tasks.supervision.hypotheses import TaskHypotheses
from visup.tasks.supervision.replay import PastStep
from visup.tasks.supervision.task_inference import ALONE, TaskActivity
from visup.tasks.verification.observation import NO_MEMORY, ObservationMemory


class OrderViolation(NamedTuple):
    """A step that was done before its turn, and the reason in one clause."""

    step: TaskStep
    why: str


@dataclass(frozen=True)
class TaskMemory:
    """The state of one task between steps.

    Attributes:
        time: Time of the step in which it was last updated, seconds.
        posterior: The hypotheses; None until its first actors are found.
        belief: The last belief.
        interrupted: Why the task was interrupted, or empty; permanent, unless an unexpected object turns out
            to be one of the actors.
        interrupting_objects: The unexpected objects that interrupted the task.
        unexplained_since: (object id, time since when it has been unexplained in seconds).
        broken_since: Time since when each invariant has been broken, seconds, or None.
        rival: A better casting that would change bindings: object id by actor; may be empty.
        rival_since: Time since when it has been better, seconds.
        settled: Actors that stay with their objects among several equal ones.
        observations: State of its facts: how long they have held, and when they paused work.
        activity: Whether it is in progress, if several tasks are given.
        gain: Latest evidence per second that it is in progress.
        inferred: Time of the last inference of whether it is in progress, seconds.
        past_steps: Past observations while an actor is missing, to be replayed once it is found.
        violated: The invariant about one object by which the task has failed, or empty.
        familiar_objects: Ids of unknown objects that are not unexpected, since they were present from the
            start or once held an actor: the rest of a machine of which only a part is known, or a person who
            works there.
        forbidden: Whether a broken invariant interrupted it, which is final: its stages no longer change.
        order_violation: The step that was done before its turn and has not been undone, or None.
        resting: Stages that wait to begin, each with the time since when its actors rest, seconds.
    """

    time: float
    posterior: TaskHypotheses | None
    belief: TaskBelief
    interrupted: str = ""
    interrupting_objects: tuple[int, ...] = ()
    unexplained_since: tuple[tuple[int, float], ...] = ()
    broken_since: tuple[float | None, ...] = ()
    rival: tuple[int | None, ...] = ()
    rival_since: float = 0.0
    settled: Settled = frozenset()
    observations: ObservationMemory = NO_MEMORY
    activity: TaskActivity = ALONE
    gain: float = 0.0
    inferred: float = 0.0
    past_steps: tuple[PastStep, ...] = ()
    violated: str = ""
    familiar_objects: tuple[int, ...] = ()
    forbidden: bool = False
    order_violation: OrderViolation | None = None
    resting: tuple[tuple[str, float], ...] = ()
