"""Where a stepper is: after a step, inside one, or at a place to come back to."""

from __future__ import annotations

from dataclasses import dataclass, field

from visup.agent import Observation, Outcome
from visup.agent.contract.phases import AgentSnapshot, Phase
from visup.agent.model.display import enable_display
from visup.agent.model.step import Step
from visup.stepping.history import StepHistory


@dataclass(frozen=True, slots=True, eq=False)
class PausedStep:
    """A step that is stopped inside its cycle.

    Attributes:
        phase: The phase that is over.
        seen: What was perceived.
        thought: What was concluded so far; its mind is half-made. None after `perceive`.
    """

    phase: Phase
    seen: Observation
    thought: Outcome | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StepResult:
    """Where and why a run of steps ended.

    Attributes:
        taken: How many steps were completed.
        steps: The latest of them: as many as the history keeps whole.
        reasons: Which conditions were met; empty when the number of steps was made.
        paused: The step inside which it stopped, or None.
        ended: Whether there is nothing more to perceive.
    """

    taken: int
    steps: tuple[Step, ...] = ()
    reasons: tuple[str, ...] = ()
    paused: PausedStep | None = None
    ended: bool = False

    @property
    def step(self) -> Step | None:
        """The last step that was completed."""
        return self.steps[-1] if self.steps else None


@dataclass(frozen=True, slots=True, eq=False)
class Bookmark:
    """A place to go back to, from `Stepper.snapshot`.

    Attributes:
        number: How many steps led there.
        snapshot: What the agent was.
        history: The history that it belongs to.
    """

    number: int
    snapshot: AgentSnapshot
    history: StepHistory = field(repr=False)


enable_display(PausedStep, StepResult)
