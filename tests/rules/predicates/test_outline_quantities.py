"""Which way outlines lie, and how open they are."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.predicates.test_certainty import mind_of
from tests.rules.scenes import box_region
from visup.agent import Mind, Presence
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES

JAWS = [(0, 0), (60, 0), (60, 10), (10, 10), (10, 40), (60, 40), (60, 50), (0, 50)]
CLOSED = [(0, 0), (60, 0), (60, 50), (0, 50)]


def bar(degrees: float, length: float = 80.0, width: float = 20.0) -> np.ndarray:
    """The corners of a bar that lies along a direction, 90 up."""
    along = np.array([np.cos(np.radians(degrees)), -np.sin(np.radians(degrees))])
    across = np.array([-along[1], along[0]])
    ends = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return np.array([200 + a * length / 2 * along + b * width / 2 * across for a, b in ends])


def outlined(*contours: np.ndarray) -> Mind:
    mind = mind_of(*[(100, 100, 90, 90)] * len(contours))
    for number, contour in enumerate(contours, 1):
        belief = mind.objects[number]
        region = replace(belief.region, contour=np.asarray(contour, dtype=np.float32))
        mind = mind.with_objects(replace(belief, region=region))
    return mind


def quantity(mind: Mind, name: str) -> np.ndarray:
    return QUANTITIES[name].evaluate(Snapshot(mind))


@given(st.floats(0.0, 179.0), st.floats(0.0, 179.0))
def test_orientation_and_angle_of_bars_are_measured(a: float, b: float) -> None:
    mind = outlined(bar(a), bar(b))
    found = quantity(mind, "orientation")[0]
    assert np.allclose((found - [a, b] + 90) % 180, 90, atol=0.2)
    turn = abs(a - b)
    between = min(turn, 180 - turn)
    assert quantity(mind, "axis_angle")[:, 0, 1] == pytest.approx([between] * 2, abs=0.3)
    truth = PREDICATES["aligned"].evaluate(Snapshot(mind))[0, 1]
    if between < 9.5 or between > 15.5:
        assert truth == (1 if between < 12 else -1)
    elif 10.5 < between < 14.5:
        assert truth == 0


def test_round_or_hidden_objects_have_no_orientation() -> None:
    mind = outlined(bar(30, 40, 40), bar(30))
    assert quantity(mind, "orientation")[:, 0].tolist() == [-inf, inf]
    assert quantity(mind, "axis_angle")[:, 0, 1].tolist() == [-inf, inf]
    assert PREDICATES["aligned"].evaluate(Snapshot(mind))[0, 1] == 0
    hidden = mind.with_objects(replace(mind.objects[2], presence=Presence.HIDDEN))
    assert quantity(hidden, "orientation")[:, 1].tolist() == [-inf, inf]
    assert quantity(hidden, "openness")[:, 1].tolist() == [-inf, inf]


def test_open_jaws_have_greater_openness_than_closed_ones() -> None:
    mind = outlined(np.array(JAWS), np.array(CLOSED))
    assert quantity(mind, "openness")[0] == pytest.approx([0.5, 0.0], abs=0.01)


def test_adjacent_objects_share_an_outline() -> None:
    mind = mind_of((100, 100, 60, 60), (300, 110, 40, 40), (500, 100, 40, 40))
    beside = box_region(2, (160.0, 110.0, 40.0, 40.0))
    assert beside is not None
    mind = mind.with_objects(replace(mind.objects[2], region=beside))
    found = quantity(mind, "shared_outline")
    assert found[:, 0, 1] == pytest.approx([0.29, 0.29], abs=0.05)
    assert found[:, 1, 0].tolist() == found[:, 0, 1].tolist()
    assert found[:, 0, 2].tolist() == [0.0, 0.0]
    hidden = mind.with_objects(replace(mind.objects[2], presence=Presence.HIDDEN))
    assert quantity(hidden, "shared_outline")[:, 0, 1].tolist() == [-inf, inf]
