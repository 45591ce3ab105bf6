"""What a run is given: the settings of `visup watch`, checked before anything starts.

Each setting is described once, here: its annotation says how it is written on the command line, and
`visup/commands/options.py` makes the options of all commands from that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from visup.agent.model.errors import SettingsError

VIEWS_AT_END = ("unknown", "weak", "strong")
"""What may become of rules that are not decided when a run ends; as of `visup.rules`."""
LARGEST_EVIDENCE = 20.0
"""With so much a single vote settles who is who."""
SOURCE_REDACTED = "source_without_secret"
"""The fact of a recorded run that its source had a password, which is not recorded."""


@dataclass(frozen=True, slots=True)
class Option:
    """How a setting is given on the command line.

    Attributes:
        help: What it is, one sentence.
        flag: Such as `--task`; the name of the setting when left out.
        metavar: What stands for its value in the help.
        parse: The setting from the texts that were given, where it is not simply them.
        at_least: The smallest value, or None.
        complete: Gives what may stand for its value, from its beginning, to a shell that completes.
    """

    help: str
    flag: str | None = None
    metavar: str | None = None
    parse: Callable[[Any], Any] | None = None
    at_least: float | None = None
    complete: Callable[[str], list[str]] | None = None


def complete_task(begun: str) -> list[str]:
    """Shipped tasks and task files that a word may become."""
    from visup.tasks import shipped_tasks

    place = Path(begun)
    folder, start = (place, "") if begun.endswith("/") else (place.parent, place.name)
    files = sorted(folder.glob(f"{start}*.task")) if folder.is_dir() else []
    return [*(t for t in shipped_tasks() if t.startswith(begun)), *map(str, files)]


def complete_preset(begun: str) -> list[str]:
    """Presets that a word may become."""
    from visup.runs.inputs.presets import PRESETS

    return [name for name in PRESETS if name.startswith(begun)]


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
    """All that a supervised run depends on besides the video itself.

    Raises:
        SettingsError: A value is out of its range.
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
            "Tell what rules say of the future as soon as it is decided, not when their windows are over.",
            "--early",
        ),
    ] = False
    at_end: Annotated[
        str,
        Option(
            "What becomes of rules that are not decided at the end: unknown, weak (they count as true) "
            "or strong (as false).",
            "--at-end",
            "VIEW",
        ),
    ] = "unknown"
    actors: Annotated[
        Mapping[str, tuple[str, ...]],
        Option(
            "The model that an actor of the task looks like.", "--actor", "NAME=MODEL", parse_actors
        ),
    ] = field(default_factory=dict)
    bystanders: Annotated[
        tuple[str, ...],
        Option(
            "A model, or a taught thing, that plays no part in the task and is left alone.",
            "--bystander",
            "NAME",
        ),
    ] = ()
    behaviours: Annotated[
        tuple[Path | str, ...],
        Option("A behaviour of your own: FILE.py or package.module:Class.", "--behaviour", "FILE"),
    ] = ()
    plugins: Annotated[
        tuple[str, ...], Option("Name of an installed behaviour to add.", "--plugin", "NAME")
    ] = ()
    plugin_settings: Annotated[
        Mapping[str, Mapping[str, Any]],
        Option(
            "A setting of a behaviour of your own.",
            "--set",
            "NAME.KEY=VALUE",
            _parse_plugin_settings,
        ),
    ] = field(default_factory=dict)
    isolate: Annotated[
        tuple[str, ...], Option("Run this behaviour in a process of its own.", metavar="NAME")
    ] = ()
    budgets: Annotated[
        bool, Option("Give up behaviours that exceed their budget; for live sources.", "--budgets")
    ] = False
    realtime: Annotated[
        bool | None,
        Option("Drop frames when visup cannot keep up, and report it (default: for live sources)."),
    ] = None
    every: Annotated[int, Option("Use every n-th frame.")] = 1
    pace: Annotated[
        float | None,
        Option("So many frames a second are enough: of a faster source others are left out."),
    ] = None
    fps: Annotated[float | None, Option("Frame rate, where the source has none.")] = None
    fov_vertical_deg: Annotated[
        float | None, Option("Vertical field of view of the camera, degrees.", "--fov")
    ] = None
    zones: Annotated[
        Path | None,
        Option("File with zones that rules can name (see docs/formats.md).", metavar="FILE"),
    ] = None
    signals: Annotated[
        tuple[Path | str, ...],
        Option(
            "Signals that are not from the image: a table (CSV with a column `time`), or "
            "mqtt:HOST/TOPIC of a broker.",
            "--signal",
            "FILE",
        ),
    ] = ()
    patience_s: float = 60.0
    """How long a camera or stream that drops is tried again, seconds."""
    rest_s: float | None = None
    """Seconds between two looks for motion while nothing changes; None to look at each frame."""
    detections: Annotated[
        Path | None,
        Option(
            "Boxes of a detector in place of visup's own eyes: a MOT or COCO file, or a YOLO network "
            "(.onnx).",
            metavar="FILE",
        ),
    ] = None
    motion: Annotated[
        bool, Option("See what moves; without it a behaviour of yours gives the regions.")
    ] = True
    preset: Annotated[
        str | None,
        Option(
            "Rules, memory and pace for a kind of scene: traffic, cell, orbit or bench "
            "(see `visup presets`).",
            complete=complete_preset,
        ),
    ] = None
    vote_evidence: float | None = None
    """How much a vote for an identity tells, in units of log likelihood; None for what visup ships with."""
    attention: Annotated[
        bool, Option("Match well-known objects less often, which saves time.", "--attention")
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
                "nothing would see: --no-motion leaves seeing to another behaviour, and there is none",
                hint="add --behaviour FILE, --plugin NAME or --detections FILE",
            )
        told = self.vote_evidence
        if told is not None and not 0 < told <= LARGEST_EVIDENCE:
            raise SettingsError(
                f"`evidence` of identities is {told}",
                expected=f"more than 0, at most {LARGEST_EVIDENCE}",
            )
        fov = self.fov_vertical_deg
        if fov is not None and not 0 < fov < 180:
            raise SettingsError(f"--fov is {fov}", expected="degrees between 0 and 180")
        if self.preset is not None:
            from visup.runs.inputs.presets import preset_named

            preset_named(self.preset)


@dataclass(frozen=True, slots=True)
class EvidenceOptions:
    """What is kept of each alert.

    Attributes:
        before_s: Seconds of its clip before it.
        after_s: Seconds of its clip after it.
        memory_mb: Memory that frames before an alert may take, megabytes.
        link: Address of the folder of all runs of the camera, for links; None for names of files.
        least_free_bytes: It is told when less is free on the disk.
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
        Option("Also send alerts there: jsonl:-, webhook:URL, ...", "--sink", "KIND:PLACE"),
    ] = ()
    keep_gb: Annotated[
        float | None,
        Option("How much of the journal to keep, in gigabytes (default: all).", at_least=0.0),
    ] = None
    state_every_s: Annotated[
        float,
        Option(
            "Seconds between checkpoints to resume from; 0 for none.", "--state-every", at_least=0.0
        ),
    ] = 30.0
    camera: Annotated[
        str | None,
        Option("Name of the camera: it and the host then stand in every record.", metavar="NAME"),
    ] = None
    webhook_headers: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Headers of each request of a webhook."""
    webhook_key: str | None = field(default=None, repr=False)
    """Key by which what webhooks send is signed."""
    span: tuple[int, int | None] = (0, None)
    """Numbers of the first frame that is watched, and of the first that no longer is; None for no end."""
    closing_s: float = 5.0
    """How long each sink may take to deliver what is left when the run ends, seconds."""
    evidence: EvidenceOptions | None = None
    """What is kept of each alert; None for nothing."""
    run_s: float | None = None
    """A run that goes on is followed by the next after so many seconds of the source."""
    run_bytes: int | None = None
    """So is one whose journal has become larger."""
    deliveries: Path | None = None
    """File in which alerts wait until sinks take them, also over a kill; None to drop what they do not."""
    quiet: tuple[str, ...] = ()
    """Hours in which only critical alerts go to sinks, such as '22:00-06:00'."""
    timezone: str | None = None
    """That of quiet hours; None for that of the machine."""
