"""One run as read by the console: moments by time with their beliefs, events and alerts."""

from __future__ import annotations

from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Alert, Event, Hypothesis, Mind, Observation, Zone
from visup.agent.model.errors import OutputError, VisupError
from visup.agent.storage.wall_clock import WallClock
from visup.api.recorded import open_run
from visup.console.drawing.pictures import RunPictures, jpeg
from visup.console.evidence import evidence_of, latest_snapshot
from visup.console.recorded_mind import recorded_mind
from visup.console.run_files import flows_of, zones_of
from visup.console.tracks import TimelineTrack, behaviour_tracks, tracks_of
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.report.annotate import annotate
from visup.runs.settings import WatchSettings
from visup.tasks.tools.diagram import Flow

MAX_CACHED_MOMENTS = 64
THUMBNAIL_WIDTH = 224
"""Width of a thumbnail, pixels."""

TRAIL_S = 4.0
"""Length of a trail, seconds."""

MAX_TRAIL_POINTS = 60
"""Maximum number of moments in a trail."""

MATCH_LOOKBACK = 20
"""How many moments back to search for the last match of an object."""

MAX_SAMPLES = 240
"""Maximum number of samples for a curve or row."""


KEPT_ATTRIBUTES = ("pictures", "settings", "models", "flows", "zones")
"""What stays the same while a run grows."""


class RunView:
    """A run as far as it was written when opened; `refreshed` reads on.

    Args:
        folder: Folder of the run.
        previous: An earlier view of the same run: only what was written since is read.

    Attributes:
        folder: The same.
        frames: Numbers of the processed frames, in order.
        times: Their times, seconds.

    Raises:
        OutputError: It cannot be read.
    """

    def __init__(self, folder: Path, previous: RunView | None = None) -> None:
        self.folder = folder
        self._run = open_run(folder)
        self.frames: list[int] = list(previous.frames) if previous else []
        self.times: list[float] = list(previous.times) if previous else []
        moments = list(self._run.recording.moments(self.frames[-1] if self.frames else -1))
        self.frames += [frame for frame, _ in moments]
        self.times += [time for _, time in moments]
        if previous is not None:
            self.__dict__ |= {k: v for k, v in previous.__dict__.items() if k in KEPT_ATTRIBUTES}
        self._moments: OrderedDict[int, tuple[Mind, Observation]] = OrderedDict()
        self._lock = Lock()

    def refreshed(self) -> RunView:
        """This run, read on if it has grown or ended."""
        ends = self._run.recording.first_and_last()
        unchanged = ends is None or (bool(self.frames) and ends[1] == self.frames[-1])
        if unchanged and (self.ended or "ended" not in self._run.recording.facts()):
            return self
        return RunView(self.folder, self if self._continues() else None)

    def _continues(self) -> bool:
        """Whether the journal still ends this view as it did; a run that was resumed may have gone back."""
        if not self.frames:
            return False
        moments = self._run.recording.moments(self.frames[-1] - 1)
        return next(moments, None) == (self.frames[-1], self.times[-1])

    @property
    def ended(self) -> bool:
        """Whether the run has ended."""
        return "ended" in self._run.facts

    @property
    def verdict(self) -> str | None:
        """The verdict, or None."""
        return None if self._run.verdict is None else self._run.verdict.value

    @property
    def source(self) -> str:
        """The source."""
        source = self._run.facts.get("source")
        return source if isinstance(source, str) else ""

    @property
    def seconds(self) -> float:
        """Time of the last moment."""
        return self.times[-1] if self.times else 0.0

    @property
    def start(self) -> float:
        """Time of the first moment: a run that follows another continues its time."""
        return self.times[0] if self.times else 0.0

    def share(self, time: float) -> float:
        """The position of a time in the run, 0 to 1."""
        return min(1.0, max(0.0, (time - self.start) / max(self.seconds - self.start, 1e-6)))

    @property
    def name(self) -> str:
        """Its name on pages."""
        camera = self._run.facts.get("camera")
        return f"{camera} · {self.folder.name}" if isinstance(camera, str) else self.folder.name

    @cached_property
    def clock(self) -> WallClock:
        """The wall clock of the run; empty for a run without a camera."""
        return WallClock.read(self._run.facts.get("clock"))

    def time_text(self, time: float) -> str:
        """A time for pages: in UTC if known, with the date if it differs from the last day."""
        text, last = self.clock.text(time), self.clock.text(self.seconds)
        if text is None or last is None:
            return clock_text(time)
        return text[11:19] if text[:10] == last[:10] else f"{text[5:10]} {text[11:19]}"

    def cursor_text(self, time: float) -> str:
        """The time of the cursor for pages."""
        text = self.clock.text(time)
        if text is None:
            return f"{clock_text(time)} / {clock_text(self.seconds)}"
        return f"{text[:10]} {text[11:19]} UTC"

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """All events, in order."""
        return tuple(self._run.events)

    @cached_property
    def alerts(self) -> tuple[Alert, ...]:
        """All alerts in their last state."""
        return tuple(self._run.alerts)

    @cached_property
    def tracks(self) -> tuple[TimelineTrack, ...]:
        """The rows of the timeline."""
        rows = tracks_of(self.events, self.alerts, self.seconds, self.actors)
        states = ((t, _states(rows)) for t, rows in self._samples())
        return (*rows, *behaviour_tracks(states, self.seconds))

    @cached_property
    def pictures(self) -> RunPictures:
        """Frames of the source."""
        return RunPictures(self.source)

    @cached_property
    def settings(self) -> WatchSettings | None:
        """The settings of the run; None where they cannot be read."""
        try:
            return self._run.settings
        except VisupError:
            return None

    @cached_property
    def models(self) -> ModelDatabase | None:
        """The model database of the run, or None.

        Raises:
            DatabaseError: They cannot be read.
        """
        path = self.settings.models if self.settings else None
        return ModelDatabase.open(path) if path else None

    @cached_property
    def flows(self) -> Mapping[str, Flow]:
        """Task -> its flow."""
        return flows_of(self.settings)

    @cached_property
    def zones(self) -> tuple[Zone, ...]:
        """The zones of the run."""
        return zones_of(self.settings)

    @property
    def actors(self) -> Mapping[str, tuple[str, ...]]:
        """Actor -> models."""
        return dict(self.settings.actors) if self.settings else {}

    def moment_at(self, time: float) -> int:
        """Number of the last moment not after a time, from 0; the first if all are later."""
        return max(0, bisect_right(self.times, time + 1e-6) - 1)

    def moment_of_frame(self, frame: int) -> int:
        """Number of the last moment whose frame is not after the given one."""
        return max(0, bisect_right(self.frames, frame) - 1)

    def mind(self, number: int) -> Mind:
        """The mind at a moment.

        Raises:
            OutputError: There is no such moment, or it is damaged.
        """
        return self._moment(number)[0]

    def _moment(self, number: int) -> tuple[Mind, Observation]:
        if not 0 <= number < len(self.frames):
            raise OutputError("nothing has been processed in this run yet", where=str(self.folder))
        with self._lock:
            if number not in self._moments:
                summary, observation = self._run.recording.step_at(self.frames[number])
                mind = recorded_mind(summary, observation, self.alerts, self.actors)
                self._moments[number] = replace(mind, zones=self.zones), observation
                while len(self._moments) > MAX_CACHED_MOMENTS:
                    self._moments.popitem(last=False)
            return self._moments[number]

    def matches(self, number: int, object_id: int) -> tuple[Hypothesis, ...]:
        """The latest matches of an object, best first; empty if there are none."""
        return self.last_match(number, object_id)[1]

    def last_match(self, number: int, object_id: int) -> tuple[int | None, tuple[Hypothesis, ...]]:
        """Frame of the last match of an object, or None, and its result."""
        for moment in range(number, max(-1, number - MATCH_LOOKBACK), -1):
            mind, observation = self._moment(moment)
            belief = mind.objects.get(object_id)
            region = belief.region.id if belief else None
            found = [h for h in observation.of("hypothesis") if h.region_id == region]
            if found:
                return moment, tuple(sorted(found, key=lambda h: -h.similarity))
        return None, ()

    def trails(self, number: int) -> Mapping[int, list[tuple[float, float]]]:
        """The trails of visible objects before a moment: centres of their boxes, pixels."""
        begin = self.moment_at(self.times[number] - TRAIL_S)
        sampled = set(self.frames[number : begin : -(1 + (number - begin) // MAX_TRAIL_POINTS)])
        found: dict[int, list[tuple[float, float]]] = {}
        for summary in self._run.recording.summaries(self.frames[begin], self.frames[number]):
            for line in summary["objects"] if summary["frame_index"] in sampled else ():
                if line["presence"] == "seen" and line["confirmed"]:
                    x, y, w, h = line["bbox"]
                    found.setdefault(line["id"], []).append((x + w / 2, y + h / 2))
        in_view = {b.id for b in self.mind(number).present()}
        return {i: points for i, points in found.items() if i in in_view and len(points) > 1}

    def picture(self, number: int, *, plain: bool = False) -> bytes:
        """A moment as JPEG."""
        return self.pictures.annotated(self.mind(number), plain=plain)

    def thumbnail(self) -> bytes:
        """A thumbnail of the middle of the run, or of a camera's latest alert, as JPEG."""
        image = self._alert_picture()
        if image is None:
            mind = self.mind(len(self.frames) // 2)
            image = annotate(self.pictures.frame(mind), mind)
        height = round(image.shape[0] * THUMBNAIL_WIDTH / image.shape[1])
        size = (THUMBNAIL_WIDTH, max(1, height))
        return jpeg(cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8))

    def _alert_picture(self) -> NDArray[np.uint8] | None:
        """The saved picture of the latest alert, if frames are not available."""
        number = latest_snapshot(self.folder) if self.pictures.problem else None
        path = None if number is None else evidence_of(self.folder, number).snapshot
        image = None if path is None else cv2.imread(str(path))
        return None if image is None else np.asarray(image, np.uint8)

    def identity_shares(self, object_id: int) -> Iterator[tuple[float, Mapping[str, float]]]:
        """The identity votes of an object over time: time, and name -> share of the votes."""
        for time, summary in self._samples():
            for line in summary.get("objects", ()):
                if line.get("id") == object_id:
                    yield time, {str(n): float(s) for n, s in line["candidates"]}

    def _samples(self) -> Iterator[tuple[float, Mapping[str, Any]]]:
        """Summaries at a few hundred moments.

        An approximation for runs of days: shorter changes may be missed. Unreadable moments are left out.
        """
        step = max(1, -(-len(self.frames) // MAX_SAMPLES))
        for summary in self._run.recording.summaries_of(self.frames[::step]):
            yield float(summary["time"]), summary


def clock_text(seconds: float) -> str:
    """A time of a run, such as '0:07.3' or '1:02:03.0'."""
    tenths = round(max(0.0, seconds) * 10)
    minutes, rest = divmod(tenths, 600)
    hours, minutes = divmod(minutes, 60)
    tail = f"{rest // 10:02d}.{rest % 10}"
    return f"{hours}:{minutes:02d}:{tail}" if hours else f"{minutes}:{tail}"


def _states(summary: Mapping[str, Any]) -> Mapping[str, str]:
    """Behaviour -> its state in a step."""
    found = summary.get("behaviours")
    rows = found.items() if isinstance(found, Mapping) else ()
    return {str(name): str(entry[0]) for name, entry in rows if isinstance(entry, list) and entry}
