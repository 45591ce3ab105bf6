"""The record of one step of the cycle, and what is called with each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from visup.agent.model.mind import Mind
from visup.agent.model.records import (
    Alert,
    Directive,
    Event,
    Frame,
    Observation,
    Report,
)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """The whole record of one step.

    Attributes:
        frame_index: Number of the frame.
        time: Seconds.
        observation: What was perceived.
        mind: The mind after the step.
        events: What happened, in order.
        alerts: Alerts that were opened or closed in this step.
        directives: What is asked of behaviours in the next step.
    """

    frame_index: int
    time: float
    observation: Observation
    mind: Mind
    events: tuple[Event, ...] = ()
    alerts: tuple[Alert, ...] = ()
    directives: tuple[Directive, ...] = ()

    @property
    def reports(self) -> tuple[Report, ...]:
        """What each behaviour did."""
        return self.observation.reports


Observer = Callable[[Step, Frame], None]
"""Told of each step after it is over: journal, console, report. It cannot change the agent."""
