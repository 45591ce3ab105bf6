"""The record of one step of the cycle, and the observers that receive it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from visup.agent.model.display import drawn, enable_display
from visup.agent.model.errors import SettingsError
from visup.agent.model.events import Alert, Directive, Event
from visup.agent.model.mind import Mind
from visup.agent.model.records import Frame, Observation, Report

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """The complete record of one step.

    Attributes:
        frame_index: Number of the frame.
        time: Seconds.
        observation: The percepts.
        mind: The mind after the step.
        events: What happened, in order.
        alerts: Alerts that were opened or closed in this step.
        directives: Requests to behaviours for the next step.
        frame: The frame itself, in steps from `visup.watch`; else None.
    """

    frame_index: int
    time: float
    observation: Observation
    mind: Mind
    events: tuple[Event, ...] = ()
    alerts: tuple[Alert, ...] = ()
    directives: tuple[Directive, ...] = ()
    frame: Frame | None = field(default=None, repr=False)

    @property
    def reports(self) -> tuple[Report, ...]:
        """What each behaviour did."""
        return self.observation.reports

    def draw(self, frame: Frame | None = None) -> NDArray[np.uint8]:
        """The frame with the beliefs drawn over it: contours, names, alerts, stages.

        Args:
            frame: The frame of this step; by default the one that the step carries.

        Returns:
            (H, W, 3) uint8 BGR, a new image.

        Raises:
            SettingsError: The step carries no frame, or the frame is another one.
        """
        frame = frame or self.frame
        if frame is None:
            raise SettingsError(
                f"the step of frame {self.frame_index} does not carry its image",
                hint="draw steps while `visup.watch` yields them, or give the frame: step.draw(frame)",
            )
        if frame.index != self.frame_index:
            raise SettingsError(
                f"frame {frame.index} was given to draw the step of frame {self.frame_index}",
                expected=f"frame {self.frame_index}",
            )
        return drawn(frame.image, self.mind)


Observer = Callable[[Step, Frame], None]
"""Called after each step: journal, console, report. It cannot change the agent."""


enable_display(Step)
