"""An outline from a single point: what lies there, and nothing where nothing has an edge."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.agent import Frame, Health, HealthStatus, Observation, Percept, Report, ReportState
from visup.agent.storage.checkpoint import dump_state, load_state
from visup.percepts.appearance.placed_objects import PlacedObjectBehaviour
from visup.percepts.taught.point_segmentation import outline_at_point

GREEN, RED = (60, 140, 70), (40, 40, 200)


def scene(box: tuple[int, int, int, int], seed: int = 3) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    image = np.full((240, 320, 3), GREEN, np.float64)
    x, y, w, h = box
    image[y : y + h, x : x + w] = RED
    blurred = cv2.GaussianBlur(image, (3, 3), 0.7) + rng.normal(0, 4, image.shape)
    return np.clip(blurred, 0, 255).astype(np.uint8)


def overlap(outline: object, box: tuple[int, int, int, int]) -> float:
    drawn, truth = np.zeros((2, 240, 320), np.uint8)
    cv2.fillPoly(drawn, [np.round(np.array(outline)).astype(np.int32)], (1,))
    x, y, w, h = box
    truth[y : y + h, x : x + w] = 1
    return float(np.count_nonzero(drawn & truth) / np.count_nonzero(drawn | truth))


@settings(max_examples=12, deadline=None)
@given(
    st.tuples(st.integers(20, 200), st.integers(20, 150), st.integers(16, 80), st.integers(16, 70)),
    st.floats(0.2, 0.8),
    st.floats(0.2, 0.8),
)
def test_a_thing_is_outlined_from_any_place_in_it(
    box: tuple[int, int, int, int], across: float, down: float
) -> None:
    x, y, w, h = box
    outline = outline_at_point(scene(box), (x + across * w, y + down * h))
    assert outline is not None
    assert overlap(outline, box) > 0.7


def test_the_ground_is_no_thing() -> None:
    assert outline_at_point(scene((150, 100, 30, 30)), (20.0, 20.0)) is None
    assert outline_at_point(np.full((240, 320, 3), 90, np.uint8), (160.0, 120.0)) is None


@pytest.mark.parametrize("at", [(-1.0, 5.0), (5.0, 240.0)])
def test_a_place_outside_the_picture_shows_nothing(at: tuple[float, float]) -> None:
    assert outline_at_point(scene((150, 100, 30, 30)), at) is None


def test_what_lies_at_a_place_is_seen_at_rest_and_remembered_by_a_copy() -> None:
    healthy = Percept("health", Health(HealthStatus.OK), 0.0, "health")
    fit = Report("health", ReportState.RAN, ("health",), (healthy,))
    one, copy = PlacedObjectBehaviour({"charger": (165.0, 115.0)}), None
    names: list[set[str]] = []
    for n in range(8):
        frame = Frame(n, n / 10, scene((150, 100, 40, 40), seed=n))
        seen = list(one.perceive(frame, Observation(n, n / 10, (320, 240), (fit,)), ()))
        names.append({p.value.name for p in seen if p.kind == "hypothesis"})
        if copy is not None:
            told = copy.perceive(frame, Observation(n, n / 10, (320, 240), (fit,)), ())
            assert [p.kind for p in told] == [p.kind for p in seen]
        if n == 4:
            copy = PlacedObjectBehaviour({"charger": (165.0, 115.0)})
            copy.load(load_state(dump_state(one.save())))
    assert names[-1] == {"charger"}
