"""Relations of boxes: definitions, symmetries, noise at rest, drift."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.reasoning.relations import (
    SCENES,
    changes,
    drift_seen,
    moving_boxes,
    qtc_wrong,
    rcc8_wrong,
)
from tests.oracles.relation_oracles import plain_relations, qtc_by_definition
from visup.evaluation.reasoning.boxes import Boxes, BoxSettings, watch_boxes
from visup.rules.geometry.pairs import pairs
from visup.rules.geometry.regions import RCC8, Floats
from visup.rules.relations._thresholds_jit import (
    box_gaps,
    components,
    direction,
    distance_class,
    size_of,
)
from visup.rules.relations.direction import CONVERSE, DIRECTION_NAMES
from visup.rules.relations.distance import CLASS_NAMES
from visup.rules.relations.qtc import text
from visup.rules.relations.rcc8 import rcc8
from visup.rules.relations.rows import AWAY, DIRECTION, DISTANCE, SIDE
from visup.rules.relations.thresholds import ThresholdSettings
from visup.rules.smoothing.hysteresis import UNKNOWN

A = (100.0, 200.0, 80.0, 60.0)
MIRROR = {"converging": "diverging", "diverging": "converging"}
NO_NOISE = BoxSettings(
    ThresholdSettings(noise_px=0.0, level_enter=0.0, level_exit=0.0, state_minimum_s=0.0)
)


def watched(frames: Floats, fps: float = 25.0, s: BoxSettings | None = None) -> Boxes:
    beliefs = Boxes()
    for k, boxes in enumerate(frames):
        beliefs = watch_boxes(beliefs, tuple(range(len(boxes))), boxes, k / fps, s)
    return beliefs


def test_rcc8_agrees_with_its_definition() -> None:
    assert rcc8_wrong(600, 1) == 0


def test_qtc_agrees_with_its_definition() -> None:
    assert qtc_wrong(2000, 1) == 0


@pytest.mark.parametrize(
    ("places", "velocities", "expected"),
    [
        (((0, 0), (10, 0)), ((1, 0), (-1, 0)), "--00"),
        (((0, 0), (10, 0)), ((-1, 0), (1, 0)), "++00"),
        (((0, 0), (10, 0)), ((0, -1), (0, -1)), "00-+"),  # both up: left of a's line, right of b's
        (((0, 0), (10, 0)), ((1, 1), (0, 0)), "-0+0"),
        (((0, 0), (0, 10)), ((1, 0), (0, 0)), "00-0"),  # b below a: a's right hand is to the left
    ],
)
def test_qtc_of_published_figures(
    places: tuple[tuple[int, int], ...], velocities: tuple[tuple[int, int], ...], expected: str
) -> None:
    at, v = np.array(places), np.array(velocities)
    assert qtc_by_definition(at, v) == expected
    speeds = components(at.astype(float), v.astype(float), 0, 1)[:4]
    assert text(*(int(s) + 1 for s in np.sign(speeds))) == expected


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(0, 9)] * 2, *[st.integers(1, 9)] * 2), min_size=2, max_size=5),
    st.integers(-50, 50),
    st.integers(1, 7),
)
def test_rcc8_does_not_depend_on_place_and_scale_and_has_converses(
    boxes: list[tuple[int, int, int, int]], shift: int, scale: int
) -> None:
    some = np.array(boxes, dtype=float)
    code = rcc8(some)
    assert (rcc8((some + np.array((shift, -shift, 0, 0))) * scale) == code).all()
    inverse = {n: n + "_inverse" for n in ("tangential_proper_part", "non_tangential_proper_part")}
    inverse |= {v: k for k, v in inverse.items()}
    names = np.array(RCC8)[code]
    assert all(
        names[j, i] == inverse.get(names[i, j], names[i, j])
        for i in range(len(some))
        for j in range(len(some))
    )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_reversed_time_reverses_every_velocity(seed: int) -> None:
    frames = moving_boxes(3, 60, seed, noise=0.0)
    there, back = watched(frames), watched(frames[::-1])
    assert np.allclose(there.velocity, -back.velocity)
    places = frames[0, :, :2].copy()
    for i, j in zip(*pairs(len(places)), strict=True):
        speeds = np.array(components(places, there.velocity, i, j)[:4])
        assert np.allclose(components(places, back.velocity, i, j)[:4], -speeds)


@pytest.mark.parametrize(("speed", "name"), [(-40, "converging"), (40, "diverging")])
def test_mirrored_time_swaps_converging_and_diverging(speed: float, name: str) -> None:
    x = 300.0 + speed * np.arange(50) / 25
    frames = np.array([[A, (v, 200.0, 80.0, 60.0)] for v in x])
    assert watched(frames).approach_of(0, 1) == name
    assert watched(frames[::-1]).approach_of(0, 1) == MIRROR[name]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(-300, 300))
def test_relations_do_not_depend_on_place_and_come_as_converses(seed: int, shift: float) -> None:
    frames = moving_boxes(3, 55, seed)
    here, there = watched(frames), watched(frames + np.array((shift, -shift, 0.0, 0.0)))
    assert np.array_equal(here.hysteresis.state, there.hysteresis.state)
    turned = watched(frames[:, ::-1])
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert here.rcc8_of(a, b) == turned.rcc8_of(2 - a, 2 - b)
        assert here.direction_of(a, b) == turned.direction_of(2 - a, 2 - b)
        assert here.distance_of(a, b) == turned.distance_of(2 - a, 2 - b)
        assert here.qtc_of(a, b, sides=True) == turned.qtc_of(2 - a, 2 - b, sides=True)
        one, other = here.qtc_of(a, b), here.qtc_of(b, a)
        assert one is None or other is None or one == other[::-1]


def test_without_noise_relations_agree_with_plain_numpy() -> None:
    frames = np.round(moving_boxes(12, 60, 3, noise=0.0))
    frames[30:] = frames[30]  # The last frames stand still, so that nothing is pending.
    beliefs = watched(frames, s=NO_NOISE)
    code, _, distance, _ = plain_relations(frames[-1], frames[-1], 1.0)
    i, j = np.triu_indices(12, 1)
    assert (beliefs.rcc8 == code[i, j]).all()
    assert np.allclose(np.maximum(beliefs.gap, 0.0), distance[i, j])


@pytest.mark.parametrize("scene", SCENES)
def test_boxes_at_rest_change_no_relation(scene: str) -> None:
    assert changes(*SCENES[scene], minutes=0.7, seed=5) == 0


def test_drift_is_detected_within_two_seconds() -> None:
    assert drift_seen(seed=3, trials=6) < 2.0


def test_relations_of_hidden_and_of_new_boxes_are_unknown() -> None:
    frames = moving_boxes(3, 60, 2)
    before = watched(frames)
    hidden = frames[-1].copy()
    hidden[1] = np.nan
    after = watch_boxes(before, (0, 1, 2), hidden, 60 / 25)
    assert after.rcc8_of(0, 1) is None
    assert after.qtc_of(1, 2) is None
    assert after.rcc8_of(0, 2) == before.rcc8_of(0, 2)
    other = watch_boxes(before, (0, 2, 7), frames[-1], 60 / 25)
    assert other.direction_of(0, 2) == before.direction_of(0, 2)
    assert other.direction_of(0, 7) is None
    assert other.qtc_of(0, 2) == before.qtc_of(0, 2)


@pytest.mark.parametrize("turn", range(8))
def test_directions_are_cones_about_their_axes(turn: int) -> None:
    angle = np.pi / 4 * turn
    for off in (-0.35, 0.0, 0.35):
        x, y = 100 * np.cos(angle + off), 100 * np.sin(angle + off)
        assert direction(x, y, UNKNOWN, (1.0, 2.0), 0.0, 0.0) == turn
        assert direction(-x, -y, UNKNOWN, (1.0, 2.0), 0.0, 0.0) == CONVERSE[turn]
    assert CONVERSE[UNKNOWN] == UNKNOWN
    assert DIRECTION_NAMES[6] == "north_of"


def test_directions_have_hysteresis_at_the_edge_of_their_cone() -> None:
    edge = np.pi / 8
    for beyond, kept in ((0.04, 0), (0.12, 1)):
        x, y = 100 * np.cos(edge + beyond), 100 * np.sin(edge + beyond)
        assert direction(x, y, 0, (1.0, 2.0), np.deg2rad(5.0), 0.0) == kept


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.2, 5.0))
def test_distance_classes_grow_with_the_gap_and_not_with_the_scale(seed: int, scale: float) -> None:
    boxes = moving_boxes(6, 1, seed)[0]
    gap, two = box_gaps(boxes), zip(*pairs(len(boxes)), strict=True)
    size = np.array([size_of(boxes, i, j) for i, j in two])

    def classes(scale: float) -> np.ndarray:
        found = zip(scale * gap, scale * size, strict=True)
        return np.array([distance_class(g, s, UNKNOWN, 0.1, 0.5) for g, s in found])

    code = classes(1.0)
    assert (classes(scale) == code).all()
    order = np.argsort(gap / size)
    assert (np.diff(code[order]) >= 0).all()
    assert set(code.tolist()) <= set(range(len(CLASS_NAMES)))


def test_gaps_are_the_distances_of_boxes_and_the_depth_of_their_overlap() -> None:
    for other, gap in (
        ((190, 200, 10, 10), 10.0),
        ((183, 264, 10, 10), 5.0),
        ((170, 210, 80, 20), -10.0),
    ):
        assert box_gaps(np.array([A, other], float))[0] == pytest.approx(gap)


def test_states_are_codes_of_their_calculus() -> None:
    state = watched(moving_boxes(8, 80, 4)).hysteresis.state
    assert set(np.unique(state[AWAY])) | set(np.unique(state[SIDE])) <= {0, 1, 2}
    assert state[DIRECTION].max() <= 8
    assert state[DISTANCE].max() <= 3
