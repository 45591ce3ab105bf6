"""Compiled judgements against dumb twins in plain NumPy, on random scenes with holes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.relations import thresholds_by_arrays as twin
from visup.rules.geometry.pairs import pairs
from visup.rules.geometry.regions import DIRECTIONS
from visup.rules.relations import _kinematics_jit as kinematics_jit
from visup.rules.relations import _pair_states_jit as pair_states_jit
from visup.rules.relations import _thresholds_jit as thresholds_jit
from visup.rules.relations.direction import CONVERSE as OPPOSITE
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.rcc8 import CONVERSE, from_outline_signs, from_signs
from visup.rules.relations.rows import BOX_ROWS, ROWS
from visup.rules.relations.thresholds import ThresholdSettings, limits
from visup.rules.smoothing.hysteresis import Codes, Floats

some = settings(max_examples=80, deadline=None)
seeds = st.integers(0, 2**32 - 1)
counts = st.integers(2, 6)


def holed(rng: np.random.Generator, values: Floats, share: float = 0.15) -> Floats:
    """The same with some values missing."""
    return np.asarray(np.where(rng.random(values.shape) < share, np.nan, values))


def codes(rng: np.random.Generator, most: int, *shape: int) -> Codes:
    return rng.integers(-1, most + 1, shape).astype(np.int8)


def scene(rng: np.random.Generator, m: int) -> tuple[Floats, Floats, Floats]:
    """Boxes of a few pixels, some of them alike or not seen; velocities; their deviations."""
    boxes = rng.integers(0, 12, (m, 4)).astype(float) + rng.choice([0.0, 0.3])
    boxes[rng.random(m) < 0.15] = np.nan
    velocities = rng.normal(0.0, 3.0, (m, 2))
    velocities[rng.random(m) < 0.2] = np.nan
    return boxes, velocities, rng.uniform(0.1, 1.0, m)


@some
@given(seeds, counts)
def test_boxes_are_judged_as_by_arrays(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    boxes, velocities, spread = scene(rng, m)
    p = m * (m - 1) // 2
    before = np.concatenate(
        [codes(rng, 2, 8, p), codes(rng, 8, 1, p), codes(rng, 3, 1, p), codes(rng, 2, 4, p)]
    )
    bounds = limits(ThresholdSettings(), 800.0)
    found = np.empty((BOX_ROWS, p), dtype=np.int8)
    thresholds_jit.classify_boxes(before, boxes, velocities, spread, bounds, found)
    expected = twin.judged(before, boxes, velocities, spread, bounds)
    assert (found == expected).all()
    apart = twin.differences(boxes)
    assert np.allclose(thresholds_jit.edge_differences(boxes), apart, equal_nan=True)
    assert np.allclose(thresholds_jit.box_gaps(boxes), twin.gaps(apart), equal_nan=True)


@some
@given(seeds)
def test_signs_are_those_of_arrays(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values, before = holed(rng, rng.normal(0.0, 2.0, (3, 20))), codes(rng, 2, 3, 20)
    found = thresholds_jit.signs_with_hysteresis(values, before, 2.0, 1.0)
    assert (found == twin.signs(values, before, 2.0, 1.0)).all()
    sigma = rng.uniform(0.1, 1.0, 20)
    moving = thresholds_jit.moving_signs(values[0], sigma, before[0], (1.0, 0.5, 3.0, 2.0))
    at_rest = np.where(before[0] == -1, 1, before[0])
    enter, leave = np.maximum(1.0, 3.0 * sigma), np.maximum(0.5, 2.0 * sigma)
    assert (moving == twin.signs(values[0], at_rest, enter, leave)).all()


@given(seeds)
def test_rcc8_follows_from_signs_case_by_case(seed: int) -> None:
    rng = np.random.default_rng(seed)
    edges, outlines = codes(rng, 2, 8, 60), codes(rng, 2, 3, 60)
    assert (from_signs(edges) == twin.rcc8_of(edges)).all()
    assert (from_outline_signs(outlines) == twin.outlines_rcc8_of(outlines)).all()


def measured(rng: np.random.Generator, m: int) -> Kinematics:
    """Quantities as they may come out of `kinematics.py`."""
    tables = holed(rng, rng.normal(0.0, 3.0, (5, m, m)))
    tables = np.ascontiguousarray(np.triu(tables, 1) + np.triu(tables, 1).transpose(0, 2, 1))
    tables[2:4] = np.abs(tables[2:4])
    motion = holed(rng, rng.normal(0.0, 6.0, (3, m, 2)) * rng.choice([0.2, 1.0]) + 9.0)
    tables[3] = np.hypot(*(motion[0][:, None] - motion[0]).transpose(2, 0, 1))
    speed, depth = np.hypot(*motion[0].T), holed(rng, rng.uniform(5.0, 8.0, m))
    return Kinematics(tuple(range(m)), tables, motion, speed, depth, np.full(m, 0.5), 0.5)


@some
@given(seeds, counts)
def test_trend_touch_and_moving_together_are_those_of_arrays(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    now, p = measured(rng, m), m * (m - 1) // 2
    state, pending = codes(rng, 2, 3, p), codes(rng, 2, 3, p)
    depth, gap = codes(rng, 2, p), holed(rng, rng.uniform(0.0, 8.0, p))
    marks = rng.choice([0, 0, 1, 2, 3], p).astype(np.int8)
    found = np.concatenate([np.zeros((3, p), dtype=np.int8), depth[None]])
    bounds = pair_states_jit.MotionLimits(
        (1.6, 0.8), (3.0, 2.0), (3.0, 5.0, 0.2, 0.25), (2.0, 4.0, 1.5, 0.7)
    )
    motion = pair_states_jit.PairMotion(now.tables, now.motion, now.speed, now.depth, gap, marks)
    pair_states_jit.classify_motion(state, pending, motion, bounds, found)
    i, j = pairs(m)
    sway = pair_states_jit.SWAY * np.minimum(now.speed[i], now.speed[j])
    rate, sigma = now.rate[i, j], now.rate_sigma[i, j]
    trend = twin.trends(rate, sigma, sway, state[0], pending[0], depth)
    touch = twin.touches(gap, now.depth, state[1])
    meets = now.gap[i, j] <= bounds.touch[0]
    trend = np.where((marks & 1 == 1) & meets & (trend == 2), 1, trend)
    merged = marks & 2 == 2
    assert (found[0] == np.where(merged, -1, trend)).all()
    assert (found[1] == np.where(merged, 1, touch)).all()
    assert (found[2] == twin.together(now, state[2])).all()


@some
@given(seeds, counts)
def test_what_is_told_is_what_is_believed_with_its_converse(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    now, p = measured(rng, m), m * (m - 1) // 2
    state, rcc8 = codes(rng, 2, ROWS, p), codes(rng, 7, 2, p)
    since, turned = rng.uniform(0.0, 9.0, (ROWS, p)), rng.uniform(0.0, 9.0, (2, p))
    beliefs = pair_states_jit.PairBeliefs(state, since, rcc8, turned)
    told, moments, numbers = pair_states_jit.relation_rows(
        beliefs, now.tables, now.depth, (CONVERSE, OPPOSITE), (9.5, 0.8, 0.5)
    )
    i, j = pairs(m)
    gap, rate, sigma = now.gap[i, j], now.rate[i, j], now.rate_sigma[i, j]
    rows = [14, 15, 16, 17, 10, 11, 12, 13, 9, 8]
    places = [0, 1, 2, 8, 9, 10, 11, 12, 13, 14]
    assert (told[places] == state[rows]).all()
    assert (moments[places] == since[rows]).all()
    assert (told[[3, 6]] == rcc8).all()
    assert (told[4] == twin.converse_of(rcc8[0])).all()
    assert (told[7] == twin.converse_of(rcc8[1])).all()
    assert (moments[[3, 4, 6, 7]] == turned[[0, 0, 1, 1]]).all()
    assert (told[15] == OPPOSITE[state[8]]).all()
    assert (told[5] == np.where(np.isnan(gap), -1, 0)).all()
    assert (moments[5] == 9.5).all()
    known = np.isfinite(now.depth)
    cap = np.where(known[i] & known[j], 1.0, 0.8)
    z = np.abs(rate / np.hypot(sigma, 0.5))
    sure = np.where(np.isnan(z), 0.0, 1.0 - 0.5 * np.exp(-z / 3.0))
    expected = np.ones(p), np.minimum(cap, 0.9), np.minimum(cap, sure), gap, rate, sigma
    assert np.allclose(numbers[:6], expected, equal_nan=True)


@some
@given(seeds, counts)
def test_places_and_outlines_follow_what_moves_and_smooth_what_shakes(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    now, p = measured(rng, m), m * (m - 1) // 2
    boxes, gap = holed(rng, rng.uniform(0.0, 9.0, (m, 4))), holed(rng, rng.uniform(0.0, 9.0, p))
    seen = rng.uniform(0.0, 9.0, (m, 8))
    seen[:, 0] = rng.choice([0.0, 0.2, 0.5], m)

    def smooth(before: Floats, value: Floats, jump: float) -> Floats:
        steady = np.abs(value - before) <= jump
        return np.asarray(np.where(steady, before + 0.4 * (value - before), value))

    found = pair_states_jit.smoothed_boxes(boxes, gap, seen, now.tables, (0.4, 3.0, 2.0, 0.3, 1.5))
    wanted = np.where(seen[:, :1] > 0.3, np.nan, seen[:, 4:])
    i, j = pairs(m)
    gaps = smooth(gap, now.gap[i, j], 2.0)
    assert np.allclose(found[0], smooth(boxes, wanted, 3.0), equal_nan=True)
    assert np.allclose(found[1], gaps, equal_nan=True)
    assert found[2].tolist() == np.flatnonzero(gaps <= 1.5).tolist()
    before, apart = holed(rng, rng.uniform(30.0, 41.0, (3, p))), rng.normal(35.0, 3.0, (3, p))
    asked = found[2]
    level = pair_states_jit.smoothed_outlines(
        before, gaps, asked, apart[:, asked].copy(), (0.4, 2.0, 40.0)
    )
    value = np.where(np.isnan(gaps), np.nan, np.full((3, p), 40.0))
    value[:, asked] = apart[:, asked]
    assert np.allclose(level, smooth(before, value, 2.0), equal_nan=True)


@some
@given(seeds, counts)
def test_quantities_of_pairs_are_those_of_arrays(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    p, (i, j) = m * (m - 1) // 2, pairs(m)
    gaps, slope, sigma = (holed(rng, rng.normal(2.0, 4.0, p)) for _ in range(3))
    velocity, support = holed(rng, rng.normal(0.0, 9.0, (m, 2))), rng.normal(20.0, 9.0, (m, 16))
    seen = rng.normal(0.0, 9.0, (m, 8))
    seen[:, 0] = rng.choice([0.0, 1.0], m)
    seen[:, 3] = rng.uniform(0.1, 1.0, m)
    found, speed = kinematics_jit.pair_tables(
        gaps, slope, sigma, velocity, support, seen, DIRECTIONS, (4.0, 3.0, 4.0, 0.75)
    )
    reach = support[:, None] + support[:, (np.arange(16) + 8) % 16]
    towards = DIRECTIONS[reach.argmin(axis=2)]
    parting = ((seen[None, :, 1:3] - seen[:, None, 1:3]) * towards).sum(axis=2)[i, j]
    spread = np.hypot(seen[i, 3], seen[j, 3])
    sure = (parting > np.maximum(3.0, 4.0 * spread)) & (gaps <= 4.0) & (slope < parting)
    rate = np.where(sure, parting, slope)
    rate[np.maximum(seen[i, 0], seen[j, 0]) > 0.75] = np.nan
    now = Kinematics(tuple(range(m)), found, np.zeros((3, m, 2)), speed)
    assert np.allclose(now.gap[i, j], gaps, equal_nan=True)
    assert np.allclose(now.rate[i, j], rate, equal_nan=True)
    assert np.allclose(now.rate_sigma[i, j], np.where(sure, spread, sigma), equal_nan=True)
    apart = np.hypot(*(velocity[i] - velocity[j]).T)
    assert np.allclose(now.relative_speed[i, j], apart, equal_nan=True)
    assert np.allclose(speed, np.hypot(*velocity.T), equal_nan=True)
    for gap, pace, time in zip(gaps, rate, now.time_to_contact[i, j], strict=True):
        if np.isnan(gap) or np.isnan(pace):
            assert np.isnan(time)
        elif gap <= 0.0 or pace >= 0.0:
            assert time == (0.0 if gap <= 0.0 else np.inf)
        else:
            assert time == pytest.approx(gap / -pace)


def test_only_near_pairs_are_asked_and_a_moment_out_of_sight_keeps_the_last_gap() -> None:
    seen = np.zeros((4, 8))
    seen[:, 4:] = [(0, 0, 10, 10), (15, 0, 10, 10), (300, 0, 10, 10), (0, 20, 10, 10)]
    seen[3, 0] = 0.2
    apart, before = np.full((4, 4), 7.0), np.full((4, 4), 33.0)
    apart[1, 2] = np.nan
    gaps, asked = kinematics_jit.hull_gaps(seen, apart, before, 5.0, 0.3)
    assert asked.tolist() == [0]
    assert np.array_equal(gaps, [7.0, 7.0, 33.0, np.nan, 33.0, 33.0], equal_nan=True)
    seen[3, 0] = 0.4
    assert np.isnan(kinematics_jit.hull_gaps(seen, apart, before, 5.0, 0.3)[0][[2, 4, 5]]).all()
