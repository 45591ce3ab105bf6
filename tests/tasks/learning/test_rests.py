"""Who must not be pushed about, and who is only carried along."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.tasks.checks.load import parse_task
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.relevance import relevant_events
from visup.tasks.learning.rests import MIN_ALLOWED, REST, SPEED_MARGIN, resting_actors
from visup.tasks.learning.traces import SUSTAINED_S, ActionInterval, RunTrace, _sustained_speed

DIAGONAL = 600.0
SPEEDS = st.floats(0.0, 60.0)


WORK = {"gripper": ((0.5, 12.0),), "part": ((3.0, 8.0),)}
"""When who is on the move, where a gripper carries a part."""


def trace(*intervals: ActionInterval, **fastest: float) -> RunTrace:
    return RunTrace("run", intervals, 0.0, 12.0, moves=WORK, fastest=fastest, diagonal=DIAGONAL)


@given(st.lists(st.tuples(SPEEDS, SPEEDS), min_size=1, max_size=4))
def test_a_slow_actor_is_at_rest_and_its_limit_exceeds_the_observed_speed(
    speeds: list[tuple[float, float]],
) -> None:
    runs = [trace(table=t, arm=a) for t, a in speeds]
    found = {r.actor: r for r in resting_actors(runs, {"table", "arm", "lid"})}
    for name, seen in zip(("table", "arm"), zip(*speeds, strict=True), strict=True):
        assert (name in found) == (max(seen) <= REST * DIAGONAL)
        if name in found:
            assert found[name].allowed >= max(MIN_ALLOWED * DIAGONAL, SPEED_MARGIN * max(seen))
    assert "lid" not in found  # nobody saw it in every run


@given(st.lists(st.floats(0.0, 100.0), min_size=1, max_size=40))
def test_a_speed_in_a_single_frame_is_not_sustained(speeds: list[float]) -> None:
    rows = [(k / 15, s) for k, s in enumerate(speeds)]
    width = round(15 * SUSTAINED_S) + 1
    dumb = [min(speeds[k : k + width]) for k in range(len(speeds) - width + 1)]
    assert _sustained_speed(rows) == max(dumb, default=0.0)


def carrying_trace(let_go: float, gone: float) -> RunTrace:
    """A gripper brings a part to a fixture; in the image it touches the fixture itself for a while longer."""
    return trace(
        ActionInterval(("converging", ("gripper", "part")), 1.0, 2.0),
        ActionInterval(("touching", ("gripper", "part")), 2.0, let_go),
        ActionInterval(("coupled", ("gripper", "part")), 3.0, let_go),
        ActionInterval(("touching", ("fixture", "gripper")), 7.0, gone),
        ActionInterval(("touching", ("fixture", "part")), 7.0, gone - 0.1),
        ActionInterval(("diverging", ("gripper", "part")), let_go, 12.0),
    )


def test_a_carrier_passing_in_front_of_a_fixture_does_not_meet_it() -> None:
    pair = ("fixture", "gripper")
    others = [h for h in carrying_trace(9.0, 9.4).intervals if h.symbol[1] == ("gripper", "part")]
    others.append(ActionInterval(("touching", ("fixture", "part")), 7.0, 12.0))
    passes = (ActionInterval(("touching", pair), begin, 9.4) for begin in (7.0, 0.9))
    rows = relevant_events([trace(*others, p) for p in passes])
    assert all(("touching", ("fixture", "part")) in {e.symbol for e in row} for row in rows)
    assert not any(e.symbol[1] == pair for row in rows for e in row)


def test_two_actors_at_rest_touch_even_if_believed_coupled() -> None:
    rests = ActionInterval(("coupled", ("fixture", "part")), 9.2, 12.0)
    rows = relevant_events([trace(*carrying_trace(9.0, 9.4).intervals, rests)] * 2)
    words = {e.symbol for row in rows for e in row}
    assert ("coupled", ("gripper", "part")) in words
    assert ("coupled", ("fixture", "part")) not in words


def test_a_contact_from_the_start_is_not_a_stage() -> None:
    since = ActionInterval(("touching", ("lid", "table")), 0.9, 12.0, begin_observed=False)
    rows = relevant_events([trace(*carrying_trace(9.0, 9.4).intervals, since)] * 2)
    assert not any(e.symbol[1] == ("lid", "table") for row in rows for e in row)


def mooring_trace(sets_out: float, *, hidden: bool = False) -> RunTrace:
    """A boat comes to a pier; where it is hidden it stands before the pier from the first look on."""
    pair = ("boat", "pier")
    touches = 0.6 if hidden else sets_out + 2
    return trace(
        ActionInterval(("converging", pair), sets_out, sets_out + 4.0),
        ActionInterval(("touching", pair), touches, 12.0, begin_observed=not hidden),
    )


@given(st.lists(st.floats(1.0, 4.0), min_size=2, max_size=4), st.floats(1.0, 4.0))
def test_a_contact_from_the_start_of_one_run_only_is_a_stage_in_all(
    sets_out: list[float], late: float
) -> None:
    rows = relevant_events([*map(mooring_trace, sets_out), mooring_trace(late, hidden=True)])
    assert len({tuple(e.symbol for e in row) for row in rows}) == 1
    touches = [next(e for e in row if e.symbol[0] == "touching") for row in rows]
    assert [t.interval.begin_observed for t in touches] == [True] * len(sets_out) + [False]
    assert touches[-1].at == late + 4.0


FENDER = "(touching(boat, fender) & touching(boat, pier))"


@pytest.mark.parametrize("hidden", [False, True])
@pytest.mark.parametrize(
    ("other", "begins", "asked"),
    [
        ("pier", (), "touching(boat, pier)"),
        ("buoy", (9.0, 9.0, 9.0), "touching(boat, pier)"),  # another stage follows
        ("fender", (4.0, 5.0, 6.5), FENDER),  # comes about at once: one stage asks for both
    ],
)
def test_a_stage_has_already_if_some_run_begins_with_it(
    hidden: bool, other: str, begins: tuple[float, ...], asked: str
) -> None:
    runs = [mooring_trace(2.0), mooring_trace(3.0), mooring_trace(2.5, hidden=hidden)]
    for k, begin in enumerate(begins):
        more = ActionInterval(("touching", ("boat", other)), begin, 12.0)
        runs[k] = replace(runs[k], intervals=(*runs[k].intervals, more))
    task = parse_task(learn_task("moor", runs).text)
    (stage,) = [str(s) for s in task.stages if "touching(boat, pier)" in str(s)]
    assert asked in stage
    assert (f"already {asked}" in stage) == hidden


def test_the_carried_actor_is_the_same_in_all_runs() -> None:
    rows = relevant_events(
        [carrying_trace(9.0, 9.4), carrying_trace(9.0, 9.9), carrying_trace(9.0, 10.1)]
    )
    symbols = [{e.symbol for e in row} for row in rows]
    assert all(row == symbols[0] for row in symbols)
    (met,) = ({s[1] for s in symbols[0] if s[0] == "touching"},)
    assert len(met) == 1


def test_a_lost_contact_of_two_actors_at_rest_is_not_a_separation() -> None:
    rows = relevant_events([carrying_trace(9.0, 9.4), carrying_trace(9.0, 9.5)])
    assert not any(e.symbol[0] == "apart" for row in rows for e in row)
    away = ActionInterval(("diverging", ("fixture", "part")), 9.5, 12.0)
    parted = [trace(*r.intervals, away) for r in (carrying_trace(9.0, 9.4),) * 2]
    symbols = [e.symbol for row in relevant_events(parted) for e in row]
    pair = next(s[1] for s in symbols if s[0] == "touching")
    assert (("apart", pair) in symbols) == (pair == ("fixture", "part"))
