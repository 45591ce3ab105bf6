from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.clips import texture
from visup.agent import Frame
from visup.percepts.motion.features.motion_constraints import CORNER, Points, find_points
from visup.percepts.motion.features.work_image import prepare_image

SHAPE = (120, 160)


def points_of(image: np.ndarray) -> Points:
    return find_points(prepare_image(Frame(0, 0.0, image.astype(np.uint8)), 512), 8, 1.0)


@given(st.integers(0, 99), st.floats(0, np.pi))
@settings(deadline=None, max_examples=15)
def test_corners_are_told_by_the_eigenvalues_of_the_structure_tensor(
    seed: int, angle: float
) -> None:
    stretched = cv2.GaussianBlur(texture(seed, SHAPE), (1, 31), 0)
    for image in (texture(seed, SHAPE), stretched, slope(angle)):
        points = points_of(image)
        xx, xy, yy = points.tensor.T.astype(np.float64)
        each = np.linalg.eigvalsh(np.stack([xx, xy, xy, yy], axis=1).reshape(-1, 2, 2))
        ratio = each[:, 0] / each[:, 1]
        clear = np.abs(ratio - CORNER) > 1e-3
        assert np.array_equal(points.corners()[clear], ratio[clear] > CORNER)


def slope(angle: float) -> np.ndarray:
    """One straight edge through the middle."""
    ys, xs = np.mgrid[: SHAPE[0], : SHAPE[1]]
    side = (xs - SHAPE[1] / 2) * np.cos(angle) + (ys - SHAPE[0] / 2) * np.sin(angle)
    return np.asarray(127 + 80 * np.tanh(side))


@pytest.mark.parametrize("angle", [0.0, 0.6, 1.2, 2.5])
def test_a_straight_edge_has_no_corner_and_a_texture_has_many(angle: float) -> None:
    edge, skin = points_of(slope(angle)), points_of(texture(1, SHAPE))
    assert len(edge) >= 10
    assert not edge.corners().any()
    assert skin.corners().mean() > 0.8
