"""Hypotheses: the courses that what was seen may have taken through a task, side by side.

A hypothesis is one state of the course with the monitors of the steps under way and the stages that
lie behind it. How likely each is, the task filter keeps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from visup.agent import StageBelief, Status
from visup.tasks.automaton.backpointers import Backpointer
from visup.tasks.automaton.states import Leaf, State, TaskStep, leaves
from visup.tasks.automaton.task_filter import TaskPosterior
from visup.tasks.verification.step_monitor import StepMonitor

# Of several steps of one stage the first of these speaks for the stage.
WORST_FIRST = (
    Status.FAILED,
    Status.FAILING,
    Status.UNKNOWN,
    Status.STALLED,
    Status.ACTIVE,
    Status.PROGRESSING,
)


class Support(IntEnum):
    """How strongly something speaks for a transition; each time it rises, it is taken or not."""

    NONE = 0
    NEARER = 1
    OVER = 2
    EARLY = 3  # it begins, but what it leaves has not been seen through
    BEGUN = 4


class Progress(IntEnum):
    """Where a stage is in the course."""

    PENDING = 0
    UNDER_WAY = 1
    BEHIND = 2


Standing = tuple[Progress, Status]
"""Where a stage is in the course, and how it stands there."""

NOT_BEGUN: Standing = (Progress.PENDING, Status.PENDING)


@dataclass(frozen=True)
class TaskHypothesis:
    """One course that what was seen may have taken.

    Attributes:
        state: Where it is.
        node: The number of that state (see `Automaton`).
        past: Stages that lie behind it, the latest word on each.
        finished: When the task was done by it, or None.
        met: Steps that may come next and whose entry was seen, with the time when it last was.
        considered: Transitions not taken, by the steps they enter, and how strong their support was.
        backpointer: The steps that lie behind it, and when each was left.
        gone_on: Whether it has left a step.
    """

    state: State[StepMonitor]
    node: int
    past: tuple[StageBelief, ...] = ()
    finished: float | None = None
    met: tuple[tuple[tuple[TaskStep, ...], float], ...] = ()
    considered: tuple[tuple[tuple[TaskStep, ...], Support], ...] = ()
    backpointer: Backpointer | None = None
    gone_on: bool = False

    @property
    def begun(self) -> bool:
        """Whether anything of the task was seen by it."""
        return self.gone_on or any(x.payload.begun is not None for x in leaves(self.state))

    @property
    def failed(self) -> bool:
        """Whether a stage that lies behind it has failed."""
        return any(p.status is Status.FAILED for p in self.past)


TaskHypotheses = TaskPosterior[int, TaskHypothesis]
"""The hypotheses about a task by the number of their state, with their probabilities."""


def under_way(hypothesis: TaskHypothesis) -> dict[str, Leaf[StepMonitor]]:
    """For each active stage the step with the worst status, in the order of the text."""
    found: dict[str, Leaf[StepMonitor]] = {}
    for leaf in leaves(hypothesis.state):
        other = found.get(leaf.step.stage)
        if other is None or _worse(leaf, other):
            found[leaf.step.stage] = leaf
    return found


def _worse(leaf: Leaf[StepMonitor], other: Leaf[StepMonitor]) -> bool:
    """Whether of two steps of a stage the first speaks for it.

    One that comes nearer within the stage shows that it is under way, though another is still waited
    for; one that was so before shows nothing.
    """
    pair = leaf.payload, other.payload
    if {p.status for p in pair} == {Status.ACTIVE, Status.PROGRESSING}:
        going = next(p for p in pair if p.status is Status.PROGRESSING)
        return (leaf.payload is going) is going.begun_anew
    return WORST_FIRST.index(leaf.payload.status) < WORST_FIRST.index(other.payload.status)


def standings(hypothesis: TaskHypothesis) -> Mapping[str, Standing]:
    """The status of each stage in a hypothesis, without those that are pending."""
    found: dict[str, Standing] = {p.stage: (Progress.BEHIND, p.status) for p in hypothesis.past}
    for stage, leaf in under_way(hypothesis).items():
        if found.get(stage) == (Progress.BEHIND, Status.FAILED):
            continue  # one of its steps has failed for good
        done = hypothesis.finished is not None
        status = leaf.payload.status
        found[stage] = (Progress.BEHIND, Status.DONE) if done else (Progress.UNDER_WAY, status)
    return found
