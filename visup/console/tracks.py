"""A run laid out over time: stages, alerts, objects in view, camera health."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from visup.agent import Alert, Event, Severity, Status

PRESENCE: Mapping[str, str] = MappingProxyType(
    {
        "entry": "seen",
        "noticed": "seen",
        "reappearance": "seen",
        "found": "seen",
        "occlusion": "hidden",
        "lost": "hidden",
        "exit": "left",
    }
)
"""Kind of event -> where its object is from then on, as of `visup.agent.Presence`."""

NOTHING = ("left", "pending")
"""States that need no bar."""

MOST_OBJECTS = 40


@dataclass(frozen=True, slots=True)
class TrackSpan:
    """A span of time on a track.

    Attributes:
        start: Seconds.
        end: Seconds.
        state: What it was: a status, a presence, a severity.
        text: The sentence that told it.
    """

    start: float
    end: float
    state: str
    text: str


@dataclass(frozen=True, slots=True)
class TimelineTrack:
    """A row of the timeline.

    Attributes:
        group: 'stage', 'alert', 'object', 'health' or 'behaviour'.
        label: What it is of.
        spans: By time.
        object_id: The object that it is of, or None.
    """

    group: str
    label: str
    spans: tuple[TrackSpan, ...]
    object_id: int | None = None


def tracks_of(
    events: Iterable[Event],
    alerts: Iterable[Alert],
    seconds: float,
    actors: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> tuple[TimelineTrack, ...]:
    """The rows of a timeline, from the events.

    Args:
        events: Of the run, by time.
        alerts: Of the run.
        seconds: Where the run ends.
        actors: Actor -> models; an object of such a model is called by the actor.

    Returns:
        Stages in the order in which they began, then alerts by kind, objects that stayed longest, health.
    """
    told = tuple(events)
    several = len({e.data.get("task") for e in told if _status(e)}) > 1
    stages = _rows("stage", _stage_changes(told, several=several), seconds)
    objects = _rows("object", _presence_changes(told, actors), seconds)
    health = _rows("health", _health_changes(told), seconds)
    return (*stages, *_alert_rows(alerts, seconds), *_longest(objects), *health)


def behaviour_tracks(
    states: Iterable[tuple[float, Mapping[str, str]]], seconds: float
) -> tuple[TimelineTrack, ...]:
    """Rows of the behaviours that did not always run: when they ran, and when what kept them from it.

    Args:
        states: Seconds, and behaviour -> what became of it then, as of `visup.agent.ReportState`; by time.
        seconds: Where the run ends.
    """
    changes: list[Change] = []
    last: dict[str, str] = {}
    for time, now in states:
        for name, state in now.items():
            if last.get(name) != state:
                changes.append((name.replace("_", " "), None, time, state, ""))
                last[name] = state
    rows = _rows("behaviour", changes, seconds)
    return tuple(row for row in rows if {span.state for span in row.spans} != {"ran"})


Change = tuple[str, int | None, float, str, str]
"""Label, object, seconds, state from then on, and sentence."""


def _stage_changes(events: Sequence[Event], *, several: bool) -> Iterator[Change]:
    for e in events:
        if status := _status(e):
            stage = str(e.data.get("stage", ""))
            label = f"{e.data.get('task')}: {stage}" if several else stage
            yield label, None, e.time, status, e.text


def _status(event: Event) -> str | None:
    """The status in an event of a stage, or None."""
    status = event.data.get("status") if event.kind.startswith("stage_") else None
    return str(status) if status in _STATUSES else None


_STATUSES = frozenset(s.value for s in Status)


def _presence_changes(
    events: Sequence[Event], actors: Mapping[str, Sequence[str]]
) -> Iterator[Change]:
    names = _last_names(events, actors)
    for e in events:
        if e.kind in PRESENCE and e.objects:
            number = e.objects[0]
            yield names.get(number, f"object {number}"), number, e.time, PRESENCE[e.kind], e.text


def _last_names(events: Sequence[Event], actors: Mapping[str, Sequence[str]]) -> dict[int, str]:
    """What each object was last identified as."""
    called = {model: actor for actor, models in sorted(actors.items()) for model in models}
    named = (e for e in events if e.kind in ("identified", "answer") and e.objects)
    last = {e.objects[0]: str(e.data.get("name") or "") for e in named}
    return {number: f"{number} {called.get(name, name)}" for number, name in last.items() if name}


def _health_changes(events: Sequence[Event]) -> Iterator[Change]:
    for e in events:
        if e.kind == "health":
            state = str(e.data.get("status", "unknown"))
            yield "camera", None, e.time, "left" if state == "ok" else state, e.text


def _rows(group: str, changes: Iterable[Change], seconds: float) -> Iterator[TimelineTrack]:
    """One row for each label and object: each state lasts until the next one of the same."""
    rows: dict[tuple[str, int | None], list[TrackSpan]] = {}
    for label, number, time, state, text in changes:
        spans = rows.setdefault((label, number), [])
        if spans and spans[-1].end > time:
            spans[-1] = replace(spans[-1], end=time)
        spans.append(TrackSpan(time, seconds, state, text))
    for (label, number), spans in rows.items():
        kept = tuple(s for s in spans if s.state not in NOTHING)
        if kept:
            yield TimelineTrack(group, label, kept, number)


def _alert_rows(alerts: Iterable[Alert], seconds: float) -> Iterator[TimelineTrack]:
    rows: dict[str, list[TrackSpan]] = {}
    for a in sorted(alerts, key=lambda a: (a.opened, a.id)):
        if a.severity > Severity.INFO:
            end = seconds if a.closed is None else a.closed
            span = TrackSpan(a.opened, max(end, a.opened), a.severity.name.lower(), a.cause)
            rows.setdefault(a.kind, []).append(span)
    for kind, spans in rows.items():
        yield TimelineTrack("alert", kind.replace("_", " "), tuple(spans))


def _longest(rows: Iterable[TimelineTrack]) -> list[TimelineTrack]:
    """The objects that were in view longest, in the order of their first sight."""
    found = list(rows)
    stayed = sorted(found, key=lambda t: -sum(s.end - s.start for s in t.spans))[:MOST_OBJECTS]
    return [track for track in found if track in stayed]
