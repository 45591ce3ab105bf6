"""Which events get a line: tasks and alerts, named objects sparingly, one line per visit of others.

Others are unidentified objects, and those of which only the class is known.

All events are recorded in any case; this is what people read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from visup.agent import Event, Frame, Mind, Severity
from visup.agent.model.step import Step
from visup.narrative.rate_limit import LineRateLimit
from visup.narrative.visit_sentences import ongoing_visit_sentence, path_clause, visits_sentence
from visup.narrative.visits import ObjectVisit, VisitLog
from visup.rules.wording.sentences import individual_name
from visup.wording import EVENT_KINDS, worded_once

MIN_DURATION_S = 0.8
"""Visits shorter than this are only counted in the summary, seconds."""

MIN_AREA_SHARE = 0.0002
"""So are objects that never cover more than this share of the picture."""

LONG_VISIT_S = 10.0
"""Objects in view for this long are reported before they leave, seconds."""

MAX_WAIT_S = 15.0
"""A visit that has waited longer than this for a line is only counted in the summary, seconds."""

MIN_REPEAT_S, MIN_PAIR_REPEAT_S = 3.0, 10.0
"""Minimum time between two events of one kind about the same object, and about the same pair, seconds."""

OBJECT_EVENTS = frozenset(
    {
        *("entry", "noticed", "exit", "occlusion", "reappearance", "lost", "found"),
        *("coupled", "decoupled", "relation", "identified", "alert", "alert_closed"),
    }
)
"""Kinds of events that are reported only for named objects, and sparingly; all others are always reported."""


class Detail(StrEnum):
    """Level of detail."""

    USUAL = "usual"
    ALL = "all"


@dataclass(slots=True)
class Narrative:
    """Chooses what to report. Pass it each step; it returns the lines to show.

    Events of tasks and alerts are always reported. So are those of actors, without repetitions;
    other named objects share a rate limit with the visits of all others.

    Attributes:
        detail: `ALL` reports every event, and no visits.
        log: The visits of all objects.
        limiter: Rate limit of lines that are neither alerts nor about a task.
        withheld: Number of events that were not reported.
        paths: Path, as a clause -> ids of the objects that took it.
    """

    detail: Detail = Detail.USUAL
    log: VisitLog = field(default_factory=VisitLog)
    limiter: LineRateLimit = field(default_factory=LineRateLimit)
    withheld: int = 0
    paths: dict[str, set[int]] = field(default_factory=dict)
    _pending: list[ObjectVisit] = field(default_factory=list)
    _reported_ongoing: set[int] = field(default_factory=set)
    _last_reported: dict[tuple[object, ...], float] = field(default_factory=dict)
    _alerts: set[object] = field(default_factory=set)
    _visit_lines: int = 0

    def lines(self, step: Step, frame: Frame | None) -> list[Event]:
        """The lines of one step.

        Args:
            step: The step.
            frame: Its frame, for colours, or None.
        """
        self.limiter.begin(step.time)
        ended = self.log.add(step, frame)
        if self.detail is Detail.ALL:
            return worded_once(step.events)
        notable = [e for e in worded_once(step.events) if self._is_notable(e, step.mind)]
        self.withheld += len(step.events) - len(notable)
        self._pending += self._count_visits(ended)
        return [*notable, *self._visit_events(step)]

    def rest(self, time: float, frame_index: int) -> list[Event]:
        """The remaining lines at the end of the run: pending visits, and those that have not ended.

        Args:
            time: Time of the last step, seconds.
            frame_index: Number of its frame.
        """
        open_visits = self._count_visits(self.log.finish())
        visits = [*self._pending, *(x for x in open_visits if x.id not in self._reported_ongoing)]
        self._pending = []
        if self.detail is Detail.ALL:
            return []
        groups = sorted(_grouped_by_path(visits), key=len, reverse=True)
        reported = [g for g in groups if self.limiter.allow(time)]
        if not self._visit_lines:
            reported = reported or groups[:1]  # even a short run gets one line
        return [_event(visits_sentence(g), g, time, frame_index) for g in reported]

    def _count_visits(self, visits: Sequence[ObjectVisit]) -> list[ObjectVisit]:
        """The visits that are not too short or small; their paths are counted, whether reported or not."""
        counted = [x for x in visits if _is_counted(x)]
        for visit in counted:
            self.paths.setdefault(path_clause(visit, "were"), set()).add(visit.id)
        return counted

    def _is_notable(self, event: Event, mind: Mind) -> bool:
        if event.kind not in OBJECT_EVENTS and event.kind in EVENT_KINDS:
            return True
        if event.kind not in EVENT_KINDS:
            return True  # a plug-in's own
        if event.severity > Severity.INFO:
            self._alerts.add(event.data.get("alert"))
            return True
        if event.kind == "alert_closed":
            return event.data.get("alert") in self._alerts
        if not event.objects or any(individual_name(mind, i) is None for i in event.objects):
            return False
        if not self._not_repeated(event):
            return False
        return set(event.objects) <= _actors(mind) or self.limiter.allow(event.time)

    def _not_repeated(self, event: Event) -> bool:
        key = event.kind, *sorted(event.objects)
        last, interval = (
            self._last_reported.get(key),
            MIN_PAIR_REPEAT_S if len(event.objects) > 1 else MIN_REPEAT_S,
        )
        if last is not None and event.time - last < interval:
            return False
        self._last_reported = {
            k: t for k, t in self._last_reported.items() if event.time - t < MIN_PAIR_REPEAT_S
        }
        self._last_reported[key] = event.time
        return True

    def _visit_events(self, step: Step) -> Iterator[Event]:
        """As many lines on visits as the rate limit allows, beginning with the most frequent path."""
        self._pending = [x for x in self._pending if step.time - x.until < MAX_WAIT_S]
        while self._pending and self.limiter.allow(step.time):
            group = max(
                _grouped_by_path(self._pending), key=lambda g: (len(g), max(x.area for x in g))
            )
            self._pending = [x for x in self._pending if x not in group]
            self._visit_lines += 1
            yield _event(visits_sentence(group), group, step.time, step.frame_index)
        for visit in self.log.open_visits.values():
            long = (
                step.time - visit.since >= LONG_VISIT_S
                and visit.name is None
                and _is_counted(visit)
            )
            if long and visit.id not in self._reported_ongoing and self.limiter.allow(step.time):
                self._reported_ongoing.add(visit.id)
                self._visit_lines += 1
                yield _event(ongoing_visit_sentence(visit), [visit], step.time, step.frame_index)


def _actors(mind: Mind) -> set[int | None]:
    """The objects that play a part in a task."""
    return {b.object_id for task in mind.tasks for b in task.bindings}


def _is_counted(visit: ObjectVisit) -> bool:
    large = visit.area >= MIN_AREA_SHARE * visit.size[0] * visit.size[1]
    return large and visit.seconds >= MIN_DURATION_S and visit.name is None


def _grouped_by_path(visits: Sequence[ObjectVisit]) -> list[list[ObjectVisit]]:
    groups: dict[str, list[ObjectVisit]] = {}
    for visit in visits:
        groups.setdefault(path_clause(visit), []).append(visit)
    return list(groups.values())


def _event(text: str, visits: Sequence[ObjectVisit], time: float, frame_index: int) -> Event:
    return Event("life", time, frame_index, text, tuple(x.id for x in visits))
