"""Who sets out: a body that moves, or a part of it, while the picture as a whole does not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.rules.geometry.regions import DIRECTIONS, FAN, Floats
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.rows import PairQuantity
from visup.rules.relations.samples import SampleWindow
from visup.tasks.verification.motion_onset import (
    LAG_S,
    advancing_outlines,
    moving_more_than_others,
    near_movers,
)

TIMES = np.arange(0.0, 1.0, 0.1)
LIMIT = 7.0

shifts = st.tuples(st.floats(-60, 60), st.floats(-60, 60))


def window(reach: Floats, free: Floats | None = None) -> SampleWindow:
    """Samples of some bodies whose outlines reach so far; (T, M, 16) pixels."""
    count, bodies, _ = reach.shape
    return SampleWindow(
        tuple(range(bodies)),
        TIMES[:count],
        reach,
        np.ones(reach.shape, dtype=bool) if free is None else free > 0,
        np.zeros((count, bodies, bodies)),
        np.zeros((count, bodies)),
        np.zeros((count, bodies, 2)),
    )


def resting(bodies: int) -> Floats:
    """Round bodies side by side that rest."""
    places = np.array([(100.0 * k, 50.0) for k in range(bodies)])
    return np.repeat((places @ DIRECTIONS.T + 20.0)[None], len(TIMES), axis=0)


def path(shift: tuple[float, float]) -> Floats:
    """(T, 16) how far the outline of a body that moves steadily by a shift reaches beyond its place."""
    share = np.linspace(0.0, 1.0, len(TIMES))
    along: Floats = np.outer(share, np.asarray(shift) @ DIRECTIONS.T)
    return along


@given(st.integers(1, 4))
def test_resting_bodies_do_not_move(bodies: int) -> None:
    assert not advancing_outlines(window(resting(bodies)), LIMIT).any()


@given(st.integers(2, 4), shifts)
def test_motion_common_to_all_bodies_is_due_to_the_camera(
    bodies: int, shift: tuple[float, float]
) -> None:
    seen = window(resting(bodies) + path(shift)[:, None])
    assert not advancing_outlines(seen, LIMIT).any()
    if np.hypot(*shift) > 1.0:
        assert not moving_more_than_others(seen).any()


@given(st.integers(1, 4), st.integers(0, 3), shifts)
def test_only_the_body_that_moves_far_enough_sets_out(
    bodies: int, who: int, shift: tuple[float, float]
) -> None:
    reach, who = resting(bodies), who % bodies
    reach[:, who] += path(shift)
    found = advancing_outlines(window(reach), LIMIT)
    lag = np.abs(path(shift)[-1] - path(shift)[round(len(TIMES) - 1 - LAG_S / 0.1)]).max()
    others = [k for k in range(bodies) if k != who]
    assert found[who] == (lag > LIMIT) or lag == pytest.approx(LIMIT)
    assert bodies == 2 or not found[others].any()


@given(st.permutations(range(4)), shifts)
def test_the_order_of_bodies_does_not_matter(order: list[int], shift: tuple[float, float]) -> None:
    reach = resting(4)
    reach[:, 1] += path(shift)
    seen, turned = window(reach), window(reach[:, order])
    for question in (moving_more_than_others, lambda w: advancing_outlines(w, LIMIT)):
        assert np.array_equal(question(turned), question(seen)[order])


@given(st.integers(2, 4), st.integers(0, len(TIMES) - 1), shifts)
def test_a_body_that_has_just_come_in_does_not_make_the_others_move(
    bodies: int, since: int, shift: tuple[float, float]
) -> None:
    """Beside a swaying camera: the newcomer has hardly changed its place yet."""
    reach, free = resting(bodies + 1) + path(shift)[:, None], np.ones((len(TIMES), bodies + 1, FAN))
    free[:since, bodies] = 0.0
    found = moving_more_than_others(window(reach, free))
    assert np.hypot(*shift) <= 1.0 or not found[:bodies].any()


def test_an_advancing_part_of_a_body_suffices() -> None:
    reach = resting(3)
    reach[6:, 0, 3] += 10.0
    assert advancing_outlines(window(reach), LIMIT).tolist() == [True, False, False]


def test_a_body_being_covered_does_not_move() -> None:
    reach = resting(3)
    reach[6:, 0, 3:6] -= 15.0
    assert not advancing_outlines(window(reach), LIMIT).any()


def test_parts_cut_by_the_border_are_no_evidence_of_motion() -> None:
    reach, free = resting(2), np.ones((len(TIMES), 2, FAN))
    reach[6:, 0, 3] += 10.0
    free[:, 0, 3] = 0.0
    assert not advancing_outlines(window(reach, free), LIMIT).any()


def test_a_short_history_shows_no_motion() -> None:
    reach = resting(2)[:3]
    reach[2, 0] += 30.0
    assert not advancing_outlines(window(reach), LIMIT).any()


SLOW, GAP = 7.5, 30.0
unknown = st.just(float("nan"))


@given(
    st.lists(st.floats(0, 4 * SLOW) | unknown, min_size=1, max_size=4),
    st.lists(st.floats(0, 3 * GAP) | unknown, min_size=6, max_size=6),
)
def test_beside_a_mover_is_what_is_near_another_body_not_known_to_be_slow(
    speeds: list[float], gaps: list[float]
) -> None:
    count = len(speeds)
    tables = np.full((5, count, count), np.nan)
    free = iter(gaps)
    expected = [False] * count
    for i in range(count):
        tables[PairQuantity.GAP, i, i] = 0.0
        for j in range(i + 1, count):
            gap = next(free)
            tables[PairQuantity.GAP, [i, j], [j, i]] = gap
            for a, b in ((i, j), (j, i)):
                slow = speeds[b] < SLOW
                expected[a] |= gap < GAP and not slow
    now = Kinematics(tuple(range(count)), tables, speed=np.array(speeds))
    assert near_movers(now, SLOW, GAP).tolist() == expected
