"""The data of a report: plain records, created by `collector.py`."""

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
    """The distance of two objects at one moment.

    Attributes:
        gap: Pixels between their outlines.
        sigma: Standard deviation of `gap`, or None when unknown.
    """

    gap: float
    sigma: float | None = None


@dataclass(frozen=True, slots=True)
class Sample:
    """A moment of the run; unknown values are absent.

    Attributes:
        time: Seconds.
        votes: Object id -> model name -> votes.
        likelihoods: Object id -> model name -> probability, 0 to 1.
        distances: (smaller id, larger id) -> distance, for objects in view.
    """

    time: float
    votes: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    distances: Mapping[tuple[int, int], Distance] = field(default_factory=dict)
    likelihoods: Mapping[int, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class StateSpan:
    """A time span in which a subject had one value.

    Attributes:
        subject: Such as ('stage', 'dock', 'approach').
        value: Such as 'progressing'.
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
    """One region at a key frame and its matches.

    Attributes:
        region_id: The region.
        object_id: Its object, or None.
        believed: Identity of the object.
        share: Share of the votes for it, 0 to 1.
        jpeg: Crop of the region.
        matches: Most similar first; may be empty.
        matched_at: Time of the match, seconds, which may be a little earlier.
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
    """An annotated picture of an important moment.

    Attributes:
        frame_index: Number of the frame.
        time: Seconds.
        jpeg: The annotated picture.
        size: (width, height) of the picture, pixels.
        captions: Sentences of the events at that frame.
        weight: Its importance; if there are too many key frames, the lightest are dropped.
        closeups: The visible regions.
    """

    frame_index: int
    time: float
    jpeg: bytes
    size: tuple[int, int]
    captions: tuple[str, ...]
    weight: int
    closeups: tuple[RegionCloseup, ...] = ()


@dataclass(frozen=True, slots=True)
class ReportedObject:
    """An object that was believed to be in the scene.

    Attributes:
        id: Its number.
        name: Its last identity.
        share: Share of the votes for it, 0 to 1.
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
    """The cost of a behaviour.

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
    """The data of a finished run for its report.

    Attributes:
        source: The source.
        verdict: The verdict, or None without a task.
        frame_size: (width, height), pixels; (0, 0) without frames.
        frames: Number of processed frames.
        duration: Time of the last frame, seconds.
        tasks: The final beliefs about tasks.
        events: The narrative, in order.
        events_left_out: Number of further events in the journal.
        alerts: All alerts in their last state, by id.
        objects: All objects that were confirmed, by id.
        samples: Evenly spaced samples.
        spans: Spans of stages, relations and presences.
        key_frames: Key frames by time.
        behaviour_costs: Cost of each behaviour.
        clock: Wall clock of the run, if known.
        facts: Further facts about the run, in the order to show them: settings, versions, timing;
            values may be nested mappings and lists.
        problem: Why the source ended early, or None.
        notes: Sentences about assumptions.
        task_trees: The tree of each task.
        videos: Names of the annotated videos next to the report, in order.
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
    behaviour_costs: tuple[BehaviourCost, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=empty)
    clock: WallClock = field(default_factory=WallClock)
    problem: str | None = None
    notes: tuple[str, ...] = ()
    task_trees: tuple[Branch, ...] = ()
    videos: tuple[str, ...] = ()

    def spans_about(self, kind: str) -> tuple[StateSpan, ...]:
        """Spans of one kind: 'stage', 'relation' or 'presence'."""
        return tuple(s for s in self.spans if s.subject[0] == kind)

    def worst(self) -> Severity:
        """The highest severity of its alerts; INFO if there are none."""
        return max((a.severity for a in self.alerts), default=Severity.INFO)
