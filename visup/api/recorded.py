"""`visup.open_run`: read a run folder as records."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from rich.console import RenderableType

from visup.agent.model.display import enable_display
from visup.agent.model.errors import OutputError, SettingsError
from visup.agent.model.events import Alert, Event, Severity
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.agent.model.task_beliefs import Verdict
from visup.agent.storage.journal_reader import Recording
from visup.api.display import run_summary
from visup.api.records import Records
from visup.runs.resume import recorded_settings
from visup.runs.settings import WatchSettings
from visup.terminal.display import html_of

Record = TypeVar("Record")


@dataclass(frozen=True, slots=True)
class RecordedStep:
    """A summary of the beliefs after one step.

    Attributes:
        frame_index: Number of the frame.
        time: Seconds.
        objects: Ids of the objects.
        verdicts: Task -> verdict so far.
        stages: Task -> stage -> status.
        health: State of the camera.
        unknown: Kinds of percepts that were not available.
    """

    frame_index: int
    time: float
    objects: tuple[int, ...] = ()
    verdicts: Mapping[str, str] = field(default_factory=dict)
    stages: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    health: str = ""
    unknown: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RecordedObject:
    """The beliefs about one object after one step.

    Attributes:
        frame_index: Number of the frame.
        time: Seconds.
        id: Number of the object within the run, from 1.
        name: The likeliest model, or 'unknown object'.
        share: Share of the votes for it, 0 to 1.
        presence: 'seen', 'hidden' or 'left'.
        confirmed: Whether there is enough evidence that it is an object.
        region: Id of its region.
        bbox: (x, y, width, height), pixels.
        area: Pixels.
        velocity: (x, y), pixels per second.
        cut: Whether the image border cuts it.
        candidates: Model -> share of the votes.
        depth: In units of the model, or relative; None when unknown.
    """

    frame_index: int
    time: float
    id: int
    name: str
    share: float
    presence: str
    confirmed: bool
    region: int
    bbox: tuple[int, ...]
    area: float
    velocity: tuple[float, ...]
    cut: bool
    candidates: Mapping[str, float] = field(default_factory=dict)
    depth: float | None = None


@dataclass(frozen=True, repr=False)
class RecordedRun:
    """A run on disk, which may still be live; each part is read when it is first used.

    Attributes:
        recording: Its journal.
    """

    recording: Recording

    @property
    def folder(self) -> Path:
        """The run folder."""
        return self.recording.path.parent

    @cached_property
    def facts(self) -> Mapping[str, Any]:
        """Facts about the run: version, source, frame rate, settings."""
        return self.recording.facts()

    @cached_property
    def settings(self) -> WatchSettings:
        """The settings of the run."""
        return recorded_settings(self.facts, str(self.recording.path))

    @property
    def verdict(self) -> Verdict | None:
        """The verdict; None if there was no task and nothing was wrong, or the run has not ended."""
        value = self.facts.get("verdict")
        return self._read(Verdict, value) if value is not None else None

    @cached_property
    def events(self) -> Records[Event]:
        """The events, in order."""
        return self._records(Event, _event, self.recording.events())

    @cached_property
    def alerts(self) -> Records[Alert]:
        """The alerts in their final state, in the order in which they opened."""
        return self._records(Alert, _alert, self.recording.alerts().values())

    @cached_property
    def steps(self) -> Records[RecordedStep]:
        """A summary of the beliefs after each step."""
        return self._records(RecordedStep, _step, self.recording.summaries())

    @cached_property
    def objects(self) -> Records[RecordedObject]:
        """The beliefs about each object after each step, one record per object and step."""
        lines = ({**o, **_timestamp(s)} for s in self.recording.summaries() for o in s["objects"])
        return self._records(RecordedObject, _object, lines)

    def __repr__(self) -> str:
        return f"RecordedRun({str(self.folder)!r})"

    def __rich__(self) -> RenderableType:
        return self._summary()

    def _repr_html_(self) -> str:
        return html_of(self._summary())

    def _summary(self) -> RenderableType:
        has_task = bool(self.settings.tasks)
        return run_summary(str(self.folder), self.events, self.verdict, has_task=has_task)

    def _records(
        self, kind: type[Record], construct: Callable[[Any], Record], lines: Iterable[Any]
    ) -> Records[Record]:
        return Records(kind, [self._read(construct, line) for line in lines])

    def _read(self, construct: Callable[[Any], Record], line: Any) -> Record:
        try:
            return construct(line)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            where = str(self.recording.path)
            raise OutputError(f"a record cannot be read ({error})", where=where) from error


def open_run(folder: str | os.PathLike[str]) -> RecordedRun:
    """Open a recorded run.

    Example:
        ```python
        run = visup.open_run("demo-run")
        for event in run.events:
            print(event.time, event.text)
        run.objects.to_pandas().groupby("name")["time"].describe()
        ```

    Args:
        folder: A run folder, or the journal in it.

    Raises:
        OutputError: There is no run, or it cannot be read.
        SettingsError: `folder` is not a path.
    """
    if not isinstance(folder, str | os.PathLike):
        raise SettingsError(f"a run folder cannot be {folder!r}", expected="a path")
    return RecordedRun(Recording.open(Path(folder)))


def _event(line: Mapping[str, Any]) -> Event:
    return Event(**_known_fields(Event, line))


def _alert(line: Mapping[str, Any]) -> Alert:
    return Alert(**_known_fields(Alert, line))


def _known_fields(kind: Any, line: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a record from its line in the journal, lists as tuples."""
    names = {f.name for f in fields(kind)}
    values = {k: tuple(v) if isinstance(v, list) else v for k, v in line.items() if k in names}
    return {**values, "severity": Severity[line["severity"].upper()]}


def _timestamp(summary: Mapping[str, Any]) -> dict[str, Any]:
    return {"frame_index": summary["frame_index"], "time": summary["time"]}


def _step(summary: Mapping[str, Any]) -> RecordedStep:
    tasks = summary["tasks"]
    return RecordedStep(
        **_timestamp(summary),
        objects=tuple(o["id"] for o in summary["objects"]),
        verdicts={t["task"]: t["verdict"] for t in tasks},
        stages={t["task"]: t["stages"] for t in tasks},
        health=summary["health"]["status"],
        unknown=tuple(summary["unknown"]),
    )


def _object(line: Mapping[str, Any]) -> RecordedObject:
    candidates = [(str(name), float(share)) for name, share in line["candidates"]]
    name, share = candidates[0] if candidates else (UNKNOWN_OBJECT, 0.0)
    lists = {"bbox": tuple(line["bbox"]), "velocity": tuple(line["velocity"])}
    values = {**line, **lists, "name": name, "share": share, "candidates": dict(candidates)}
    return RecordedObject(**values)


enable_display(RecordedStep, RecordedObject)
