"""The timeline of a run: stages, alerts, objects in view, camera health."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from visup.agent import Alert, Event, Severity, Status

PRESENCE_OF_EVENT: Mapping[str, str] = MappingProxyType(
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
"""Kind of event -> presence of its object from then on, as in `visup.agent.Presence`."""

STATES_WITHOUT_BAR = ("left", "pending")
"""States without a bar."""

MAX_OBJECTS = 40


@dataclass(frozen=True, slots=True)
class TrackSpan:
    """A span of time on a track.

    Attributes:
        start: Seconds.
        end: Seconds.
        state: A status, a presence or a severity.
        text: The text of its event.
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
        label: Its name.
        spans: Spans by time.
        object_id: Its object, or None.
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
    """The rows of a timeline.

    Args:
        events: Events of the run, by time.
        alerts: Alerts of the run.
        seconds: End of the run.
        actors: Actor -> models; an object of such a model is labelled with the actor.

    Returns:
        Stages by their beginning, then alerts by kind, the objects longest in view, health.
    """
    ordered = tuple(events)
    several_tasks = len({e.data.get("task") for e in ordered if _status(e)}) > 1
    stages = _rows("stage", _stage_changes(ordered, several_tasks=several_tasks), seconds)
    objects = _rows("object", _presence_changes(ordered, actors), seconds)
    health = _rows("health", _health_changes(ordered), seconds)
    return (*stages, *_alert_rows(alerts, seconds), *_longest(objects), *health)


def behaviour_tracks(
    states: Iterable[tuple[float, Mapping[str, str]]], seconds: float
) -> tuple[TimelineTrack, ...]:
    """Rows of the behaviours that did not always run, with their states.

    Args:
        states: Time, and behaviour -> state, as in `visup.agent.ReportState`; by time.
        seconds: End of the run.
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
"""Label, object, seconds, state from then on, and text."""


def _stage_changes(events: Sequence[Event], *, several_tasks: bool) -> Iterator[Change]:
    for e in events:
        if status := _status(e):
            stage = str(e.data.get("stage", ""))
            label = f"{e.data.get('task')}: {stage}" if several_tasks else stage
            yield label, None, e.time, status, e.text


def _status(event: Event) -> str | None:
    """The status in a stage event, or None."""
    status = event.data.get("status") if event.kind.startswith("stage_") else None
    return str(status) if status in _STATUSES else None


_STATUSES = frozenset(s.value for s in Status)


def _presence_changes(
    events: Sequence[Event], actors: Mapping[str, Sequence[str]]
) -> Iterator[Change]:
    names = _last_names(events, actors)
    for e in events:
        if e.kind in PRESENCE_OF_EVENT and e.objects:
            number = e.objects[0]
            yield (
                names.get(number, f"object {number}"),
                number,
                e.time,
                PRESENCE_OF_EVENT[e.kind],
                e.text,
            )


def _last_names(events: Sequence[Event], actors: Mapping[str, Sequence[str]]) -> dict[int, str]:
    """The last identity of each object."""
    actor_of_model = {model: actor for actor, models in sorted(actors.items()) for model in models}
    identifications = (e for e in events if e.kind in ("identified", "answer") and e.objects)
    last = {e.objects[0]: str(e.data.get("name") or "") for e in identifications}
    return {
        number: f"{number} {actor_of_model.get(name, name)}"
        for number, name in last.items()
        if name
    }


def _health_changes(events: Sequence[Event]) -> Iterator[Change]:
    for e in events:
        if e.kind == "health":
            state = str(e.data.get("status", "unknown"))
            yield "camera", None, e.time, "left" if state == "ok" else state, e.text


def _rows(group: str, changes: Iterable[Change], seconds: float) -> Iterator[TimelineTrack]:
    """One row per label and object: each state lasts until the next."""
    rows: dict[tuple[str, int | None], list[TrackSpan]] = {}
    for label, number, time, state, text in changes:
        spans = rows.setdefault((label, number), [])
        if spans and spans[-1].end > time:
            spans[-1] = replace(spans[-1], end=time)
        spans.append(TrackSpan(time, seconds, state, text))
    for (label, number), spans in rows.items():
        shown = tuple(s for s in spans if s.state not in STATES_WITHOUT_BAR)
        if shown:
            yield TimelineTrack(group, label, shown, number)


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
    """The objects longest in view, in the order of their first appearance."""
    found = list(rows)
    longest = sorted(found, key=lambda t: -sum(s.end - s.start for s in t.spans))[:MAX_OBJECTS]
    return [track for track in found if track in longest]
