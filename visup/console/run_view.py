"""One run as the console reads it: moments by time, what was believed in each, its events and alerts."""

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

from visup.agent import Alert, Event, Hypothesis, Mind, Observation, Zone
from visup.agent.model.errors import OutputError, VisupError
from visup.api.recorded import open_run
from visup.console.drawing.pictures import RunPictures, jpeg
from visup.console.recorded_mind import recorded_mind
from visup.console.run_files import flows_of, zones_of
from visup.console.tracks import TimelineTrack, behaviour_tracks, tracks_of
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.report.annotate import annotate
from visup.runs.settings import WatchSettings
from visup.tasks.tools.diagram import Flow

KEPT_MOMENTS = 64
THUMBNAIL = 224
"""Width of a small picture, pixels."""

TRAIL_S = 4.0
"""How much of where objects were is drawn, seconds."""

MOST_TRAIL = 60
"""Moments of a trail at most."""

LOOKED_BACK = 20
"""Moments back to the last time that somebody looked what an object is."""

MOST_SAMPLES = 240
"""Moments at which what changes slowly is looked up for its curve or row."""


class RunView:
    """A run, read as far as it was written when it was opened; `refreshed` reads on.

    Args:
        folder: Of the run.

    Attributes:
        folder: The same.
        frames: Numbers of the frames that were judged, in order.
        times: Their times, seconds.

    Raises:
        OutputError: It cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._run = open_run(folder)
        moments = list(self._run.recording.moments())
        self.frames = [frame for frame, _ in moments]
        self.times = [time for _, time in moments]
        self._moments: OrderedDict[int, tuple[Mind, Observation]] = OrderedDict()
        self._lock = Lock()

    def refreshed(self) -> RunView:
        """This run, read again if it has grown."""
        ends = self._run.recording.first_and_last()
        if ends is None or (self.frames and ends[1] == self.frames[-1]):
            return self
        again = RunView(self.folder)
        if "pictures" in self.__dict__:
            again.__dict__["pictures"] = self.pictures
        return again

    @property
    def ended(self) -> bool:
        """Whether the run is over."""
        return "ended" in self._run.facts

    @property
    def verdict(self) -> str | None:
        """What it came to, or None."""
        return None if self._run.verdict is None else self._run.verdict.value

    @property
    def source(self) -> str:
        """What was watched."""
        told = self._run.facts.get("source")
        return told if isinstance(told, str) else ""

    @property
    def seconds(self) -> float:
        """Time of the last moment."""
        return self.times[-1] if self.times else 0.0

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """All events, in order."""
        return tuple(self._run.events)

    @cached_property
    def alerts(self) -> tuple[Alert, ...]:
        """All alerts, as they were last."""
        return tuple(self._run.alerts)

    @cached_property
    def tracks(self) -> tuple[TimelineTrack, ...]:
        """What happened, laid out over time."""
        told = tracks_of(self.events, self.alerts, self.seconds, self.actors)
        states = ((t, _states(told)) for t, told in self._samples())
        return (*told, *behaviour_tracks(states, self.seconds))

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
        """What its objects were compared with; None where that was nothing.

        Raises:
            DatabaseError: They cannot be read.
        """
        named = self.settings.models if self.settings else None
        return ModelDatabase.open(named) if named else None

    @cached_property
    def flows(self) -> Mapping[str, Flow]:
        """Task -> what follows what in it."""
        return flows_of(self.settings)

    @cached_property
    def zones(self) -> tuple[Zone, ...]:
        """Parts of the scene that its rules could name."""
        return zones_of(self.settings)

    @property
    def actors(self) -> Mapping[str, tuple[str, ...]]:
        """Actor -> models."""
        return dict(self.settings.actors) if self.settings else {}

    def at(self, time: float) -> int:
        """Number of the last moment that is not after a time, from 0; the first where all are."""
        return max(0, bisect_right(self.times, time + 1e-6) - 1)

    def of_frame(self, frame: int) -> int:
        """Number of the last moment whose frame is not after one."""
        return max(0, bisect_right(self.frames, frame) - 1)

    def mind(self, number: int) -> Mind:
        """What was believed at a moment.

        Raises:
            OutputError: There is no such moment, or it is damaged.
        """
        return self._moment(number)[0]

    def _moment(self, number: int) -> tuple[Mind, Observation]:
        if not 0 <= number < len(self.frames):
            raise OutputError("nothing has been processed in this run yet", where=str(self.folder))
        with self._lock:
            if number not in self._moments:
                told, seen = self._run.recording.step_at(self.frames[number])
                mind = recorded_mind(told, seen, self.alerts, self.actors)
                self._moments[number] = replace(mind, zones=self.zones), seen
                while len(self._moments) > KEPT_MOMENTS:
                    self._moments.popitem(last=False)
            return self._moments[number]

    def looks(self, number: int, object_id: int) -> tuple[Hypothesis, ...]:
        """The latest matches of an object, best first; empty if there are none."""
        return self.last_look(number, object_id)[1]

    def last_look(self, number: int, object_id: int) -> tuple[int | None, tuple[Hypothesis, ...]]:
        """The last time at which an object was matched, or None, and the result."""
        for at in range(number, max(-1, number - LOOKED_BACK), -1):
            mind, seen = self._moment(at)
            belief = mind.objects.get(object_id)
            region = belief.region.id if belief else None
            found = [h for h in seen.of("hypothesis") if h.region_id == region]
            if found:
                return at, tuple(sorted(found, key=lambda h: -h.similarity))
        return None, ()

    def trails(self, number: int) -> Mapping[int, list[tuple[float, float]]]:
        """Where each object in view was in the seconds before a moment: centres of its boxes, pixels."""
        begin = self.at(self.times[number] - TRAIL_S)
        kept = set(self.frames[number : begin : -(1 + (number - begin) // MOST_TRAIL)])
        found: dict[int, list[tuple[float, float]]] = {}
        for told in self._run.recording.summaries(self.frames[begin], self.frames[number]):
            for line in told["objects"] if told["frame_index"] in kept else ():
                if line["presence"] == "seen" and line["confirmed"]:
                    x, y, w, h = line["bbox"]
                    found.setdefault(line["id"], []).append((x + w / 2, y + h / 2))
        here = {b.id for b in self.mind(number).present()}
        return {i: points for i, points in found.items() if i in here and len(points) > 1}

    def picture(self, number: int, *, plain: bool = False) -> bytes:
        """A moment as JPEG."""
        return self.pictures.drawn(self.mind(number), plain=plain)

    def thumbnail(self) -> bytes:
        """A small picture of the middle of the run, as JPEG."""
        image = annotate(self.pictures.frame(mind := self.mind(len(self.frames) // 2)), mind)
        height = round(image.shape[0] * THUMBNAIL / image.shape[1])
        size = (THUMBNAIL, max(1, height))
        return jpeg(cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8))

    def shares(self, object_id: int) -> Iterator[tuple[float, Mapping[str, float]]]:
        """How sure each identity of an object was over time: time, and name -> share of the votes."""
        for time, told in self._samples():
            for line in told.get("objects", ()):
                if line.get("id") == object_id:
                    yield time, {str(n): float(s) for n, s in line["candidates"]}

    def _samples(self) -> Iterator[tuple[float, Mapping[str, Any]]]:
        """What was believed, in short, at a few hundred moments.

        An approximation, for runs of days: changes that are shorter than that may not show. Moments that
        cannot be read any more are left out.
        """
        step = max(1, len(self.frames) // MOST_SAMPLES)
        for number in range(0, len(self.frames), step):
            try:
                told = self._run.recording.summary_at(self.frames[number])
            except OutputError:
                continue
            yield self.times[number], told


def _states(told: Mapping[str, Any]) -> Mapping[str, str]:
    """Behaviour -> what became of it in a step."""
    found = told.get("behaviours")
    rows = found.items() if isinstance(found, Mapping) else ()
    return {str(name): str(said[0]) for name, said in rows if isinstance(said, list) and said}
