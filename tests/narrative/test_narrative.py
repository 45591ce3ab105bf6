"""The narrative of a run: one line per visit, few per minute, no warning withheld."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.agent import Event, Frame, Mind, ObjectBelief, Observation, Presence, Severity
from visup.agent.model.object_beliefs import Candidate
from visup.agent.model.step import Step
from visup.narrative import Detail, Narrative, summary_lines
from visup.narrative.places import Box
from visup.narrative.rate_limit import LineRateLimit
from visup.narrative.visit_sentences import path_clause, visits_sentence
from visup.narrative.visits import ObjectVisit, VisitLog
from visup.testing import region_of
from visup.wording import worded_once

SIZE = (320, 240)
FPS = 10
BLUE, RED = (200, 40, 20), (20, 20, 200)


def belief(number: int, x: float, y: float, now: float, **changes: object) -> ObjectBelief:
    """An object of 20 x 20 pixels with its upper left corner at (x, y), cut by the border where it is."""
    left, top = max(0, round(x)), max(0, round(y))
    right, bottom = min(SIZE[0], round(x) + 20), min(SIZE[1], round(y) + 20)
    full = np.ones((max(1, bottom - top), max(1, right - left)), dtype=bool)
    region = region_of(full, number, at=(min(left, SIZE[0] - 1), min(top, SIZE[1] - 1)), size=SIZE)
    made = ObjectBelief(number, region, Presence.SEEN, now, now, confirmed=True)
    return replace(made, **changes)  # type: ignore[arg-type]  # fields as the test names them


def grown(small: ObjectBelief, side: int) -> ObjectBelief:
    """The same object, larger."""
    full = np.ones((side, side), dtype=bool)
    return replace(small, region=region_of(full, small.id, at=(30, 30), size=SIZE))


def painted(now: float, colour: tuple[int, int, int]) -> Frame:
    """A frame of one colour."""
    image = np.full((*SIZE[::-1], 3), colour, np.uint8)
    return Frame(round(now * FPS), now, image)


def step(now: float, *objects: ObjectBelief, events: Sequence[Event] = ()) -> Step:
    index = round(now * FPS)
    mind = Mind(time=now, frame_index=index, frame_size=SIZE).with_objects(*objects)
    return Step(index, now, Observation(index, now, SIZE), mind, tuple(events))


def crossing(number: int, since: float, until: float, now: float, y: float = 100.0) -> ObjectBelief:
    """An object that goes from the left border to the right one."""
    x = -19 + (SIZE[0] + 18) * (min(now, until) - since) / (until - since)
    seen = replace(belief(number, x, y, min(now, until)), first_seen=since)
    return seen if now <= until else replace(seen, presence=Presence.LEFT)


def times(seconds: float) -> list[float]:
    return [n / FPS for n in range(round(seconds * FPS) + 1)]


def narrated(steps: Sequence[Step], detail: Detail = Detail.USUAL) -> list[Event]:
    narrative = Narrative(detail)
    lines = [e for s in steps for e in narrative.lines(s, None)]
    return [*lines, *narrative.rest(steps[-1].time, 0)]


def event(kind: str, now: float, *ids: int, severity: Severity = Severity.INFO) -> Event:
    return Event(kind, now, round(now * FPS), f"{kind} {ids} {now}.", ids, severity=severity)


def test_a_visit_is_one_line_with_object_path_duration_and_closest_object() -> None:
    stays = [belief(1, 230.0, 130.0, t, first_seen=0.0) for t in times(12)]
    steps = [
        step(t, stay, *([crossing(4, 3.0, 6.0, t)] if t >= 3 else []))
        for t, stay in zip(times(12), stays, strict=True)
    ]
    lines = [e.text for e in narrated(steps)]
    assert lines[0] == "Object 4 crossed from left to right, 3.0 s, closest to object 1 at 10 px."
    assert lines[1].startswith("Object 1 has been in view since 0.0 s, now on the right")
    assert len(lines) == 2  # that it is still in view is not reported twice


def test_the_visit_of_an_object_confirmed_late_begins_where_it_was_first_seen() -> None:
    """It is confirmed only near the right side, which would otherwise count as its entry."""
    steps = [
        step(t, *([replace(crossing(13, 1.0, 4.0, t), confirmed=t > 3.7)] if t >= 1 else []))
        for t in times(9)
    ]
    assert [e.text for e in narrated(steps)] == ["Object 13 crossed from left to right, 3.0 s."]


def test_an_object_that_is_never_confirmed_is_not_reported() -> None:
    steps = [
        step(t, *([replace(crossing(3, 1.0, 4.0, t), confirmed=False)] if t >= 1 else []))
        for t in times(9)
    ]
    assert narrated(steps) == []


@pytest.mark.parametrize(
    ("first", "last", "left", "words"),
    [
        ((60, 100, 20, 20), (300, 100, 20, 20), True, "crossed from left to right"),
        ((0, 100, 20, 20), (150, 0, 20, 20), True, "came in from the left and went out at the top"),
        ((150, 100, 20, 20), (150, 0, 20, 20), True, "went from the middle out at the top"),
        (
            (0, 100, 20, 20),
            (0, 120, 20, 20),
            True,
            "came in from the left and went out there again",
        ),
        (
            (0, 100, 20, 20),
            (0, 120, 20, 20),
            False,
            "came in from the left and was last seen there",
        ),
    ],
)
def test_a_path_is_described_by_its_sides(first: Box, last: Box, left: bool, words: str) -> None:
    assert path_clause(ObjectVisit(1, SIZE, 1.0, 4.0, first, last, left=left)) == words


def test_a_visit_until_the_end_of_the_run_is_reported_as_such() -> None:
    steps = [step(t, *([crossing(2, 2.0, 15.0, t)] if t >= 2 else [])) for t in times(8)]
    assert [e.text for e in narrated(steps)] == [
        "Object 2 came in from the left and was still in view in the middle at the end, 6.0 s."
    ]


@pytest.mark.parametrize(("seconds", "most"), [(2.0, 1), (12.4, 2), (28.4, 4), (60.0, 9)])
def test_a_short_clip_has_no_more_lines_a_minute_than_a_long_one(seconds: float, most: int) -> None:
    """Every second an object crosses, in turns on two lanes: some lines, at most ten for each minute."""
    steps = []
    for t in times(seconds):
        alive = [
            replace(crossing(n + 1, n, n + 0.9, t, 200.0 * (n % 2)), confirmed=n <= t)
            for n in range(round(t) + 1)
            if n <= t
        ]
        steps.append(step(t, *alive))
    assert 1 <= len(narrated(steps)) <= most


def test_the_summary_also_counts_visits_without_a_line() -> None:
    steps = [
        step(t, *(crossing(n, n, n + 1.0, t) for n in range(1, 6) if n <= t)) for t in times(8)
    ]
    narrative = Narrative()
    lines = [e.text for s in steps for e in narrative.lines(s, None)]
    assert not any("5" in text for text in lines)
    assert next(iter(summary_lines(narrative.log, narrative.paths))) == (
        "Seen: 5 objects, at most 2 at a time; 5 crossed from left to right."
    )


def test_visits_along_the_same_path_share_a_line() -> None:
    lanes = {4: 0.0, 5: 60.0, 6: 120.0, 7: 180.0, 8: 210.0, 9: 30.0}
    steps = [
        step(t, *(crossing(i, 3.0, 6.0, t, y) for i, y in lanes.items() if t >= 3.0))
        for t in times(9)
    ]
    assert [e.text for e in narrated(steps)] == [
        "Objects 4, 5, 6, 7 and 2 more crossed from left to right, 3.0 s."
    ]


def test_an_object_with_two_visits_is_named_once() -> None:
    one = ObjectVisit(17, SIZE, 1.0, 2.0, (0, 0, 9, 9), (50, 0, 9, 9))
    lives = [one, replace(one, since=4.0, until=7.0), replace(one, id=18)]
    assert visits_sentence(lives) == (
        "Objects 17 and 18 came in from the left and were last seen there, 1.0 to 3.0 s each."
    )
    assert visits_sentence(lives[:2]) == (
        "Object 17 came in from the left and was last seen there, 3.0 s."
    )


@pytest.mark.parametrize(
    ("later", "colours"),
    [(BLUE, ["blue", "blue"]), (RED, ["blue", None]), (None, ["blue", "blue"])],
)
def test_an_object_that_returns_is_not_reported_with_another_colour(
    later: tuple[int, int, int] | None, colours: list[str | None]
) -> None:
    """An id may pass from one thing to another; no object is blue in one line and red in the next."""
    log, lives = VisitLog(), list[ObjectVisit]()
    for t in times(14):
        side, colour = (20, BLUE) if t < 7 else (60, later)
        where = belief(3, 30, 30, t) if side == 20 else grown(belief(3, 30, 30, t), side)
        away = replace(where, last_seen=0.0, presence=Presence.LEFT)
        seen = where if t < 2 or t > 12 else away
        log_frame = None if colour is None else painted(t, colour)
        lives += log.add(step(t, seen), log_frame)
    lives += log.finish()
    assert [visit.colour for visit in lives] == colours


def test_tiny_objects_and_short_visits_are_only_counted() -> None:
    steps = [step(t, *([crossing(2, 1.0, 1.4, t)] if t >= 1.0 else [])) for t in times(5)]
    narrative = Narrative()
    assert [e for s in steps for e in narrative.lines(s, None)] + narrative.rest(
        steps[-1].time, 0
    ) == []
    assert next(iter(summary_lines(narrative.log, narrative.paths))) == "Seen: 1 object."


def test_relations_of_unknown_objects_are_reported_only_on_request() -> None:
    met = event("relation", 1.0, 1, 2)
    steps = [step(1.0, belief(1, 50, 50, 1.0), belief(2, 90, 50, 1.0), events=[met])]
    assert narrated(steps) == []
    assert narrated(steps, Detail.ALL) == [met]


def test_events_of_named_objects_are_not_repeated_at_once() -> None:
    known = (Candidate("arm", 1.0, 1.0, 0.99),)
    both = [belief(i, 60.0 * i, 50, 1.0, candidates=known, unknown=0.0) for i in (1, 2)]
    steps = [step(t, *both, events=[event("relation", t, 1, 2)]) for t in times(30)]
    assert [e.time for e in narrated(steps)] == pytest.approx([0.0, 10.0, 20.0, 30.0])


KINDS = ("relation", "entry", "alert", "stage_failing", "coupled", "of_a_plugin")


@settings(max_examples=12, deadline=None)
@given(
    st.lists(st.integers(1, 40), min_size=1, max_size=40),
    st.lists(st.tuples(st.sampled_from(KINDS), st.booleans()), min_size=1, max_size=6),
)
def test_lines_are_few_and_no_warning_is_withheld_however_much_happens(
    begins: list[int], kinds: list[tuple[str, bool]]
) -> None:
    known = (Candidate("arm", 1.0, 1.0, 0.99),)
    steps = []
    for t in times(60)[::4]:
        alive = [
            replace(crossing(n + 1, float(b), b + 3.0, t, 11.0 * n % 220))
            for n, b in enumerate(begins)
            if t >= b
        ]
        both = [belief(100 + n, 50.0 * n, 150, t, candidates=known, unknown=0.0) for n in range(5)]
        happen = [
            event(k, t, 100 + n % 5, severity=Severity.WARNING if grave else Severity.INFO)
            for n, (k, grave) in enumerate(kinds)
        ]
        steps.append(step(t, *alive, *both, events=happen))
    lines = narrated(steps)
    grave = [e for s in steps for e in worded_once(s.events) if e.severity > Severity.INFO]
    assert [e for e in lines if e.severity > Severity.INFO] == grave
    object_events = [
        e for e in lines if e.kind in ("life", "relation", "entry", "alert", "coupled")
    ]
    unalarming = [e for e in object_events if e.severity is Severity.INFO]
    assert len(unalarming) <= 10
    assert all(e.objects for e in unalarming)


@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=200))
def test_no_minute_has_more_than_ten_lines(pauses: list[float]) -> None:
    limiter, now, allowed = LineRateLimit(), 0.0, []
    for pause in pauses:
        now += pause
        allowed += [now] if limiter.allow(now) else []
    assert all(sum(t <= x < t + 60.0 for x in allowed) <= 10 for t in allowed)


def test_a_summary_names_the_busiest_pair_and_the_longest_stay() -> None:
    narrative, last = Narrative(), None
    for t in times(8):
        last = step(
            t,
            belief(1, 100, 100, t, first_seen=0.0),
            *([belief(2, 125, 100, t, first_seen=0.0)] if t < 5 else []),
            *([belief(3, 10, 10, t, first_seen=0.0)] if t < 3 else []),
        )
        narrative.lines(last, None)
    assert last is not None
    narrative.rest(last.time, last.frame_index)
    assert list(summary_lines(narrative.log, narrative.paths)) == [
        "Seen: 3 objects, at most 3 at a time.",
        "Longest in view: object 1, 8.0 s, last in the middle.",
        "Busiest pair: objects 1 and 2, near each other for 4.9 s, at the closest 5 px apart.",
    ]
