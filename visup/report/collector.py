"""Collects data for the report during a run; `Collector.add` is an observer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from visup.agent import (
    Alert,
    Event,
    Frame,
    Mind,
    ReportState,
    Verdict,
)
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.narrative import Narrative
from visup.report.annotate import annotate
from visup.report.bounded_buffers import EvenSample, SpanRecorder, TopWeighted
from visup.report.crops import jpeg_of, object_crop, shrunk
from visup.report.moments import matches_of, sample_of, state_of, weight_of
from visup.report.records import (
    BehaviourCost,
    KeyFrame,
    MatchRow,
    RegionCloseup,
    ReportedObject,
    RunData,
    Sample,
)
from visup.rules.wording.sentences import role_or_model
from visup.tasks.tools.outline import Branch
from visup.wording import worded_once

__all__ = ["Collector", "ReportLimits", "RunData"]

MAX_PICTURE_WIDTH = 720
MAX_CLOSEUPS = 4
LAST_FRAME_WEIGHT = 2


@dataclass(frozen=True, slots=True)
class ReportLimits:
    """Limits of the data kept of a run of any length.

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
class _BehaviourTotals:
    """The accumulated cost of a behaviour."""

    runs: int = 0
    failures: int = 0
    total_ms: float = 0.0


@dataclass(slots=True)
class Collector:
    """Collects the data for the report of a run. Add its `add` to an agent as an observer.

    Its memory is bounded.

    Attributes:
        limits: The limits of the data.
    """

    limits: ReportLimits = field(default_factory=ReportLimits)
    _samples: EvenSample[Sample] = field(init=False, repr=False)
    _spans: SpanRecorder = field(init=False, repr=False)
    _pictures: TopWeighted[KeyFrame] = field(init=False, repr=False)
    _events: list[Event] = field(default_factory=list, init=False, repr=False)
    _narrative: Narrative = field(default_factory=Narrative, init=False, repr=False)
    _events_left_out: int = field(default=0, init=False, repr=False)
    _alerts: dict[int, Alert] = field(default_factory=dict, init=False, repr=False)
    _objects: dict[int, ReportedObject] = field(default_factory=dict, init=False, repr=False)
    _matches: dict[int, tuple[float, tuple[MatchRow, ...]]] = field(
        default_factory=dict, init=False, repr=False
    )
    _costs: dict[str, _BehaviourTotals] = field(default_factory=dict, init=False, repr=False)
    _frames: int = field(default=0, init=False, repr=False)
    _last: tuple[Mind, Frame] | None = field(default=None, init=False, repr=False)
    _last_picture_index: int = field(default=-1, init=False, repr=False)

    def __post_init__(self) -> None:
        if min(self.limits.samples, self.limits.key_frames) < 2:
            raise SettingsError("a report keeps at least 2 samples and 2 key frames")
        self._samples = EvenSample(self.limits.samples)
        self._spans = SpanRecorder(self.limits.spans)
        self._pictures = TopWeighted(self.limits.key_frames, lambda k: k.weight)

    def add(self, step: Step, frame: Frame) -> None:
        """Add one step.

        Args:
            step: The step.
            frame: Its frame; only pictures made of it are kept.
        """
        mind = step.mind
        self._frames += 1
        self._last = mind, frame
        self._record_objects(mind)
        self._record_alerts(step.alerts + mind.alerts)
        self._record_matches(step)
        self._add_costs(step)
        lines, events = self._narrative.lines(step, frame), worded_once(step.events)
        room = max(0, self.limits.events - len(self._events))
        self._events.extend(lines[:room])
        self._events_left_out += max(0, len(lines) - room)
        self._spans.record(step.time, state_of(mind))
        self._samples.offer(lambda: sample_of(mind))
        weight = weight_of(step.events) if self._frames > 1 else LAST_FRAME_WEIGHT
        if weight and self._pictures.would_keep(weight):
            self._pictures.add(self._picture(mind, frame, events, weight))
            self._last_picture_index = frame.index

    def save(self) -> Mapping[str, Any]:
        """The state of the collector; see `visup.agent.storage.checkpoint`."""
        names = (f.name for f in fields(self) if f.name not in ("limits", "_pictures"))
        return {n: getattr(self, n) for n in names} | {"pictures": self._pictures.items()}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a collector with the same limits."""
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
        task_trees: Sequence[Branch] = (),
    ) -> RunData:
        """The collected data at the end of the run.

        Args:
            verdict: The verdict, or None without a task.
            facts: Facts to show in this order, such as settings, versions, timing; 'source' is the source.
            problem: Why the source ended early (`Source.problem`).
            notes: Assumptions made (`Source.notes`).
            events: Events after the last step.
            task_trees: The trees of the tasks (`visup.tasks.tools.outline`).

        Returns:
            The input of `write_report`.
        """
        mind, frame = self._last or (Mind(), None)
        pictures = self._pictures.items()
        remaining = self._narrative.rest(mind.time, mind.frame_index)
        if frame is not None and frame.index != self._last_picture_index:
            pictures += (self._picture(mind, frame, (), LAST_FRAME_WEIGHT),)
        return RunData(
            source=str((facts or {}).get("source", "the video")),
            verdict=verdict,
            frame_size=mind.frame_size,
            frames=self._frames,
            duration=mind.time,
            tasks=mind.tasks,
            events=(*self._events, *remaining, *events),
            events_left_out=self._events_left_out,
            alerts=tuple(a for _, a in sorted(self._alerts.items())),
            objects=tuple(s for _, s in sorted(self._objects.items())),
            samples=self._samples.items(),
            spans=self._spans.spans(mind.time),
            key_frames=tuple(sorted(pictures, key=lambda k: k.time)),
            behaviour_costs=tuple(
                BehaviourCost(name, t.runs, t.failures, t.total_ms / max(1, t.runs))
                for name, t in self._costs.items()
            ),
            facts=dict(facts or {}),
            problem=problem,
            notes=tuple(notes),
            task_trees=tuple(task_trees),
        )

    def _record_objects(self, mind: Mind) -> None:
        for b in mind.objects.values():
            if b.confirmed and (b.id in self._objects or len(self._objects) < self.limits.spans):
                self._objects[b.id] = ReportedObject(
                    b.id, role_or_model(mind, b.name), b.strength, b.first_seen, b.last_seen
                )

    def _record_alerts(self, alerts: Sequence[Alert]) -> None:
        for a in alerts:
            if a.id in self._alerts or len(self._alerts) < self.limits.alerts:
                self._alerts[a.id] = a

    def _record_matches(self, step: Step) -> None:
        """The latest matches of visible regions; the shape matcher may not run on each frame."""
        visible = {r.id for r in step.observation.of("region")}
        found = matches_of(step.observation.of("hypothesis"))
        self._matches = {k: v for k, v in self._matches.items() if k in visible or k in found}
        self._matches.update({k: (step.time, v) for k, v in found.items()})

    def _add_costs(self, step: Step) -> None:
        for r in step.reports:
            totals = self._costs.setdefault(r.behaviour, _BehaviourTotals())
            totals.runs += r.state is ReportState.RAN
            totals.failures += r.state is ReportState.FAILED
            totals.total_ms += r.elapsed_ms if r.state is ReportState.RAN else 0.0

    def _picture(self, mind: Mind, frame: Frame, events: Sequence[Event], weight: int) -> KeyFrame:
        drawn = shrunk(annotate(frame.image, mind), MAX_PICTURE_WIDTH)
        return KeyFrame(
            frame_index=frame.index,
            time=mind.time,
            jpeg=jpeg_of(drawn),
            size=(drawn.shape[1], drawn.shape[0]),
            captions=tuple(e.text for e in events),
            weight=weight,
            closeups=tuple(self._closeups(mind, frame)),
        )

    def _closeups(self, mind: Mind, frame: Frame) -> list[RegionCloseup]:
        # The region of an object not seen now is only a prediction: no picture of it.
        visible = [b for b in mind.present() if b.last_seen == mind.time]
        largest = sorted(visible, key=lambda b: -b.region.area)[:MAX_CLOSEUPS]
        closeups = []
        for b in sorted(largest, key=lambda b: b.id):
            matched_at, matches = self._matches.get(b.region.id, (mind.time, ()))
            picture = jpeg_of(object_crop(frame.image, b))
            closeups.append(
                RegionCloseup(b.region.id, b.id, b.name, b.strength, picture, matches, matched_at)
            )
        return closeups
