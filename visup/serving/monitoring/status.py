"""A site at one moment, as those see it who ask from outside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

READY_STATES = ("watching", "over")
STALE_S = 15.0
"""A supervisor that has not looked at its cameras for so long is not well, seconds."""


@dataclass(frozen=True, slots=True)
class CameraStatus:
    """One camera.

    Attributes:
        name: Its name.
        state: What is done with it now.
        restarts: How often its process was begun again.
        memory_mb: Memory that its process has in use, megabytes; None where nobody knows.
        step_age_s: How long ago its process told of a step, seconds; None before the first.
        totals: Sums over all its processes.
        latest: Figures that go up and down.
    """

    name: str
    state: str
    restarts: int = 0
    memory_mb: float | None = None
    step_age_s: float | None = None
    totals: Mapping[str, float] = field(default_factory=dict)
    latest: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SiteStatus:
    """All cameras of a site.

    Attributes:
        at: When that was, by the clock of whoever asks for its age.
        cameras: In the order of the file.
        room: Bytes by what they are, such as 'free' and 'evidence'.
        deleted: Files that were deleted to make room, by what they were.
    """

    at: float
    cameras: tuple[CameraStatus, ...] = ()
    room: Mapping[str, float] = field(default_factory=dict)
    deleted: Mapping[str, float] = field(default_factory=dict)

    def healthy(self, now: float) -> bool:
        """Whether the supervisor lives: it looked at its cameras a moment ago."""
        return now - self.at < STALE_S

    def ready(self, now: float) -> bool:
        """Whether every camera is watched, or was seen to its end."""
        return self.healthy(now) and all(c.state in READY_STATES for c in self.cameras)
