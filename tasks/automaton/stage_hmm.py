"""The hidden Markov model of a task: transition rates and observation probabilities.

The hidden state is the state of the course (its active steps, `derivatives.py`) and the *phase* of each of
these steps. A step is waiting to begin, going on (in one phase, or several successive ones if its course says
`for`), failing, or lost for good:

    waiting --begin--> going 1 --> ... --> going k --leave--> what comes next
                          ^   |                |
                       recover fail           fail
                          |   v                v
                          failing  --lose--> lost

All rates are per second, so that results do not depend on the frame rate: in `dt` seconds a phase with exit
rates r1, r2, ... is left with probability 1 - exp(-(r1 + r2 + ...) dt), by each exit in proportion to its
rate. In one time step each step changes its phase at most once, and then the course moves on at most once.
Transitions that complete the same steps share their rate equally; one that completes several steps is as slow
as the slowest.

The observation of each action of the task and its actors is that it holds, that its contrary does, that
neither does, or none at all, which carries no information. `missing` is the probability that neither is
observed of an ongoing action, `spurious` that the contrary is; for a failing action the two are exchanged. Of
actions that are waiting or not required, each is observed with probability `spurious`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from functools import cached_property

from visup.tasks.automaton.states import TaskStep


class ActionStatus(IntEnum):
    """The observed status of an action between its actors."""

    HOLDS = 0
    NEITHER = 1
    CONTRARY = 2
    UNKNOWN = 3


class PhaseKind(Enum):
    """The kind of a phase, regardless of its number."""

    WAITING = "waiting"
    GOING = "going"
    FAILING = "failing"
    LOST = "lost"


WAITING = 0
"""The first phase of every step; the phases of going on, failing and lost follow."""


@dataclass(frozen=True)
class StageHmm:
    """The probabilities of the model; rates per second.

    Attributes:
        begin: Rate at which a waiting step begins.
        leave: Rate at which the course moves on from a step that has passed all its phases.
        skip: Rate at which it moves on from one that has not.
        fail: Rate at which an ongoing step begins to fail.
        recover: Rate at which a failing step recovers, to its first phase.
        lose: Rate at which a failing step is lost for good.
        missing: Probability that an ongoing or failing action is not observed.
        spurious: Probability of a false observation.
        phases: Number of phases of a step with `for`; each takes an equal part of that time on average.
        unseen: Probability that the course moves on without the beginning of the next step being observed,
            although its approach is.
        pass_over: Probability that the course passes a step whose completion was not observed; squared if the
            action was observed not to hold.
        look_s: Correlation time of observations, seconds: errors in neighbouring frames are dependent, so
            that this time counts as one observation.
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
        """Number of ongoing phases of a step."""
        return 1 if step.hold_s is None else self.phases

    def kind(self, step: TaskStep, phase: int) -> PhaseKind:
        """The kind of a phase of a step."""
        if phase == WAITING:
            return PhaseKind.WAITING
        beyond = phase - self.count(step)
        return (
            PhaseKind.GOING if beyond <= 0 else PhaseKind.FAILING if beyond == 1 else PhaseKind.LOST
        )

    def exits(self, step: TaskStep, phase: int) -> tuple[tuple[int, float], ...]:
        """Phases that may come next while the step stays active, each with its rate."""
        last = self.count(step)
        match self.kind(step, phase):
            case PhaseKind.WAITING:
                return ((1, self.begin),)
            case PhaseKind.GOING if phase < last:
                assert step.hold_s is not None  # only steps with `for` have several phases
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
        """Rate at which the course moves on from a step in a phase."""
        if self.kind(step, phase) is PhaseKind.LOST:
            return 0.0
        return self.leave if phase == self.count(step) else self.skip

    @cached_property
    def chances(self) -> dict[PhaseKind, tuple[float, float, float]]:
        """Kind of phase -> probabilities of observing HOLDS, NEITHER and CONTRARY."""
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
        """Likelihood ratio of an observation for a step in a phase to that for an idle action.

        Args:
            kind: Kind of the phase.
            seen: The observation.
            confidence: 0 to 1; with the remaining probability the observation is uninformative.
        """
        if seen is ActionStatus.UNKNOWN:
            return 1.0
        blur = (1.0 - confidence) / 3
        of, idle = self.chances[kind][seen], self.chances[PhaseKind.WAITING][seen]
        return (confidence * of + blur) / (confidence * idle + blur)

    def fit(self, seen: ActionStatus, confidence: float, dt: float) -> float:
        """How well an observation during `dt` seconds fits an ongoing step; 1 at best.

        The ratio of its likelihood to that of HOLDS, with one observation per `look_s`. A missing observation
        fits as well as those of an ongoing step on average, so that an unobservable course is not at a
        disadvantage against one that is seen to go on.
        """
        blur, going = (1.0 - confidence) / 3, self.chances[PhaseKind.GOING]
        whole = confidence * going[ActionStatus.HOLDS] + blur
        if seen is ActionStatus.UNKNOWN:
            ratio = sum(p * p for p in going) / going[ActionStatus.HOLDS]
        else:
            ratio = (confidence * going[seen] + blur) / whole
        return float(ratio ** (dt / self.look_s))

    def false_alarm(self, confidence: float) -> float:
        """Likelihood ratio of a false alarm to a true observation, for one that has held for `look_s`.

        It counts once, not every `look_s`, because the errors of a lasting false alarm are dependent.
        """
        return 1.0 - confidence * (1.0 - self.spurious / (1.0 - self.spurious))

    def fate(self, step: TaskStep, phase: int) -> float:
        """Probability that a step in a phase is eventually completed and not lost."""
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
        """Probability of eventual completion for each phase: a linear system, solved iteratively."""
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
    """Outcomes of exits with constant rates after `dt` seconds, each with its probability."""
    total = sum(rate for _, rate in exits)
    gone = -math.expm1(-total * dt)
    yield stays, 1.0 - gone
    if gone > 0.0:
        yield from ((to, gone * rate / total) for to, rate in exits)


DEFAULT_HMM = StageHmm()

SUPERVISION_HMM = StageHmm(
    begin=0.1, fail=0.02, recover=0.05, lose=0.125, missing=0.37, spurious=0.075
)
"""For relations in the mind, which alternate between true and neither (`ActionStatus.NEITHER`)."""
