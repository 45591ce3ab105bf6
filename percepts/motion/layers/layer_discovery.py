"""Discovery of layers in constraints that no known layer explains, and a test whether two are one."""

from __future__ import annotations

from math import hypot

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.motion_constraints import Constraints
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers._affine_jit import median
from visup.percepts.motion.layers.affine import Affine, distances, fit_affine
from visup.percepts.motion.layers.affine_rate import AffineRate

MIN_POINTS = 8
ALIKE = 6.0  # median squared Mahalanobis distance below which two motions are the same


def spatial_groups(xy: Floats, shape: tuple[int, int], cell: int) -> NDArray[np.int32]:
    """Number of the spatial group of each position, from 1; gaps of three cells are bridged."""
    rows, cols = shape[0] // cell + 1, shape[1] // cell + 1
    row, col = (xy[:, 1] // cell).astype(np.int64), (xy[:, 0] // cell).astype(np.int64)
    taken = np.zeros((rows, cols), dtype=np.uint8)
    taken[row, col] = 1
    bridged = cv2.dilate(taken, np.ones((5, 5), np.uint8))
    _, labels = cv2.connectedComponents(bridged, connectivity=8)
    return np.asarray(labels[row, col], dtype=np.int32)


def discover_layers(
    c: Constraints, free: NDArray[np.bool_], shape: tuple[int, int], cell: int
) -> list[tuple[Affine, NDArray[np.int64]]]:
    """Motions of groups of constraints that belong together.

    Args:
        c: N constraints over one baseline.
        free: (N,) bool, those that no layer explains.
        shape: (h, w) of the image.
        cell: Spacing of the constraints, pixels.

    Returns:
        For each new layer its displacement over the baseline and which constraints it rests on.
    """
    out = []
    index = np.flatnonzero(free)
    if len(index) < MIN_POINTS:
        return []
    number = spatial_groups(c.xy[index], shape, cell)
    for g in range(1, int(number.max()) + 1):
        left = index[number == g]
        # A group may hold several motions: constraints that the first does not explain are tried again.
        for _ in range(3):
            if len(left) < MIN_POINTS:
                break
            weight = np.zeros(len(c), dtype=np.float32)
            weight[left] = 1
            start = median_motion(c, left)
            slack = layer_slack(start)
            model = fit_affine(c, weight, start, rigidity=10.0, rounds=6, slack=slack)
            fits = distances(model, c, slack)[left] < 9
            if np.count_nonzero(fits) < max(MIN_POINTS, 0.5 * len(left)):
                break
            out.append((model, left[fits]))
            left = left[~fits]
    return out


def layer_slack(model: Affine, where: tuple[float, float] = (0.0, 0.0)) -> float:
    """Error to allow for a layer, pixels: large motions are seldom quite planar.

    Args:
        model: The layer's displacement over a baseline.
        where: (x, y) centre of the layer, pixels.

    Returns:
        Standard deviation, pixels.
    """
    return 0.1 + 0.05 * hypot(*model.shift(where))


def median_motion(c: Constraints, index: NDArray[np.int64]) -> Affine:
    """Constant motion to start from: the median over the constraints."""
    matrix = np.zeros((2, 3))
    moved = c.moved[index]
    matrix[:, 2] = median(moved[:, 0].copy()), median(moved[:, 1].copy())
    return Affine(matrix)


def affine_rate(model: Affine, c: Constraints, now: float) -> AffineRate:
    """A displacement over a baseline as a motion per second."""
    bend = None if model.bend is None else model.bend / c.span_s
    sigma = max(model.sigma, 0.02) / c.span_s
    return AffineRate(model.matrix / c.span_s, sigma, now, c.span_s, bend)


def same_motion(
    c: Constraints, in_a: NDArray[np.bool_], in_b: NDArray[np.bool_], start: Affine, slack: float
) -> bool | None:
    """Whether one motion explains the constraints of two tracks.

    Args:
        c: Constraints over one baseline.
        in_a: (N,) bool, those of one track.
        in_b: (N,) bool, those of the other.
        start: Motion to start from.
        slack: Error to allow, pixels.

    Returns:
        None when there is too little to tell.
    """
    if min(np.count_nonzero(in_a), np.count_nonzero(in_b)) < 4:
        return None
    joint = fit_affine(c, (in_a | in_b).astype(np.float32), start, slack=slack)
    m2 = distances(joint, c, slack)
    return median(m2[in_a]) < ALIKE and median(m2[in_b]) < ALIKE
