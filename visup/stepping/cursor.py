"""Positions of a stepper: after a step, inside one, or a bookmark."""

from __future__ import annotations

from dataclasses import dataclass, field

from visup.agent import Observation, Outcome
from visup.agent.contract.phases import AgentSnapshot, Phase
from visup.agent.model.display import enable_display
from visup.agent.model.step import Step
from visup.stepping.history import StepHistory


@dataclass(frozen=True, slots=True, eq=False)
class PausedStep:
    """A step stopped inside its cycle.

    Attributes:
        phase: The last completed phase.
        observation: The observation.
        outcome: Conclusions so far, with an unfinished mind; None after `perceive`.
    """

    phase: Phase
    observation: Observation
    outcome: Outcome | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StepResult:
    """Where and why stepping ended.

    Attributes:
        taken: Number of completed steps.
        steps: The latest of them, as many as the history caches.
        reasons: The conditions met; empty if the requested number of steps was made.
        paused: The step inside which it stopped, or None.
        ended: Whether the source has ended.
    """

    taken: int
    steps: tuple[Step, ...] = ()
    reasons: tuple[str, ...] = ()
    paused: PausedStep | None = None
    ended: bool = False

    @property
    def step(self) -> Step | None:
        """The last completed step."""
        return self.steps[-1] if self.steps else None


@dataclass(frozen=True, slots=True, eq=False)
class Bookmark:
    """A position to return to, from `Stepper.snapshot`.

    Attributes:
        number: Number of steps before it.
        snapshot: State of the agent.
        history: Its history.
    """

    number: int
    snapshot: AgentSnapshot
    history: StepHistory = field(repr=False)


enable_display(PausedStep, StepResult)
