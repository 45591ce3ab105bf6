"""The transitions open to a hypothesis, with its monitors.

They are those of the automaton. In a task with `within`, each entry to a stage has its own deadline, so that
the target state is computed anew each time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from visup.agent import Status
from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.automaton import END, NEW, Automaton, Transition, with_payloads
from visup.tasks.automaton.derivatives import begin, derivatives, enter
from visup.tasks.automaton.states import Leaf, State, TaskStep, leaves
from visup.tasks.grammar.nodes import Actors, Deadline, Task, Timed, walk
from visup.tasks.supervision.hypotheses import ContactEntry, TaskHypothesis
from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.step_model import Observe
from visup.tasks.verification.step_monitor import BAD, StepMonitor, entered

FIRST_LOOK_S = 0.5
"""Time after the first frame within which relations that hold from the start are recognised, seconds."""

MEETINGS = frozenset({"touching", "in_contact", "on", "coupled"})
"""Relations of which the first means that two bodies which were apart have met."""

Target = tuple[Transition, tuple[TaskStep, ...], State[int] | None]
"""A transition, the steps that it begins, and its target state; None at the end."""


@dataclass(frozen=True, slots=True)
class OpenTransition:
    """A transition that a hypothesis may take.

    Attributes:
        transition: The transition of the automaton.
        left: The steps that it completes.
        entered: The steps that it begins.
        state: The target state, or None at the end of the course.
    """

    transition: Transition
    left: tuple[Leaf[StepMonitor], ...]
    entered: tuple[TaskStep, ...]
    state: State[int] | None

    @property
    def ends(self) -> bool:
        """Whether it leads to the end of the course."""
        return self.state is None

    @property
    def may_end(self) -> bool:
        """Whether all steps that it completes have been fulfilled, and none fails."""
        return all(x.payload.fulfilled and x.payload.status not in BAD for x in self.left)

    @property
    def again(self) -> bool:
        """Whether it begins another round of the steps that it completes."""
        return bool(self.entered) and {x.step for x in self.left} == set(self.entered)

    @property
    def waits(self) -> bool:
        """Whether it begins another round while the actions of the last one may still hold."""
        return self.again and all(goes_on(s, self.left) for s in self.entered)

    @property
    def turn(self) -> float | None:
        """When the last of the stages that it completes began, seconds; None if that was not observed."""
        begun: dict[str, float] = {}
        for leaf in self.left:
            stage, since = leaf.step.stage, leaf.payload.begun
            if since is None:
                return None
            begun[stage] = min(since, begun.get(stage, since))
        return max(begun.values(), default=None)

    def completed_by_meeting(self, observe: Observe) -> frozenset[TaskStep]:
        """The approaches that are completed because the two have met since they began, if nothing fails.

        However little was seen of them: what is carried along an arc hardly comes nearer before it is put
        down.
        """
        if any(x.payload.status in BAD for x in self.left):
            return frozenset()
        return frozenset(x.step for x in self.left if _met_since(x, self.entered, observe))

    @property
    def completed(self) -> tuple[tuple[TaskStep, float | None], ...]:
        """The steps that it completes, each with the time when it was first observed in seconds, or None."""
        return tuple((x.step, x.payload.begun) for x in self.left)

    def contact_entry(
        self, hypothesis: TaskHypothesis, observe: Observe, now: float
    ) -> ContactEntry | None:
        """The contact by which a hypothesis takes it now; the last one if it takes it by something else.

        A carried body counts as in contact only when it has slowed down: that is not taken back.
        """
        seen = ((s, observe(s)) for s in self.entered)
        held = ((s, x.held_by) for s, x in seen if not x.carried)
        met = next((s for s, h in held if h is not None and h.name in MEETINGS), None)
        return ContactEntry.of(met, now, hypothesis) if met else hypothesis.contact_entry

    @property
    def share(self) -> float:
        """Its share among the transitions that complete the same steps."""
        return self.transition.share

    def taken(self, here: tuple[Leaf[StepMonitor], ...], fresh: StepMonitor) -> State[StepMonitor]:
        """The target state, which must exist; carried steps keep their monitors.

        Args:
            here: The active steps before.
            fresh: The monitor of each beginning step.
        """
        assert self.state is not None
        pairs = zip(leaves(self.state), self.transition.carried, strict=True)
        new = [Leaf(x.step, fresh) if c == NEW else here[c] for x, c in pairs]
        return with_payloads(self.state, new)


def _met_since(left: Leaf[StepMonitor], entered: tuple[TaskStep, ...], observe: Observe) -> bool:
    """Whether the actors of an approach have met since it began, so that a step that it leads to holds."""
    begun, mine = left.payload.begun, set(left.step.actors)
    if begun is None or left.step.action != "converging":
        return False
    held = (observe(s).held_by for s in entered if set(s.actors) == mine)
    return any(h is not None and h.name in MEETINGS and h.since > begun for h in held)


def goes_on(step: TaskStep, left: tuple[Leaf[StepMonitor], ...]) -> bool:
    """Whether a step repeats a completed one whose action has not ceased: it must cease first."""
    return any(step.same_as(x.step) and not x.payload.ceased for x in left)


def earliest_end(left: Leaf[StepMonitor]) -> float:
    """The earliest time at which a completed step can have ended, seconds."""
    monitor = left.payload
    if left.step.hold_s is not None and monitor.fulfilled_at is not None:
        return monitor.fulfilled_at
    return monitor.entered if monitor.begun is None else monitor.begun


def missed(monitor: StepMonitor, seen: ActionObservation, since: float, now: float) -> StepMonitor:
    """The monitor of a step that should have begun when its approach ended, but did not.

    It fails at once if its contrary is observed.

    Args:
        monitor: The monitor of a step whose turn comes now.
        seen: Its observation.
        since: Time when the approach (or carrying) ended without reaching its goal, seconds.
        now: Current time, seconds.
    """
    monitor = replace(monitor, entered=since, begun=now)
    if seen.contrary is None:
        return monitor
    fault = seen.contrary.name
    return replace(monitor, status=Status.FAILING, since=since, fault=fault, fault_since=since)


class OpenTransitions:
    """The initial states of one task, and the transitions open to its hypotheses.

    Args:
        task: The task.
        automaton: Its states.
    """

    def __init__(self, task: Task, automaton: Automaton) -> None:
        self._task = task
        self._automaton = automaton
        self._timed = any(_deadlines(task))
        self._targets: dict[int, list[Target]] = {}
        self._starts: list[tuple[State[int], int]] = []

    def begin(self, now: float) -> list[tuple[State[StepMonitor], int]]:
        """The states in which the task may begin now, each with its number.

        An action that has held since the first frame does not begin a stage that requires more.
        """
        fresh = replace(entered(now), turn=now + FIRST_LOOK_S)
        return [
            (with_payloads(state, [Leaf(x.step, fresh) for x in leaves(state)]), node)
            for state, node in self._beginnings(now)
        ]

    def first_steps(self) -> Iterator[TaskStep]:
        """The steps with which the task may begin."""
        return (x.step for state, _ in self._beginnings(0.0) for x in leaves(state))

    def _beginnings(self, now: float) -> list[tuple[State[int], int]]:
        if self._starts and not self._timed:
            return self._starts
        states = enter(self._task, begin(self._task), NEW, now)
        self._starts = [(s, self._automaton.node(s)) for s in states if s is not None]
        return self._starts

    def of(self, state: State[StepMonitor], node: int, now: float) -> list[OpenTransition]:
        """All transitions open in a state.

        Args:
            state: The state.
            node: Its number.
            now: Time from which each `within` counts, seconds.
        """
        here = leaves(state)
        return [
            OpenTransition(transition, tuple(here[i] for i in transition.left), begun, target)
            for transition, begun, target in self._targets_of(state, node, now)
        ]

    def _targets_of(self, state: State[StepMonitor], node: int, now: float) -> list[Target]:
        transitions = self._automaton.transitions(node)
        if self._timed:
            numbered = with_payloads(state, [Leaf(x.step, i) for i, x in enumerate(leaves(state))])
            found = derivatives(self._task, numbered, NEW, now)
            return [_target(t, d.state) for t, d in zip(transitions, found, strict=True)]
        if node not in self._targets:
            states = (
                None if t.target == END else self._automaton.state(t.target) for t in transitions
            )
            self._targets[node] = [_target(t, s) for t, s in zip(transitions, states, strict=True)]
        return self._targets[node]


def _target(transition: Transition, state: State[int] | None) -> Target:
    steps = () if state is None else leaves(state)
    return transition, tuple(steps[i].step for i in transition.begun), state


def _deadlines(task: Task) -> Iterator[Deadline]:
    bodies = [s.body for s in task.stages if not isinstance(s.body, Actors)]
    timed = (c for body in bodies for c in walk(body) if isinstance(c, Timed))
    return (c for t in timed for c in t.clauses if isinstance(c, Deadline))
