"""What is watched, as the site file says it: cameras, where their runs go, and what each process may take."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from visup.runs.settings import RunOptions, WatchSettings


@dataclass(frozen=True, slots=True)
class ProcessLimits:
    """What the process of a camera may take before it is ended and begun anew.

    Attributes:
        memory_mb: Memory that it may have in use, megabytes.
        silent_s: How long it may make no step while its source delivers, seconds.
        start_s: How long it may take until its first step, seconds.
    """

    memory_mb: float
    silent_s: float
    start_s: float


@dataclass(frozen=True, slots=True)
class RetentionLimits:
    """What is kept, and for how long.

    Attributes:
        days: That runs are kept.
        evidence_days: That pictures and clips of alerts are kept, and what is needed to read them.
        store_bytes: Room that the store may take, or None.
        free_bytes: Room to be left on its disk.
    """

    days: float = 30.0
    evidence_days: float = 180.0
    store_bytes: float | None = None
    free_bytes: float = 1e9


@dataclass(frozen=True, slots=True)
class SiteCamera:
    """One camera of a site.

    Attributes:
        name: By which it is called everywhere.
        settings: Of its runs.
        options: How they are recorded, and where alerts go.
        limits: Of its process.
        fingerprint: Differs when anything differs that its beliefs depend on: its settings, or files that
            they name. A run goes on under the same fingerprint alone.
    """

    name: str
    settings: WatchSettings
    options: RunOptions
    limits: ProcessLimits
    fingerprint: str


@dataclass(frozen=True, slots=True)
class SiteConsole:
    """The console beside the cameras.

    Attributes:
        listen: Address and port.
        token: Of those who may act.
        viewer_token: Of those who may only look; None for nobody.
        names: Under which this machine is asked for.
        save_to: Folder into which operators may save what they write, or None.
    """

    listen: tuple[str, int]
    token: str = field(repr=False)
    viewer_token: str | None = field(default=None, repr=False)
    names: tuple[str, ...] = ()
    save_to: Path | None = None


@dataclass(frozen=True, slots=True)
class Site:
    """All that one service watches.

    Attributes:
        path: The site file.
        store: Folder of all runs; each camera has a folder of its name in it.
        cameras: In the order of the file.
        retention: What is kept of the store.
        listen: Address and port where is told how the service does, or None.
        spare: Whether a process stands ready.
        console: The console beside the cameras, or None.
    """

    path: Path
    store: Path
    cameras: tuple[SiteCamera, ...]
    retention: RetentionLimits = field(default_factory=RetentionLimits)
    listen: tuple[str, int] | None = None
    spare: bool = True
    console: SiteConsole | None = None
