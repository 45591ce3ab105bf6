"""The settings of a run (the options of `visup watch`), checked before anything starts.

Each setting is described once, here: its annotation says how it is written on the command line, and
`visup/commands/options.py` builds the options of all commands from it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from visup.agent.model.errors import SettingsError

VIEWS_AT_END = ("unknown", "weak", "strong")
"""How rules that are undecided when a run ends may count; as in `visup.rules`."""
MAX_EVIDENCE = 20.0
"""With this weight a single vote decides an identity."""
SOURCE_REDACTED = "source_without_secret"
"""Key of a recorded run that says its source had a password, which was not recorded."""


@dataclass(frozen=True, slots=True)
class Option:
    """How a setting is given on the command line.

    Attributes:
        help: One sentence for `--help`.
        flag: Such as `--task`; by default made from the name of the setting.
        metavar: Placeholder for the value in the help.
        parse: Converts the texts given into the setting; None to take them as they are.
        at_least: The smallest value, or None.
        complete: Completions of a value that has been begun, for the shell.
    """

    help: str
    flag: str | None = None
    metavar: str | None = None
    parse: Callable[[Any], Any] | None = None
    at_least: float | None = None
    complete: Callable[[str], list[str]] | None = None


def complete_task(prefix: str) -> list[str]:
    """Shipped tasks and task files that complete a word."""
    from visup.tasks import shipped_tasks

    path = Path(prefix)
    folder, start = (path, "") if prefix.endswith("/") else (path.parent, path.name)
    files = sorted(folder.glob(f"{start}*.task")) if folder.is_dir() else []
    return [*(t for t in shipped_tasks() if t.startswith(prefix)), *map(str, files)]


def complete_preset(prefix: str) -> list[str]:
    """Presets that complete a word."""
    from visup.runs.inputs.presets import PRESETS

    return [name for name in PRESETS if name.startswith(prefix)]


def parse_actors(bindings: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Actors from `NAME=MODEL` or `NAME=MODEL,MODEL`.

    >>> parse_actors(["satellite=spartan,hubble", "arm=rms"])
    {'satellite': ('spartan', 'hubble'), 'arm': ('rms',)}

    Raises:
        SettingsError: One is not of that form, or an actor is bound twice.
    """
    actors: dict[str, tuple[str, ...]] = {}
    for binding in bindings:
        name, equals, models = binding.partition("=")
        names = tuple(m.strip() for m in models.split(",") if m.strip())
        if not (equals and name.strip() and names):
            raise SettingsError(
                f"--actor {binding!r} cannot be read",
                expected="NAME=MODEL, such as satellite=spartan201",
            )
        if name.strip() in actors:
            raise SettingsError(
                f"the actor '{name.strip()}' is bound twice",
                hint="separate alternatives by commas: NAME=MODEL,MODEL",
            )
        actors[name.strip()] = names
    return actors


def _parse_plugin_settings(texts: Iterable[str]) -> dict[str, dict[str, Any]]:
    from visup.agent.plugins.settings import parse_settings

    return parse_settings(texts)


@dataclass(frozen=True, slots=True)
class WatchSettings:
    """Everything a supervised run depends on besides the video itself.

    Raises:
        SettingsError: A value is out of range.
    """

    source: str
    """File, folder of images, camera index or URL."""
    tasks: Annotated[
        tuple[str, ...],
        Option(
            "Task file, or the name of a shipped task.", "--task", "FILE", complete=complete_task
        ),
    ] = ()
    models: Annotated[
        Path | None, Option("Model database (see `visup models build`).", metavar="DB")
    ] = None
    rules: Annotated[
        tuple[Path, ...], Option("Rules file, instead of the shipped rules.", metavar="FILE")
    ] = ()
    early: Annotated[
        bool,
        Option(
            "Report rules about the future as soon as they are decided, rather than when their time "
            "window ends.",
            "--early",
        ),
    ] = False
    at_end: Annotated[
        str,
        Option(
            "How rules that are still undecided at the end count: unknown, weak (as true) or strong "
            "(as false).",
            "--at-end",
            "VIEW",
        ),
    ] = "unknown"
    actors: Annotated[
        Mapping[str, tuple[str, ...]],
        Option(
            "Which model an actor of the task looks like.", "--actor", "NAME=MODEL", parse_actors
        ),
    ] = field(default_factory=dict)
    bystanders: Annotated[
        tuple[str, ...],
        Option(
            "A model or taught object that plays no part in the task and is ignored by it.",
            "--bystander",
            "NAME",
        ),
    ] = ()
    behaviours: Annotated[
        tuple[Path | str, ...],
        Option("A behaviour of your own: FILE.py or package.module:Class.", "--behaviour", "FILE"),
    ] = ()
    plugins: Annotated[
        tuple[str, ...], Option("Add an installed behaviour, by name.", "--plugin", "NAME")
    ] = ()
    plugin_settings: Annotated[
        Mapping[str, Mapping[str, Any]],
        Option(
            "A setting of a behaviour.",
            "--set",
            "NAME.KEY=VALUE",
            _parse_plugin_settings,
        ),
    ] = field(default_factory=dict)
    isolate: Annotated[
        tuple[str, ...], Option("Run this behaviour in its own process.", metavar="NAME")
    ] = ()
    budgets: Annotated[
        bool,
        Option("Stop behaviours that exceed their time budget; for live sources.", "--budgets"),
    ] = False
    realtime: Annotated[
        bool | None,
        Option(
            "Drop frames when visup cannot keep up, and report it (default: live sources only)."
        ),
    ] = None
    every: Annotated[int, Option("Use every n-th frame.")] = 1
    pace: Annotated[
        float | None,
        Option("Frames per second that are enough; the surplus of a faster source is skipped."),
    ] = None
    fps: Annotated[float | None, Option("Frame rate, if the source does not state one.")] = None
    fov_vertical_deg: Annotated[
        float | None, Option("Vertical field of view of the camera, degrees.", "--fov")
    ] = None
    zones: Annotated[
        Path | None,
        Option("File of zones that rules can refer to (see docs/formats.md).", metavar="FILE"),
    ] = None
    signals: Annotated[
        tuple[Path | str, ...],
        Option(
            "Signals from elsewhere than the image: a table (CSV with a column `time`), or an MQTT "
            "topic (mqtt:HOST/TOPIC).",
            "--signal",
            "FILE",
        ),
    ] = ()
    patience_s: float = 60.0
    """How long to keep reconnecting to a camera or stream that has dropped, seconds."""
    rest_s: float | None = None
    """Seconds between two searches for motion while nothing changes; None to search every frame."""
    detections: Annotated[
        Path | None,
        Option(
            "Take boxes from a detector instead of visup's motion segmentation: a MOT or COCO file, "
            "or a YOLO network (.onnx).",
            metavar="FILE",
        ),
    ] = None
    motion: Annotated[
        bool, Option("Segment motion; with --no-motion a behaviour of yours supplies the regions.")
    ] = True
    preset: Annotated[
        str | None,
        Option(
            "Rules, memory and frame rate for a kind of scene: traffic, cell, orbit or bench "
            "(see `visup presets`).",
            complete=complete_preset,
        ),
    ] = None
    vote_evidence: float | None = None
    """Weight of a vote for an identity, in log-likelihood units; None for the default."""
    attention: Annotated[
        bool,
        Option(
            "Save time by matching objects less often once their identity is sure.", "--attention"
        ),
    ] = False

    def __post_init__(self) -> None:
        if self.at_end not in VIEWS_AT_END:
            raise SettingsError(f"--at-end is {self.at_end!r}", expected="unknown, weak or strong")
        if self.every < 1:
            raise SettingsError(f"--every is {self.every}", expected="1 or more")
        if self.pace is not None and not 0 < self.pace <= 1000:
            raise SettingsError(f"--pace is {self.pace}", expected="more than 0, at most 1000")
        if self.fps is not None and not 0 < self.fps <= 1000:
            raise SettingsError(f"--fps is {self.fps}", expected="more than 0, at most 1000")
        if not (self.motion or self.behaviours or self.plugins or self.detections):
            raise SettingsError(
                "nothing would supply regions: --no-motion needs another behaviour that does",
                hint="add --behaviour FILE, --plugin NAME or --detections FILE",
            )
        evidence = self.vote_evidence
        if evidence is not None and not 0 < evidence <= MAX_EVIDENCE:
            raise SettingsError(
                f"`evidence` of identities is {evidence}",
                expected=f"more than 0, at most {MAX_EVIDENCE}",
            )
        fov = self.fov_vertical_deg
        if fov is not None and not 0 < fov < 180:
            raise SettingsError(f"--fov is {fov}", expected="degrees between 0 and 180")
        if self.preset is not None:
            from visup.runs.inputs.presets import preset_named

            preset_named(self.preset)


@dataclass(frozen=True, slots=True)
class EvidenceOptions:
    """What to keep as evidence of each alert.

    Attributes:
        before_s: Seconds of video to keep before the alert.
        after_s: Seconds of video to keep after the alert.
        memory_mb: Memory that buffered frames may take, megabytes.
        link: Address of the folder of all runs of the camera, for links; None for file names.
        least_free_bytes: A warning is given when the disk has less free space than this.
    """

    before_s: float = 8.0
    after_s: float = 8.0
    memory_mb: float = 32.0
    link: str | None = None
    least_free_bytes: float = 0.0


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How a run is recorded, and where its alerts go."""

    video: Annotated[bool, Option("Write the annotated video.")] = True
    report: bool = True
    """Whether to write the report."""
    sinks: Annotated[
        tuple[str, ...],
        Option("Also send alerts to this sink: jsonl:-, webhook:URL, ...", "--sink", "KIND:PLACE"),
    ] = ()
    keep_gb: Annotated[
        float | None,
        Option("Keep at most this much of the journal, in gigabytes (default: all).", at_least=0.0),
    ] = None
    state_every_s: Annotated[
        float,
        Option(
            "Seconds between the checkpoints that a run can resume from; 0 for none.",
            "--state-every",
            at_least=0.0,
        ),
    ] = 30.0
    camera: Annotated[
        str | None,
        Option(
            "Name of the camera; every record then carries it and the host name.", metavar="NAME"
        ),
    ] = None
    webhook_headers: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Headers sent with each webhook request."""
    webhook_key: str | None = field(default=None, repr=False)
    """Key that signs webhook requests."""
    span: tuple[int, int | None] = (0, None)
    """Frames to watch, as a half-open range of indices; None for no end."""
    closing_s: float = 5.0
    """How long each sink may take to deliver pending alerts when the run ends, seconds."""
    evidence: EvidenceOptions | None = None
    """What to keep as evidence of each alert; None for nothing."""
    run_s: float | None = None
    """Start a new run after this many seconds of the source."""
    run_bytes: int | None = None
    """Start a new run when the journal exceeds this size."""
    reserve_bytes: int = 0
    """Disk space that a journal reserves, so that steps are recorded for a while on a full disk."""
    deliveries: Path | None = None
    """Queue file in which alerts wait until sinks accept them, which survives a kill; None to drop alerts."""
    quiet: tuple[str, ...] = ()
    """Hours in which only critical alerts go to sinks, such as '22:00-06:00'."""
    timezone: str | None = None
    """Time zone of the quiet hours; None for that of the machine."""
