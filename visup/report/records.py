"""What a report is made of: values only, small enough to keep, made by `collector.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from visup.agent import Alert, Event, Severity, TaskBelief, Verdict
from visup.agent.model.records import empty
from visup.agent.storage.wall_clock import WallClock
from visup.tasks.tools.outline import Branch


@dataclass(frozen=True, slots=True)
class Distance:
    """How far apart two objects were at one moment.

    Attributes:
        gap: Pixels between their outlines.
        sigma: Standard deviation of `gap`, or None when unknown.
    """

    gap: float
    sigma: float | None = None


@dataclass(frozen=True, slots=True)
class Sample:
    """A moment of the run; what was not known is absent.

    Attributes:
        time: Seconds.
        votes: Object id -> model name -> votes.
        likelihoods: Object id -> model name -> how likely it is that, 0 to 1.
        distances: (smaller id, larger id) -> distance, for objects in view.
    """

    time: float
    votes: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    distances: Mapping[tuple[int, int], Distance] = field(default_factory=dict)
    likelihoods: Mapping[int, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class StateSpan:
    """A stretch of time during which something stayed as it was.

    Attributes:
        subject: What it is about, such as ('stage', 'dock', 'approach').
        value: How it was, such as 'progressing'.
        start: Seconds.
        end: Seconds.
    """

    subject: tuple[str, ...]
    value: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class MatchRow:
    """One hypothesis of the shape matcher, for the similarity table.

    Attributes:
        name: Model.
        view: Number of the view.
        similarity: 0 to 1.
    """

    name: str
    view: int
    similarity: float


@dataclass(frozen=True, slots=True)
class RegionCloseup:
    """One region at a key frame and what it looks like.

    Attributes:
        region_id: The region.
        object_id: The object it belongs to, or None.
        believed: What the object is believed to be.
        share: Share of the votes for that, 0 to 1.
        jpeg: The region cut out of the frame.
        matches: Most similar first; empty when none was reported.
        matched_at: Seconds; the matcher may have looked a little before.
    """

    region_id: int
    object_id: int | None
    believed: str
    share: float
    jpeg: bytes
    matches: tuple[MatchRow, ...] = ()
    matched_at: float = 0.0


@dataclass(frozen=True, slots=True)
class KeyFrame:
    """An annotated picture of a moment that matters.

    Attributes:
        frame_index: Number of the frame.
        time: Seconds.
        jpeg: The annotated picture.
        size: (width, height) of the picture, pixels.
        captions: Sentences of the events at that frame.
        weight: How much it matters; when there are too many, the lightest go.
        looks: The regions in view.
    """

    frame_index: int
    time: float
    jpeg: bytes
    size: tuple[int, int]
    captions: tuple[str, ...]
    weight: int
    looks: tuple[RegionCloseup, ...] = ()


@dataclass(frozen=True, slots=True)
class ReportedObject:
    """An object that was believed to be in the scene.

    Attributes:
        id: Its number.
        name: What it was last believed to be.
        share: Share of the votes for that, 0 to 1.
        first_seen: Seconds.
        last_seen: Seconds.
    """

    id: int
    name: str
    share: float
    first_seen: float
    last_seen: float


@dataclass(frozen=True, slots=True)
class BehaviourCost:
    """What a behaviour took.

    Attributes:
        behaviour: Its name.
        runs: Steps in which it ran.
        failures: Steps in which it failed.
        mean_ms: Mean wall time of a run, milliseconds.
    """

    behaviour: str
    runs: int
    failures: int
    mean_ms: float


@dataclass(frozen=True, slots=True)
class RunData:
    """A finished run, as far as its report needs it.

    Attributes:
        source: What was watched.
        verdict: How the run ended, or None when nothing was to be judged.
        frame_size: (width, height), pixels; (0, 0) when no frame was seen.
        frames: Frames that were looked at.
        duration: Time of the last frame, seconds.
        tasks: The tasks as they stood at the end.
        events: The narrative, in order.
        events_left_out: Further events that the journal has but the report has not.
        alerts: All alerts as they last stood, by id.
        objects: All objects that were confirmed, by id.
        samples: Moments at an even spacing.
        spans: How stages, relations and presences changed.
        key_frames: In order of time.
        efforts: What each behaviour took.
        clock: When it was by the clock of the wall, as far as that is known: of a camera.
        facts: Further facts about the run, in the order to show them: settings, versions, timing;
            values may be nested mappings and lists.
        problem: Why the source ended early, or None.
        notes: Sentences about what had to be assumed.
        courses: The tree of each task.
        videos: Names of the annotated videos beside the report, in order.
    """

    source: str
    verdict: Verdict | None = None
    frame_size: tuple[int, int] = (0, 0)
    frames: int = 0
    duration: float = 0.0
    tasks: tuple[TaskBelief, ...] = ()
    events: tuple[Event, ...] = ()
    events_left_out: int = 0
    alerts: tuple[Alert, ...] = ()
    objects: tuple[ReportedObject, ...] = ()
    samples: tuple[Sample, ...] = ()
    spans: tuple[StateSpan, ...] = ()
    key_frames: tuple[KeyFrame, ...] = ()
    efforts: tuple[BehaviourCost, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=empty)
    clock: WallClock = field(default_factory=WallClock)
    problem: str | None = None
    notes: tuple[str, ...] = ()
    courses: tuple[Branch, ...] = ()
    videos: tuple[str, ...] = ()

    def spans_about(self, kind: str) -> tuple[StateSpan, ...]:
        """Spans of one kind: 'stage', 'relation' or 'presence'."""
        return tuple(s for s in self.spans if s.subject[0] == kind)

    def worst(self) -> Severity:
        """The gravest severity of its alerts; INFO when there are none."""
        return max((a.severity for a in self.alerts), default=Severity.INFO)
