"""Rows of the timeline and their spans."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Alert, Event, Severity, Status
from visup.agent.model.records import ReportState
from visup.console.drawing.timeline_svg import timeline_svg
from visup.console.tracks import PRESENCE_OF_EVENT, TimelineTrack, behaviour_tracks, tracks_of

TIMES = st.floats(0.0, 50.0)
STAGES = st.builds(
    lambda time, stage, status: Event(
        "stage_x",
        time,
        0,
        f"{stage} {status}",
        data={"task": "t", "stage": stage, "status": status},
    ),
    TIMES,
    st.sampled_from(["reach", "grasp"]),
    st.sampled_from([s.value for s in Status]),
)
PRESENCES = st.builds(
    lambda kind, time, number: Event(kind, time, 0, f"Object {number} <b>", objects=(number,)),
    st.sampled_from(sorted(PRESENCE_OF_EVENT)),
    TIMES,
    st.integers(1, 4),
)
EVENTS = st.lists(st.one_of(STAGES, PRESENCES), max_size=30).map(
    lambda events: sorted(events, key=lambda e: e.time)
)
ALERTS = st.lists(
    st.builds(
        lambda number, opened, lasts: Alert(
            number,
            "collision_course",
            Severity.WARNING,
            opened,
            opened,
            (1, 2),
            "They come near & near.",
            closed=None if lasts is None else opened + lasts,
        ),
        st.integers(1, 99),
        TIMES,
        st.none() | st.floats(0.0, 5.0),
    ),
    max_size=6,
)


def do_not_overlap(track: TimelineTrack) -> bool:
    pairs = zip(track.spans, track.spans[1:], strict=False)
    return all(a.end <= b.start + 1e-9 for a, b in pairs)


@given(EVENTS, ALERTS)
def test_spans_are_within_the_run_and_states_do_not_overlap(
    events: list[Event], alerts: list[Alert]
) -> None:
    rows = tracks_of(events, alerts, 60.0)
    for track in rows:
        assert all(0.0 <= s.start <= s.end <= 60.0 for s in track.spans)
        assert track.group == "alert" or do_not_overlap(track)
    assert len({(t.group, t.label, t.object_id) for t in rows}) == len(rows)


@given(EVENTS)
def test_a_row_has_the_state_of_the_last_event(events: list[Event]) -> None:
    rows = {t.label: t for t in tracks_of(events, (), 60.0) if t.group == "stage"}
    for label, track in rows.items():
        reported = [e for e in events if e.data.get("stage") == label]
        for moment in (0.0, 13.3, 27.7, 55.0):
            before = [e for e in reported if e.time <= moment]
            state = before[-1].data["status"] if before else "pending"
            states = [s.state for s in track.spans if s.start <= moment < s.end]
            assert (states or ["pending"])[-1] == state


@given(EVENTS, ALERTS)
def test_the_timeline_is_valid_svg_with_all_spans(events: list[Event], alerts: list[Alert]) -> None:
    rows = tracks_of(events, alerts, 60.0)
    drawing = ET.fromstring(timeline_svg(rows, 60.0))
    bars = [r for r in drawing.iter() if r.tag == "rect" and r.get("class") != "row"]
    assert len(bars) == sum(len(t.spans) for t in rows)
    assert not re.search("<b>", timeline_svg(rows, 60.0))


def test_objects_are_labelled_with_their_actors() -> None:
    events = [
        Event("entry", 1.0, 10, "Object 1 is in view.", objects=(1,)),
        Event("identified", 2.0, 20, "Object 1 is the arm.", objects=(1,), data={"name": "rms"}),
    ]
    (row,) = tracks_of(events, (), 5.0, {"arm": ("rms",)})
    assert (row.label, row.object_id) == ("1 arm", 1)


STATES = st.lists(
    st.dictionaries(
        st.sampled_from(["motion", "shape", "closer_look"]),
        st.sampled_from([s.value for s in ReportState]),
        max_size=3,
    ),
    max_size=12,
)


@given(STATES)
def test_a_behaviour_that_paused_has_a_row_with_its_states(
    states: list[dict[str, str]],
) -> None:
    seconds = float(len(states))
    rows = behaviour_tracks([(float(k), now) for k, now in enumerate(states)], seconds)
    reported = {row.label: row.spans for row in rows}
    for name in ("motion", "shape", "closer_look"):
        moments = [(float(k), now[name]) for k, now in enumerate(states) if name in now]
        spans = reported.get(name.replace("_", " "), ())
        assert bool(spans) == any(state != "ran" for _, state in moments)
        for time, state in moments if spans else ():
            assert [s.state for s in spans if s.start <= time < s.end] == [state]
    ET.fromstring(timeline_svg(rows, seconds))


@given(EVENTS, st.floats(0.0, 1e5))
def test_the_time_axis_starts_with_the_run(events: list[Event], start: float) -> None:
    """The drawing does not depend on the start time."""
    rows = [t for t in tracks_of(events, (), 60.0) if t.spans]
    later = [
        replace(
            t,
            spans=tuple(replace(s, start=s.start + start, end=s.end + start) for s in t.spans),
        )
        for t in rows
    ]
    positions = _bar_positions(timeline_svg(later, 60.0 + start, start))
    assert positions == pytest.approx(_bar_positions(timeline_svg(rows, 60.0)), abs=0.02)


def _bar_positions(drawing: str) -> list[float]:
    bars = [b for b in ET.fromstring(drawing).iter() if b.tag == "rect"]
    return [float(b.get(key) or 0.0) for b in bars for key in ("x", "width")]
