"""People by OpenCV's own detector: on a real picture, and on pictures without any."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.paths import SHARED
from visup.agent import Frame, Hypothesis, Observation, Region
from visup.percepts.detections import PeopleBehaviour
from visup.percepts.detections.boxes import intersection_over_union
from visup.percepts.detections.people import person_in

PETS = SHARED / "video" / "mot" / "PETS09-S2L1"


def frame_of(image: np.ndarray) -> Frame:
    return Frame(0, 0.0, np.ascontiguousarray(image, np.uint8))


@pytest.mark.skipif(not PETS.is_dir(), reason="the shared videos are not beside the repo")
def test_most_people_of_a_yard_are_found_and_called_so() -> None:
    picture = cv2.imread(str(PETS / "img1" / "000061.jpg"))
    assert picture is not None
    rows = np.loadtxt(PETS / "gt" / "gt.txt", delimiter=",", usecols=range(6))
    true = [tuple(row[2:6]) for row in rows if row[0] == 61]
    behaviour, frame = PeopleBehaviour(), frame_of(picture)
    seen = list(behaviour.perceive(frame, Observation(0, 0.0, frame.size), ()))
    boxes = [p.value.bbox for p in seen if isinstance(p.value, Region)]
    right = [any(intersection_over_union(box, person) > 0.5 for person in true) for box in boxes]
    assert (
        sum(any(intersection_over_union(box, p) > 0.5 for box in boxes) for p in true)
        >= len(true) / 2
    )
    assert sum(right) >= 0.7 * len(right)
    assert {p.value.name for p in seen if isinstance(p.value, Hypothesis)} == {"person"}


@pytest.mark.parametrize("shape", [(20, 20, 3), (240, 320, 3)])
def test_where_nobody_is_nobody_is_found(shape: tuple[int, int, int]) -> None:
    assert list(PeopleBehaviour().find(frame_of(np.full(shape, 90)))) == []


@given(st.floats(0.3, 4.0), st.floats(0, 500), st.floats(0, 500))
def test_a_person_stands_in_the_middle_of_what_was_found(scale: float, x: float, y: float) -> None:
    left, top, width, height = person_in((x, y, 64, 128), scale)
    assert left + width / 2 == pytest.approx((x + 32) / scale)
    assert top + height / 2 == pytest.approx((y + 64) / scale)
    assert width < 64 / scale
