"""Keeps of a run, while it goes on, what its report will need; `Collector.add` is an observer."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Alert,
    Event,
    Frame,
    Hypothesis,
    Mind,
    ObjectBelief,
    Presence,
    ReportState,
    Verdict,
)
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.report.annotate import annotate
from visup.report.bounded import Heaviest, SpanRecorder, Thinned
from visup.report.records import (
    BehaviourCost,
    Distance,
    KeyFrame,
    MatchRow,
    RegionCloseup,
    ReportedObject,
    RunData,
    Sample,
)
from visup.rules.geometry.outlines import outline_gap
from visup.tasks.tools.outline import Branch
from visup.wording import worded_once

__all__ = ["Collector", "ReportLimits", "RunData"]

PICTURE_WIDTH = 720
LOOK_SIZE = 112
JPEG_QUALITY = 82
BEST_MATCHES = 5
MOST_LOOKS = 4
MOST_SUBJECTS = 8
MOST_PAIRED = 5
MOST_CANDIDATES = 8
MOVES = ("converging", "diverging", "keeping_distance")
KIND_WEIGHTS: Mapping[str, int] = {
    "verdict": 6,
    "stage_failing": 6,
    "stage_done": 5,
    "stage_started": 4,
    "coupled": 5,
    "decoupled": 5,
    "entry": 3,
    "noticed": 3,
    "reappearance": 3,
    "exit": 2,
    "occlusion": 2,
    "identified": 2,
}
ENDS_WEIGHT = 2


@dataclass(frozen=True, slots=True)
class ReportLimits:
    """How much of a run is kept, whatever its length.

    Attributes:
        samples: Moments of the series.
        key_frames: Annotated pictures besides the last one.
        events: Sentences of the narrative.
        spans: Changes of stages, relations and presences.
        alerts: Alerts.
    """

    samples: int = 600
    key_frames: int = 24
    events: int = 2000
    spans: int = 4000
    alerts: int = 500


@dataclass(slots=True)
class _CostTally:
    """What a behaviour took so far."""

    runs: int = 0
    failures: int = 0
    total_ms: float = 0.0


@dataclass(slots=True)
class Collector:
    """Keeps what the report of a run needs. Give its `add` to an agent as an observer.

    Its memory does not grow with the length of the run.

    Attributes:
        limits: How much is kept.
    """

    limits: ReportLimits = field(default_factory=ReportLimits)
    _samples: Thinned[Sample] = field(init=False, repr=False)
    _spans: SpanRecorder = field(init=False, repr=False)
    _pictures: Heaviest[KeyFrame] = field(init=False, repr=False)
    _events: list[Event] = field(default_factory=list, init=False, repr=False)
    _left_out: int = field(default=0, init=False, repr=False)
    _alerts: dict[int, Alert] = field(default_factory=dict, init=False, repr=False)
    _subjects: dict[int, ReportedObject] = field(default_factory=dict, init=False, repr=False)
    _matches: dict[int, tuple[float, tuple[MatchRow, ...]]] = field(
        default_factory=dict, init=False, repr=False
    )
    _tolls: dict[str, _CostTally] = field(default_factory=dict, init=False, repr=False)
    _frames: int = field(default=0, init=False, repr=False)
    _last: tuple[Mind, Frame] | None = field(default=None, init=False, repr=False)
    _last_pictured: int = field(default=-1, init=False, repr=False)

    def __post_init__(self) -> None:
        if min(self.limits.samples, self.limits.key_frames) < 2:
            raise SettingsError("a report keeps at least 2 samples and 2 key frames")
        self._samples = Thinned(self.limits.samples)
        self._spans = SpanRecorder(self.limits.spans)
        self._pictures = Heaviest(self.limits.key_frames, lambda k: k.weight)

    def add(self, step: Step, frame: Frame) -> None:
        """Take note of one step.

        Args:
            step: The step.
            frame: The frame that it was about; only pictures made of it are kept.
        """
        mind = step.mind
        self._frames += 1
        self._last = mind, frame
        self._remember_subjects(mind)
        self._remember_alerts(step.alerts + mind.alerts)
        self._remember_matches(step)
        self._remember_tolls(step)
        events = worded_once(step.events)
        room = max(0, self.limits.events - len(self._events))
        self._events.extend(events[:room])
        self._left_out += max(0, len(events) - room)
        self._spans.note(step.time, state_of(mind))
        self._samples.offer(lambda: sample_of(mind))
        weight = weight_of(step.events) if self._frames > 1 else ENDS_WEIGHT
        if weight and self._pictures.has_room_for(weight):
            self._pictures.add(self._picture(mind, frame, events, weight))
            self._last_pictured = frame.index

    def save(self) -> Mapping[str, Any]:
        """All that was kept so far; see `visup.agent.storage.checkpoint`."""
        names = (f.name for f in fields(self) if f.name not in ("limits", "_pictures"))
        return {n: getattr(self, n) for n in names} | {"pictures": self._pictures.items()}

    def load(self, state: Mapping[str, Any]) -> None:
        """Go on from what a collector with the same limits kept."""
        for name, value in state.items():
            if name != "pictures":
                setattr(self, name, value)
        for picture in state.get("pictures", ()):
            self._pictures.add(picture)

    def finish(
        self,
        verdict: Verdict | None = None,
        facts: Mapping[str, Any] | None = None,
        *,
        problem: str | None = None,
        notes: Sequence[str] = (),
        events: Sequence[Event] = (),
        courses: Sequence[Branch] = (),
    ) -> RunData:
        """All that was kept, at the end of the run.

        Args:
            verdict: How the run ended, or None when nothing was to be judged.
            facts: Facts to show, such as settings, versions, timing; in this order. 'source' is
                what was watched.
            problem: Why the source ended early (`Source.problem`).
            notes: What had to be assumed (`Source.notes`).
            events: Sentences that were told after the last step.
            courses: The trees of the tasks (`visup.tasks.tools.outline`).

        Returns:
            What `write_report` takes.
        """
        mind, frame = self._last or (Mind(), None)
        pictures = self._pictures.items()
        if frame is not None and frame.index != self._last_pictured:
            pictures += (self._picture(mind, frame, (), ENDS_WEIGHT),)
        return RunData(
            source=str((facts or {}).get("source", "the video")),
            verdict=verdict,
            frame_size=mind.frame_size,
            frames=self._frames,
            duration=mind.time,
            tasks=mind.tasks,
            events=(*self._events, *events),
            events_left_out=self._left_out,
            alerts=tuple(a for _, a in sorted(self._alerts.items())),
            objects=tuple(s for _, s in sorted(self._subjects.items())),
            samples=self._samples.items(),
            spans=self._spans.spans(mind.time),
            key_frames=tuple(sorted(pictures, key=lambda k: k.time)),
            efforts=tuple(
                BehaviourCost(name, t.runs, t.failures, t.total_ms / max(1, t.runs))
                for name, t in self._tolls.items()
            ),
            facts=dict(facts or {}),
            problem=problem,
            notes=tuple(notes),
            courses=tuple(courses),
        )

    def _remember_subjects(self, mind: Mind) -> None:
        for b in mind.objects.values():
            if b.confirmed and (b.id in self._subjects or len(self._subjects) < self.limits.spans):
                self._subjects[b.id] = ReportedObject(
                    b.id, b.name, b.strength, b.first_seen, b.last_seen
                )

    def _remember_alerts(self, alerts: Sequence[Alert]) -> None:
        for a in alerts:
            if a.id in self._alerts or len(self._alerts) < self.limits.alerts:
                self._alerts[a.id] = a

    def _remember_matches(self, step: Step) -> None:
        """The latest looks of regions in view; the shape matcher need not run on each frame."""
        seen = {r.id for r in step.observation.of("region")}
        found = matches_of(step.observation.of("hypothesis"))
        self._matches = {k: v for k, v in self._matches.items() if k in seen or k in found}
        self._matches.update({k: (step.time, v) for k, v in found.items()})

    def _remember_tolls(self, step: Step) -> None:
        for r in step.reports:
            toll = self._tolls.setdefault(r.behaviour, _CostTally())
            toll.runs += r.state is ReportState.RAN
            toll.failures += r.state is ReportState.FAILED
            toll.total_ms += r.elapsed_ms if r.state is ReportState.RAN else 0.0

    def _picture(self, mind: Mind, frame: Frame, events: Sequence[Event], weight: int) -> KeyFrame:
        drawn = shrunk(annotate(frame.image, mind), PICTURE_WIDTH)
        return KeyFrame(
            frame_index=frame.index,
            time=mind.time,
            jpeg=jpeg_of(drawn),
            size=(drawn.shape[1], drawn.shape[0]),
            captions=tuple(e.text for e in events),
            weight=weight,
            looks=tuple(self._looks(mind, frame)),
        )

    def _looks(self, mind: Mind, frame: Frame) -> list[RegionCloseup]:
        # A region that was not seen just now is where its object is believed to be: no picture of it.
        seen = [b for b in mind.present() if b.last_seen == mind.time]
        largest = sorted(seen, key=lambda b: -b.region.area)[:MOST_LOOKS]
        looks = []
        for b in sorted(largest, key=lambda b: b.id):
            at, matches = self._matches.get(b.region.id, (mind.time, ()))
            picture = jpeg_of(cut_out(frame.image, b))
            looks.append(RegionCloseup(b.region.id, b.id, b.name, b.strength, picture, matches, at))
        return looks


def weight_of(events: Sequence[Event]) -> int:
    """How much a moment matters for the report; 0 when nothing worth a picture happened."""
    return max((KIND_WEIGHTS.get(e.kind, 0) + 4 * int(e.severity) for e in events), default=0)


def sample_of(mind: Mind) -> Sample:
    """The series' values at one moment: votes of objects in view, distances between them.

    Distances are those of the relation 'distance' where rules report it, else the gap between the
    outlines of objects that are both seen; of the hidden nothing is known.
    """
    objects = sorted(mind.present(), key=lambda b: -b.region.area)[:MOST_SUBJECTS]
    votes = {
        b.id: {c.name: c.votes for c in b.candidates[:MOST_CANDIDATES]}
        for b in objects
        if b.candidates
    }
    pairs = itertools.combinations(sorted(objects[:MOST_PAIRED], key=lambda b: b.id), 2)
    distances = {(a.id, b.id): _distance(mind, a, b) for a, b in pairs}
    return Sample(mind.time, votes, {k: d for k, d in distances.items() if d is not None})


def _distance(mind: Mind, a: ObjectBelief, b: ObjectBelief) -> Distance | None:
    told = mind.relation("distance", a.id, b.id)
    if told is not None and told.value is not None:
        return Distance(told.value, told.sigma)
    if not (a.presence is b.presence is Presence.SEEN):
        return None
    gap = outline_gap(a.region, b.region, math.inf)
    return None if gap is None else Distance(gap)


def state_of(mind: Mind) -> dict[tuple[str, ...], str]:
    """What the timelines follow: stages, how pairs move, who is in view."""
    now: dict[tuple[str, ...], str] = {}
    for task in mind.tasks:
        now |= {("stage", task.task, s.stage): s.status.value for s in task.stages}
    for belief in mind.present():
        now["presence", str(belief.id)] = belief.presence.value
    for relation in mind.holding(*MOVES):
        if len(relation.objects) == 2:
            low, high = sorted(relation.objects)
            now["relation", str(low), str(high)] = relation.name
    for coupling in mind.couplings:
        low, high = coupling.objects
        now["relation", str(low), str(high)] = "coupled"
    return now


def matches_of(hypotheses: Sequence[Hypothesis]) -> dict[int, tuple[MatchRow, ...]]:
    """The most similar views of each region, best first."""
    found: dict[int, list[MatchRow]] = {}
    for h in sorted(hypotheses, key=lambda h: (-h.similarity, h.name, h.view)):
        held = found.setdefault(h.region_id, [])
        if len(held) < BEST_MATCHES:
            held.append(MatchRow(h.name, h.view, h.similarity))
    return {region: tuple(matches) for region, matches in found.items()}


def cut_out(image: NDArray[np.uint8], belief: ObjectBelief) -> NDArray[np.uint8]:
    """An object cut out of a frame with a little of what is round it, which is dimmed.

    Args:
        image: (H, W, 3) uint8 BGR.
        belief: An object that is seen in it.

    Returns:
        (h, w, 3) uint8 BGR, its longer side at most `LOOK_SIZE` pixels.
    """
    x, y, w, h = belief.region.bbox
    margin = max(4, round(0.12 * max(w, h)))
    x0, y0 = max(0, x - margin), max(0, y - margin)
    x1, y1 = min(image.shape[1], x + w + margin), min(image.shape[0], y + h + margin)
    inside = belief.region.full_mask((image.shape[1], image.shape[0]))[y0:y1, x0:x1, None]
    part = image[y0:y1, x0:x1]
    dimmed = np.where(inside, part, part // 4)
    scale = LOOK_SIZE / max(part.shape[:2])
    size = (max(1, round(part.shape[1] * scale)), max(1, round(part.shape[0] * scale)))
    way = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(dimmed, size, interpolation=way), np.uint8)


def shrunk(image: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """The image no wider than `width` pixels, its proportions kept."""
    if image.shape[1] <= width:
        return image
    height = max(1, round(image.shape[0] * width / image.shape[1]))
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def jpeg_of(image: NDArray[np.uint8]) -> bytes:
    """An image as a JPEG file."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return bytes(data)
