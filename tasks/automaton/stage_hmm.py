"""How a task goes and how it is seen, as probabilities: the model behind recognition.

Hidden is where the task is: the state of its course (which steps are under way, `derivatives.py`) and
the *phase* of each of these steps. A step waits to begin, is going on (in one phase, or in several
one after the other where its course says `for`), is failing, or is lost for good:

    waiting --begin--> going 1 --> ... --> going k --leave--> what comes next
                          ^   |                |
                       recover fail           fail
                          |   v                v
                          failing  --lose--> lost

All rates are per second, so that nothing hangs on the frame rate: in `dt` seconds a phase with
exits of rates r1, r2, ... is left with probability 1 - exp(-(r1 + r2 + ...) dt), by each exit in
proportion to its rate. In one step of time each step changes its phase at most once, and after
that the course goes on at most once. Ways on that leave the same steps share their rate equally;
a way that leaves several steps at once is as slow as the slowest of them.

Seen is, for each action of the task and its actors, whether it holds, whether its contrary does,
neither, or nothing at all, which says nothing. `missing` is the probability that neither is seen
of what is going on, `spurious` that the contrary is; the same with the two exchanged for what is
failing. Of what nobody asks for, or what still waits, either is seen with probability `spurious`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cached_property

from visup.tasks.automaton.states import TaskStep


class ActionStatus(IntEnum):
    """What is seen of an action between its actors."""

    HOLDS = 0
    NEITHER = 1
    CONTRARY = 2
    UNKNOWN = 3


class PhaseKind(Enum):
    """What the phase of a step is, whatever its number."""

    WAITING = "waiting"
    GOING = "going"
    FAILING = "failing"
    LOST = "lost"


WAITING = 0
"""The first phase of every step; then come those of going on, then failing, then lost."""


@dataclass(frozen=True)
class StageHmm:
    """The probabilities of the model; rates per second.

    Attributes:
        begin: Rate at which a step that waits begins.
        leave: Rate at which the course goes on from a step that has gone through all its phases.
        skip: Rate at which it goes on from one that has not.
        fail: Rate at which what is going on begins to fail.
        recover: Rate at which what is failing goes on again, from its first phase.
        lose: Rate at which what is failing is lost for good.
        missing: Probability that nothing is seen of what is going on, or failing.
        spurious: Probability that something is seen that is not so.
        phases: Number of phases in which a step goes on whose course says `for`; each takes an
            equal part of that time on average.
        unseen: Probability that the course goes on without the beginning of the next step being
            seen, although that is seen to come nearer.
        pass_over: Probability that a step is left that was not seen through; its square where the
            step was seen not to happen.
        look_s: What is seen of one thing in neighbouring frames is seen wrongly together: it counts
            as one look in so many seconds.
    """

    begin: float = 1.0
    leave: float = 0.15
    skip: float = 0.002
    fail: float = 0.01
    recover: float = 0.2
    lose: float = 0.02
    missing: float = 0.1
    spurious: float = 0.1
    phases: int = 3
    unseen: float = 0.15
    pass_over: float = 5e-4
    look_s: float = 0.4

    def count(self, step: TaskStep) -> int:
        """Number of phases in which a step goes on."""
        return 1 if step.hold_s is None else self.phases

    def kind(self, step: TaskStep, phase: int) -> PhaseKind:
        """What a phase of a step is."""
        if phase == WAITING:
            return PhaseKind.WAITING
        beyond = phase - self.count(step)
        return (
            PhaseKind.GOING if beyond <= 0 else PhaseKind.FAILING if beyond == 1 else PhaseKind.LOST
        )

    def exits(self, step: TaskStep, phase: int) -> tuple[tuple[int, float], ...]:
        """Phases that may come next while the step stays under way, each with its rate."""
        last = self.count(step)
        match self.kind(step, phase):
            case PhaseKind.WAITING:
                return ((1, self.begin),)
            case PhaseKind.GOING if phase < last:
                assert step.hold_s is not None  # only a `for` makes several phases
                return ((phase + 1, last / max(step.hold_s, 1e-9)), (last + 1, self.fail))
            case PhaseKind.GOING:
                return ((last + 1, self.fail),)
            case PhaseKind.FAILING:
                return ((1, self.recover), (last + 2, self.lose))
        return ()

    def changes(self, step: TaskStep, phase: int, dt: float) -> Iterator[tuple[int, float]]:
        """Phases after `dt` seconds, each with its probability; they sum to 1."""
        return within(dt, phase, self.exits(step, phase))

    def leaving(self, step: TaskStep, phase: int) -> float:
        """Rate at which the course goes on from a step in a phase."""
        if self.kind(step, phase) is PhaseKind.LOST:
            return 0.0
        return self.leave if phase == self.count(step) else self.skip

    @cached_property
    def chances(self) -> dict[PhaseKind, tuple[float, float, float]]:
        """For each kind of phase the probability to see HOLDS, NEITHER and CONTRARY."""
        noise, rest = self.spurious, 1.0 - self.missing - self.spurious
        idle = (noise, 1.0 - 2 * noise, noise)
        bad = (noise, self.missing, rest)
        return {
            PhaseKind.WAITING: idle,
            PhaseKind.GOING: bad[::-1],
            PhaseKind.FAILING: bad,
            PhaseKind.LOST: bad,
        }

    def likelihood(self, kind: PhaseKind, seen: ActionStatus, confidence: float = 1.0) -> float:
        """How much likelier something is seen of a step in such a phase than of an idle action.

        Args:
            kind: Of the phase.
            seen: What is seen.
            confidence: 0 to 1: with the rest of it, anything might have been seen alike.
        """
        if seen is ActionStatus.UNKNOWN:
            return 1.0
        blur = (1.0 - confidence) / 3
        of, idle = self.chances[kind][seen], self.chances[PhaseKind.WAITING][seen]
        return (confidence * of + blur) / (confidence * idle + blur)

    def fit(self, seen: ActionStatus, confidence: float, dt: float) -> float:
        """How well something seen for `dt` seconds fits a step that should go on; 1 at best.

        The likelihood of what is seen against that of seeing it hold, one look in `look_s`. Where
        nothing is seen it fits as well as looks at what is going on do on average, so that a course
        of which nothing can be seen is not held against one that is seen to go on.
        """
        blur, going = (1.0 - confidence) / 3, self.chances[PhaseKind.GOING]
        whole = confidence * going[ActionStatus.HOLDS] + blur
        if seen is ActionStatus.UNKNOWN:
            ratio = sum(p * p for p in going) / going[ActionStatus.HOLDS]
        else:
            ratio = (confidence * going[seen] + blur) / whole
        return float(ratio ** (dt / self.look_s))

    def false_alarm(self, confidence: float) -> float:
        """How much likelier it is that what held for a look was a false alarm than that it was so.

        A false alarm lasts as long as it lasts, so that it counts once and not at every look.
        """
        return 1.0 - confidence * (1.0 - self.spurious / (1.0 - self.spurious))

    def fate(self, step: TaskStep, phase: int) -> float:
        """Probability that a step in a phase is left at all, and not lost before."""
        return self._fates(step.hold_s)[phase]

    def _fates(self, hold_s: float | None) -> Sequence[float]:
        found = self._known_fates.get(hold_s)
        if found is None:
            found = self._known_fates[hold_s] = self._solved(TaskStep("", (), "", hold_s))
        return found

    @cached_property
    def _known_fates(self) -> dict[float | None, Sequence[float]]:
        return {}

    def _solved(self, step: TaskStep) -> Sequence[float]:
        """For each phase the probability to be left at last; a linear system, solved by sweeps."""
        last = self.count(step)
        fates = [0.0] * (last + 3)
        for _ in range(10_000):
            before = list(fates)
            for phase in range(last + 1, -1, -1):
                leaving, exits = self.leaving(step, phase), self.exits(step, phase)
                total = leaving + sum(rate for _, rate in exits)
                onward = sum(rate * fates[to] for to, rate in exits)
                fates[phase] = (leaving + onward) / total if total > 0 else 0.0
            if max(abs(a - b) for a, b in zip(fates, before, strict=True)) < 1e-15:
                break
        return fates


def within(
    dt: float, stays: int, exits: Sequence[tuple[int, float]]
) -> Iterator[tuple[int, float]]:
    """What exits of constant rates bring in `dt` seconds, each with its probability."""
    total = sum(rate for _, rate in exits)
    gone = -math.expm1(-total * dt)
    yield stays, 1.0 - gone
    if gone > 0.0:
        yield from ((to, gone * rate / total) for to, rate in exits)


DEFAULT_HMM = StageHmm()

SUPERVISION_HMM = StageHmm(
    begin=0.1, fail=0.02, recover=0.05, lose=0.125, missing=0.37, spurious=0.075
)
"""Of relations in the mind, which are true for a while, then neither for a while, and then again."""
