"""What supervision remembers of a task from step to step."""

from __future__ import annotations

from dataclasses import dataclass

from visup.agent import TaskBelief
from visup.tasks.supervision.hypotheses import TaskHypotheses
from visup.tasks.supervision.replay import PastLook
from visup.tasks.supervision.task_inference import ALONE, TaskActivity
from visup.tasks.verification.kept import NOTHING_KEPT, Kept


@dataclass(frozen=True)
class TaskMemory:
    """What is remembered of one task from step to step.

    Attributes:
        time: Seconds of the step in which it was last followed.
        posterior: The hypotheses about it; None until its first actors are found.
        belief: What was last believed.
        interrupted: Why the task was interrupted, or empty; once set it stays, but for one reason: an
            unexpected object that turns out to be one of the actors.
        strangers: The objects that interrupted the task by being unexpected.
        strange_since: Since when objects have been unexplained, by id.
        broken_since: Since when each invariant has been broken, or None.
        rival: A matching that would change who plays whom, by actor; empty when there is none.
        rival_since: Since when it has been the better one.
        kept: What is kept of its facts: how long they have been so, and when they paused work.
        activity: Whether it is going on, where several tasks are given.
        gain: The evidence that it is, of each second, as it was seen last.
        inferred: Seconds of the step in which it was last inferred whether it is.
        looks: What was seen while an actor is looked for, to be gone through again once it is found.
        akin: Objects that nobody knows and that were there from the start: the rest of a machine of which
            a part alone is known is not unexpected.
        violated: What must never be of one body and was, by which the task has failed; or empty.
    """

    time: float
    posterior: TaskHypotheses | None
    belief: TaskBelief
    interrupted: str = ""
    strangers: tuple[int, ...] = ()
    strange_since: tuple[tuple[int, float], ...] = ()
    broken_since: tuple[float | None, ...] = ()
    rival: tuple[int | None, ...] = ()
    rival_since: float = 0.0
    kept: Kept = NOTHING_KEPT
    activity: TaskActivity = ALONE
    gain: float = 0.0
    inferred: float = 0.0
    looks: tuple[PastLook, ...] = ()
    violated: str = ""
    akin: tuple[int, ...] = ()
