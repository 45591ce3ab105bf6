"""Records of a site: cameras, retention, process limits and the console."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from visup.runs.settings import RunOptions, WatchSettings


@dataclass(frozen=True, slots=True)
class ProcessLimits:
    """Limits beyond which the process of a camera is restarted.

    Attributes:
        memory_mb: Resident memory, megabytes.
        silent_s: Time without a step while the source delivers, seconds.
        start_s: Time until the first step, seconds.
    """

    memory_mb: float
    silent_s: float
    start_s: float


@dataclass(frozen=True, slots=True)
class RetentionLimits:
    """How long recordings are kept, and how much space they may use.

    Attributes:
        days: Days to keep runs.
        evidence_days: Days to keep pictures, clips and records of alerts.
        store_bytes: Maximum size of the store, or None.
        free_bytes: Space to leave free on its disk.
    """

    days: float = 30.0
    evidence_days: float = 180.0
    store_bytes: float | None = None
    free_bytes: float = 1e9


@dataclass(frozen=True, slots=True)
class SiteCamera:
    """One camera of a site.

    Attributes:
        name: Unique name.
        settings: Settings of its runs.
        options: How they are recorded, and where alerts go.
        limits: Limits of its process.
        fingerprint: Digest of what its beliefs depend on: settings and the files they name. A run is resumed
            only under the same fingerprint.
    """

    name: str
    settings: WatchSettings
    options: RunOptions
    limits: ProcessLimits
    fingerprint: str


@dataclass(frozen=True, slots=True)
class SiteConsole:
    """The console of a site.

    Attributes:
        listen: Address and port.
        token: Token for full access.
        viewer_token: Token for read-only access; None for none.
        names: Further host names of this machine.
        save_to: Folder in which operators may save tasks, rules and zones, or None.
    """

    listen: tuple[str, int]
    token: str = field(repr=False)
    viewer_token: str | None = field(default=None, repr=False)
    names: tuple[str, ...] = ()
    save_to: Path | None = None


@dataclass(frozen=True, slots=True)
class Site:
    """The site that one service watches.

    Attributes:
        path: The site file.
        store: Folder of all runs; each camera has a folder of its name in it.
        cameras: In the order of the file.
        retention: Retention limits of the store.
        listen: Address and port of the monitoring server, or None.
        spare: Whether to keep a spare process ready.
        console: The console, or None.
    """

    path: Path
    store: Path
    cameras: tuple[SiteCamera, ...]
    retention: RetentionLimits = field(default_factory=RetentionLimits)
    listen: tuple[str, int] | None = None
    spare: bool = True
    console: SiteConsole | None = None
