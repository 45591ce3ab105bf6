"""Hypotheses: alternative explanations of the observations as courses through a task.

A hypothesis is one state of the course with the monitors of its active steps and the beliefs about completed
stages. Its probability is kept by the task filter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

from visup.agent import StageBelief, Status
from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.backpointers import Backpointer
from visup.tasks.automaton.entries import Meetings, StepEntries
from visup.tasks.automaton.states import Leaf, State, TaskStep, leaves
from visup.tasks.automaton.task_filter import TaskPosterior
from visup.tasks.grammar.conditions import actors_of, facts_of
from visup.tasks.verification.step_monitor import BAD, StepMonitor

# The status of a stage is the first of these among its steps.
WORST_FIRST = (
    Status.FAILED,
    Status.FAILING,
    Status.UNKNOWN,
    Status.STALLED,
    Status.ACTIVE,
    Status.PROGRESSING,
)


class Support(IntEnum):
    """Strength of support for a transition; each time it rises, the transition is taken or not."""

    NONE = 0
    NEARER = 1  # the steps that it enters are approaching
    OVER = 2  # the steps that it completes are over by themselves
    EARLY = 3  # the steps that it enters begin, but those that it completes were not seen completed
    BEGUN = 4  # the steps that it enters begin, and those that it completes were seen completed


class Progress(IntEnum):
    """Where a stage is in the course."""

    PENDING = 0
    UNDER_WAY = 1
    BEHIND = 2


HOLD = "coupled"
"""The action by which one object grasps another."""

Standing = tuple[Progress, Status]
"""Position of a stage in the course, and its status."""

NOT_BEGUN: Standing = (Progress.PENDING, Status.PENDING)


@dataclass(frozen=True)
class ContactEntry:
    """A contact by which a hypothesis went on; the two may turn out to have passed each other.

    Attributes:
        step: The step that began by it.
        at: When the hypothesis went on, seconds.
        before: What the hypothesis was before.
    """

    step: TaskStep
    at: float
    before: TaskHypothesis

    @classmethod
    def of(cls, step: TaskStep, now: float, before: TaskHypothesis) -> ContactEntry:
        """A contact by which a hypothesis goes on now; if it is taken back, entries are observed anew."""
        return cls(step, now, replace(before, entries=(), met=(), contact_entry=None))


@dataclass(frozen=True)
class TaskHypothesis:
    """One possible course of the task.

    Attributes:
        state: Its state.
        node: Number of the state (see `Automaton`).
        past: Completed stages with their latest beliefs.
        finished: Time when the task was completed, seconds, or None.
        entries: Observed entries of possible next steps.
        met: Steps that begin together whose entries were observed at the same time, with the last such time.
        considered: (entered steps, support) of transitions that were considered and not taken.
        backpointer: Completed steps and their times.
        gone_on: Whether it has completed a step.
        lasting: The stage completed last, if it lasts until the next one begins and that beginning was not
            observed; otherwise empty.
        contact_entry: The last contact of two actors by which it went on; None if there was none.
    """

    state: State[StepMonitor]
    node: int
    past: tuple[StageBelief, ...] = ()
    finished: float | None = None
    entries: StepEntries = ()
    met: Meetings = ()
    considered: tuple[tuple[tuple[TaskStep, ...], Support], ...] = ()
    backpointer: Backpointer | None = None
    gone_on: bool = False
    lasting: str = ""
    contact_entry: ContactEntry | None = None

    @property
    def begun(self) -> bool:
        """Whether anything of the task was observed under it."""
        return self.gone_on or any(x.payload.begun is not None for x in leaves(self.state))

    @cached_property
    def under_way(self) -> Mapping[str, Leaf[StepMonitor]]:
        """Active stage -> its step with the worst status, in the order of the text.

        A failure before a stage has begun is attributed to the previous stage, if that lasts until then. So
        is the end of a grasp before the next stage has begun: a grasp that takes nothing along was not a
        grasp.
        """
        return _under_way(self)

    @property
    def failed(self) -> bool:
        """Whether a completed stage has failed."""
        return any(p.status is Status.FAILED for p in self.past)


Successor = tuple[int, Callable[[], TaskHypothesis], float]
"""The node of a successor, what makes it, and its probability: of several to one node, one is made."""

NEAR = 0.01
"""Hypotheses at least this likely, relative to the best, contribute to what is expected."""

TaskHypotheses = TaskPosterior[int, TaskHypothesis]
"""The hypotheses about a task by the number of their state, with their probabilities."""


def _under_way(hypothesis: TaskHypothesis) -> dict[str, Leaf[StepMonitor]]:
    found: dict[str, Leaf[StepMonitor]] = {}
    for leaf in leaves(hypothesis.state):
        other = found.get(leaf.step.stage)
        if other is None or _worse(leaf, other):
            found[leaf.step.stage] = leaf
    if hypothesis.lasting:
        return {hypothesis.lasting if _fails_unbegun(x) else s: x for s, x in found.items()}
    last = hypothesis.backpointer
    if last is None or last.step.action != HOLD:
        return found
    since = _taken_along(hypothesis, last.step)
    return {last.step.stage if _undoes(x, last.step, since) else s: x for s, x in found.items()}


def _taken_along(hypothesis: TaskHypothesis, hold: TaskStep) -> float:
    """Time from which the stage after a hold has been observed, seconds; infinite if it has not.

    If it has an action of both coupled actors, as `moving_together`, that action must have begun: a part that
    moves alone has not been taken along.
    """
    steps = list(leaves(hypothesis.state))
    joint = [x for x in steps if set(hold.actors) <= set(x.step.actors)]
    begun = (x.payload.begun for x in joint or steps)
    return min((b for b in begun if b is not None), default=math.inf)


def _undoes(leaf: Leaf[StepMonitor], hold: TaskStep, begun: float) -> bool:
    """Whether a step fails because the pair coupled by the previous step came apart before it had begun.

    Later events between the two, such as a second attempt, do not change this.

    Args:
        leaf: An active step.
        hold: The previous step, by which the pair was coupled.
        begun: Time from `_taken_along`.
    """
    monitor = leaf.payload
    same = monitor.fault is not None and _concerned(leaf) <= set(hold.actors)
    return same and monitor.status in BAD and not monitor.late and monitor.fault_since < begun


def _concerned(leaf: Leaf[StepMonitor]) -> set[str]:
    """The actors of the fault of a step: those of the `fails when` of its stage, or its own."""
    fails = leaf.step.condition("fails")
    if fails is None or leaf.payload.fault != str(fails.condition):
        return set(leaf.step.actors)
    return {str(name) for fact in facts_of(fails.condition) for name in actors_of(fact)}


def _fails_unbegun(leaf: Leaf[StepMonitor]) -> bool:
    """Whether a step is contradicted before it ever held."""
    monitor = leaf.payload
    failing = monitor.status in BAD and monitor.fault is not None
    return failing and not (monitor.held or monitor.late or monitor.early)


def _worse(leaf: Leaf[StepMonitor], other: Leaf[StepMonitor]) -> bool:
    """Whether the first of two steps determines the status of their stage.

    A step that progresses within the stage makes the stage active, though another one is still waiting. It
    does not if it held before, or if the other one is about its actors together with further ones: a part
    that moves has not been lifted until it moves together with the gripper.
    """
    pair = leaf, other
    if {x.payload.status for x in pair} == {Status.ACTIVE, Status.PROGRESSING}:
        going, waiting = sorted(pair, key=lambda x: x.payload.status is Status.ACTIVE)
        alone = set(going.step.actors) < set(waiting.step.actors)
        return (leaf is going) is (going.payload.begun_anew and not alone)
    return WORST_FIRST.index(leaf.payload.status) < WORST_FIRST.index(other.payload.status)


def standings(hypothesis: TaskHypothesis) -> Mapping[str, Standing]:
    """The status of each stage in a hypothesis, without those that are pending."""
    found: dict[str, Standing] = {p.stage: (Progress.BEHIND, p.status) for p in hypothesis.past}
    for stage, leaf in hypothesis.under_way.items():
        if found.get(stage) == (Progress.BEHIND, Status.FAILED):
            continue  # one of its steps has failed for good
        done = hypothesis.finished is not None
        status = leaf.payload.status
        found[stage] = (Progress.BEHIND, Status.DONE) if done else (Progress.UNDER_WAY, status)
    return found


def likely(posterior: TaskHypotheses) -> TaskHypotheses:
    """The hypotheses that are not much less likely than the best, renormalised."""
    least = NEAR * posterior.hypotheses[posterior.best].mass
    near = {k: w for k, w in posterior.hypotheses.items() if w.mass >= least}
    whole = sum(w.mass for w in near.values())
    shares = {k: replace(w, mass=w.mass / whole) for k, w in near.items()}
    return replace(posterior, hypotheses=shares)
