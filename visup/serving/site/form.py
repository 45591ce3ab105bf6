"""The form of the site file: pydantic tables, from which its JSON Schema is made."""

from __future__ import annotations

import json

from pydantic import BaseModel, ConfigDict, Field, field_validator

from visup.runs.inputs.presets import PRESETS

MAX_CAMERAS = 64

Names = tuple[str, ...]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class RecordingTable(_Table):
    """How runs are recorded."""

    video: bool = Field(default=False, description="Write the annotated video of each run.")
    report: bool = Field(default=False, description="Write report.html when a run ends.")
    keep_gb: float = Field(
        default=20.0, gt=0, description="How much of the journal of a run to keep, gigabytes."
    )
    state_every: float = Field(
        default=10.0,
        ge=1,
        description="Seconds between the checkpoints from which a camera resumes.",
    )
    run_hours: float = Field(
        default=24.0, gt=0, description="Hours after which the next run starts."
    )
    run_gb: float = Field(
        default=5.0,
        gt=0,
        description="Size of the journal at which the next run starts, gigabytes.",
    )


class EvidenceTable(_Table):
    """Pictures and clips of alerts."""

    wanted: bool = Field(default=True, description="Whether to save pictures and clips of alerts.")
    before_s: float = Field(
        default=8.0, ge=0, le=120, description="Seconds of a clip before its alert."
    )
    after_s: float = Field(default=8.0, ge=0, le=120, description="Seconds of a clip after it.")
    memory_mb: float = Field(
        default=32.0, ge=1, le=1000, description="Memory for buffered frames, megabytes."
    )
    link: str | None = Field(
        default=None,
        pattern=r"^https?://",
        description="URL at which the store is served, for links; file names by default.",
    )


class RetentionTable(_Table):
    """What is kept for how long; of a run that goes on nothing is deleted but evidence."""

    days: float = Field(default=30.0, gt=0, description="Days to keep runs.")
    evidence_days: float = Field(
        default=180.0, gt=0, description="Days to keep pictures and clips of alerts."
    )
    store_gb: float | None = Field(
        default=None, gt=0, description="Disk space that the store may use, gigabytes."
    )
    free_gb: float = Field(
        default=1.0,
        ge=0,
        description="Disk space to leave free, gigabytes; otherwise the oldest evidence is deleted.",
    )


class MonitoringTable(_Table):
    """Where /healthz, /readyz and /metrics are answered."""

    listen: str = Field(
        default="127.0.0.1:9464",
        pattern=r"^$|^([A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\]):[0-9]{1,5}$",
        description="ADDRESS:PORT, only this machine by default; empty for none.",
    )


class ConsoleTable(_Table):
    """The console in the browser, in a process of its own beside the cameras; values may be placeholders."""

    listen: str = Field(
        pattern=r"^([A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\]):[1-9][0-9]{0,4}$",
        description="ADDRESS:PORT, such as 127.0.0.1:8086.",
    )
    token: str = Field(description="Token for full access; at least 16 letters and digits.")
    viewer_token: str | None = Field(default=None, description="Token for read-only access.")
    names: Names = Field(default=(), description="Further host names of this machine.")
    save_to: str | None = Field(
        default=None, description="Folder in which tasks, rules and zones may be saved."
    )


class WebhooksTable(_Table):
    """How servers of webhooks know that records come from here; values may be placeholders."""

    headers: dict[str, str] = Field(default={}, description="Headers of each request.")
    key: str | None = Field(default=None, description="Key with which each record is signed.")


class LimitsTable(_Table):
    """What the process of a camera may take before it is ended and begun anew."""

    memory_mb: float = Field(default=2000.0, ge=200, description="Memory limit, megabytes (Linux).")
    silent_s: float = Field(default=90.0, ge=1, description="Seconds without a sign of life.")
    start_s: float = Field(default=180.0, ge=5, description="Seconds until the first step.")
    spare: bool = Field(
        default=True,
        description="Whether to keep a spare process ready to replace the next that ends (about 300 MB).",
    )


class CameraTable(_Table):
    """One camera. Names of files count from the folder of the site file."""

    name: str = Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}$",
        description="A unique name of letters, digits, dot, hyphen and _, also used for its folder.",
    )
    source: str = Field(
        min_length=1,
        description="URL, camera index, file, folder of images, or loop:FILE; ${NAME} is a variable of the "
        "environment, ${file:PATH} the text of a file.",
    )
    tasks: Names = Field(default=(), description="Task files, or names of shipped tasks.")
    models: str | None = Field(default=None, description="Model database.")
    actors: dict[str, str | Names] = Field(
        default={}, description="Actor of a task -> its model or models."
    )
    bystanders: Names = Field(default=(), description="Models that play no part in any task.")
    rules: Names = Field(default=(), description="Rules files, instead of the shipped rules.")
    zones: str | None = Field(default=None, description="File of zones that rules can refer to.")
    signals: Names = Field(default=(), description="Tables of signals (CSV), or mqtt:HOST/TOPIC.")
    detections: str | None = Field(
        default=None,
        description="A YOLO network (.onnx) or a file of boxes, instead of motion segmentation.",
    )
    behaviours: Names = Field(
        default=(), description="Your own behaviours: FILE.py or module:Class."
    )
    plugins: Names = Field(default=(), description="Names of installed behaviours to add.")
    isolate: Names = Field(default=(), description="Behaviours to run in their own processes.")
    preset: str | None = Field(
        default=None,
        description="Rules, memory and frame rate for a kind of scene.",
        json_schema_extra={"enum": [*PRESETS, None]},
    )
    pace: float | None = Field(
        default=None, gt=0, le=1000, description="Frames per second that are enough."
    )
    fps: float | None = Field(
        default=None, gt=0, le=1000, description="Frame rate, if the source does not state one."
    )
    fov: float | None = Field(
        default=None, gt=0, lt=180, description="Vertical field of view of the camera, degrees."
    )
    realtime: bool | None = Field(
        default=None,
        description="Drop frames when visup cannot keep up (default: for live sources).",
    )
    patience_s: float = Field(
        default=60.0,
        ge=0,
        description="How long to keep reconnecting to a stream that has dropped, seconds.",
    )
    rest_s: float = Field(
        default=8.0,
        ge=0,
        le=60,
        description="Seconds between two searches for motion while nothing changes; 0 to search every frame.",
    )
    attention: bool = Field(
        default=False, description="Match objects less often once their identity is sure."
    )
    quiet: Names = Field(
        default=(),
        description="Hours in which only critical alerts go to sinks: 22:00-06:00, or Sat-Sun 00:00-24:00.",
    )
    sinks: Names = Field(default=(), description="Further sinks for its alerts.")

    @field_validator("preset")
    @classmethod
    def _known(cls, value: str | None) -> str | None:
        if value is not None and value not in PRESETS:
            raise ValueError(f"one of: {', '.join(PRESETS)}")
        return value


class SiteTable(_Table):
    """A site: the cameras that one service watches, and what becomes of what they see."""

    store: str = Field(
        default="visup-runs",
        min_length=1,
        description="Folder of all runs; each camera has its own in it.",
    )
    sinks: Names = Field(default=(), description="Where alerts of all cameras go, as for `--sink`.")
    recording: RecordingTable = RecordingTable()
    evidence: EvidenceTable = EvidenceTable()
    retention: RetentionTable = RetentionTable()
    monitoring: MonitoringTable = MonitoringTable()
    timezone: str | None = Field(
        default=None,
        description="Time zone of quiet hours, such as Europe/Berlin; by default the machine's.",
    )
    limits: LimitsTable = LimitsTable()
    webhooks: WebhooksTable = WebhooksTable()
    console: ConsoleTable | None = Field(
        default=None, description="Show all runs in the browser; off by default."
    )
    camera: tuple[CameraTable, ...] = Field(
        description="One table [[camera]] for each camera.",
        json_schema_extra={"minItems": 1, "maxItems": MAX_CAMERAS},
    )


def schema_text() -> str:
    """The JSON Schema of a site file."""
    named = {"$id": "visup-site-1", "title": "visup: a site file, version 1"}
    return json.dumps({**SiteTable.model_json_schema(), **named}, indent=1, sort_keys=True)
