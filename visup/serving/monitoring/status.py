"""The state of a site at one moment, for monitoring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

READY_STATES = ("watching", "over")
STALE_S = 15.0
"""A supervisor that has not updated its status for this long is unhealthy, seconds."""


@dataclass(frozen=True, slots=True)
class CameraStatus:
    """One camera.

    Attributes:
        name: Its name.
        state: The state of its supervision.
        restarts: How often its process was restarted.
        memory_mb: Resident memory of its process, megabytes; None where not known.
        step_age_s: Seconds since its process last reported a step; None before the first.
        totals: Counters over all its processes.
        latest: Gauges.
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
        at: Time of the status, seconds of the monitoring server's clock.
        cameras: In the order of the file.
        disk_usage: Bytes by kind, such as 'free' and 'evidence'.
        deleted: Counts of what was deleted to free space, by kind.
    """

    at: float
    cameras: tuple[CameraStatus, ...] = ()
    disk_usage: Mapping[str, float] = field(default_factory=dict)
    deleted: Mapping[str, float] = field(default_factory=dict)

    def healthy(self, now: float) -> bool:
        """Whether the supervisor updated the status recently."""
        return now - self.at < STALE_S

    def ready(self, now: float) -> bool:
        """Whether every camera is watched or has ended."""
        return self.healthy(now) and all(c.state in READY_STATES for c in self.cameras)
