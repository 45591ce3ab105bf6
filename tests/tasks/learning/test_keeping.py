"""How near to each other those keep who never meet, and what only holds in passing or meanwhile."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from tests.tasks.learning.test_carrying import (
    APPROACHES,
    BRINGS,
    HELD,
    PLACED,
    carrying_stages,
    event,
    trace,
)
from visup.agent import Region, Verdict
from visup.evaluation.learning.runner import bad_outcomes, worlds_of
from visup.tasks.analysis.judging import judged
from visup.tasks.analysis.languages import actions_of
from visup.tasks.checks.load import parse_task
from visup.tasks.learning.carrying import with_carrying
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.places import longest_span_below, typical_gap
from visup.tasks.learning.traces import RunTrace, trace_of

FPS = 12.5
NAMES = {1: [("drone", 0.95)], 2: [("tower", 0.95)]}
levels = st.lists(st.one_of(st.floats(0.0, 200.0), st.just(float("nan"))), min_size=2, max_size=60)


def inspection_run(stay_s: float, near: float, begin: float = 1.0) -> RunTrace:
    """A drone comes from afar, stays near a tower, gently to and fro, and goes back."""
    frames = int((begin + stay_s + 6.0) * FPS)

    def boxes(frame: int) -> list[Region | None]:
        time = frame / FPS
        gap = float(
            np.interp(time, [begin, begin + 3, begin + 3 + stay_s, begin + 6 + stay_s], PATH * near)
        )
        gap += 0.1 * near * np.sin(2.0 * time)
        return [box_region(1, (240 - gap, 200, 50, 40)), box_region(2, (290, 120, 60, 200))]

    script = (seen(k, boxes(k), FPS, NAMES) for k in range(frames))
    return trace_of("run", [thought.mind for thought in reason(script)])


PATH = np.array([4.0, 1.0, 1.0, 4.0])


def test_an_actor_that_stays_near_and_leaves_must_stay_as_near_for_as_long() -> None:
    learned = learn_task(
        "inspect", [inspection_run(s, near) for s, near in ((7, 40), (8, 45), (7.5, 38))]
    )
    task = parse_task(learned.text)
    pair = frozenset({"drone", "tower"})
    assert actions_of(task) == {("converging", pair), ("gap", pair), ("diverging", pair)}
    verdicts = [
        judged(task, inspection_run(s, n).minds).verdict for s, n in ((9, 42), (7, 36), (2, 40))
    ]
    assert [v is Verdict.SUCCEEDED for v in verdicts] == [True, True, False]


@given(levels, st.floats(1.0, 150.0))
def test_longest_span_below_equals_brute_force(gaps: list[float], level: float) -> None:
    times = np.arange(len(gaps)) / FPS
    begin, end = longest_span_below(times, np.array(gaps), level)
    runs = [
        times[b] - times[a]
        for a in range(len(gaps))
        for b in range(a, len(gaps))
        if all(g < level for g in gaps[a : b + 1])
    ]
    assert end - begin == max(runs, default=0.0)


@given(st.floats(10.0, 50.0), st.floats(150.0, 300.0), st.floats(4.0, 20.0))
def test_the_typical_gap_is_that_of_the_stay(near: float, far: float, stay: float) -> None:
    times = np.arange(0.0, 4.0 + stay, 0.05)
    gaps = np.interp(times, [0.0, 2.0, 2.0 + stay, 4.0 + stay], [far, near, near, far])
    assert near <= typical_gap(times, gaps) <= 0.5 * (near + far)
    assert typical_gap(times, np.full(len(times), np.nan)) == 0.0


def test_a_part_carried_past_its_destination_is_still_carried_to_it() -> None:
    plain = [
        event("coupled", HELD, 3.0, 10.0),
        event("touching", PLACED, 8.0),
        event("decoupled", HELD, 10.0),
    ]
    passes = [event("touching", PLACED, 3.1, 4.0), event("apart", PLACED, 4.0)]
    past = [plain[0], *passes, *plain[1:]]
    rows = with_carrying([plain, past], [trace(BRINGS, APPROACHES)] * 2)
    assert [e.symbol for e in rows[0]] == [e.symbol for e in rows[1]]
    assert len(carrying_stages(rows)) == 2
    # In all runs alike, it is meant.
    assert any(e.symbol[0] == "apart" for e in with_carrying([past, past], [trace(BRINGS)] * 2)[0])


def test_impossible_outcomes_of_a_world_do_not_block_others() -> None:
    worlds = worlds_of("crane", 11, bad_outcomes("crane"), 4, {"container", "truck"})
    assert [w.truth.outcome for w in worlds] == ["miss", "carry_off", "miss", "carry_off"]
