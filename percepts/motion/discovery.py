"""New layers: groups of constraints that no known layer explains, and layers that prove to be one."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.background import Background
from visup.percepts.motion.constraints import Constraints
from visup.percepts.motion.image import Floats
from visup.percepts.motion.layers import Affine, distances, fit_affine
from visup.percepts.motion.tracking import Rate, Track

LEAST_POINTS = 6
ALIKE = 6.0  # median squared Mahalanobis distance under which two motions are one


def unexplained(
    c: Constraints, background: Background, tracks: Sequence[Track], owner: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which constraints outside all tracks move as no layer does, (N,) bool."""
    x, y = c.xy.astype(np.int64).T
    out = (owner[y, x] == 0) & (background.distances(c) > 16)
    for t in tracks:
        if out.any():
            model = t.predicted(c.lag, c.span_s)
            reach = cv2.dilate((t.memory > 0.5).astype(np.uint8), np.ones((33, 33), np.uint8))
            out &= ~((distances(model, c, 0.15) < 16) & (reach[y, x] > 0))
    return np.asarray(out)


def groups(xy: Floats, shape: tuple[int, int], cell: int) -> NDArray[np.int32]:
    """Number of the spatial group of each position, from 1; gaps of three cells are bridged."""
    rows, cols = shape[0] // cell + 1, shape[1] // cell + 1
    row, col = (xy[:, 1] // cell).astype(np.int64), (xy[:, 0] // cell).astype(np.int64)
    taken = np.zeros((rows, cols), dtype=np.uint8)
    taken[row, col] = 1
    bridged = cv2.dilate(taken, np.ones((4, 4), np.uint8))
    _, labels = cv2.connectedComponents(bridged, connectivity=8)
    return np.asarray(labels[row, col], dtype=np.int32)


def discover(
    c: Constraints, free: NDArray[np.bool_], shape: tuple[int, int], cell: int
) -> list[tuple[Affine, Floats]]:
    """Motions of groups of constraints that belong together.

    Args:
        c: N constraints over one baseline.
        free: (N,) bool, those that no layer explains.
        shape: (h, w) of the image.
        cell: Spacing of the constraints, pixels.

    Returns:
        For each new layer its displacement over the baseline and a (h, w) float32 map of where its
        constraints lie.
    """
    out = []
    index = np.flatnonzero(free)
    if len(index) < LEAST_POINTS:
        return []
    number = groups(c.xy[index], shape, cell)
    for g in range(1, int(number.max()) + 1):
        left = index[number == g]
        # A group may hold more than one motion: what the first does not explain is tried again.
        for _ in range(3):
            if len(left) < LEAST_POINTS:
                break
            weight = np.zeros(len(c), dtype=np.float32)
            weight[left] = 1
            model = fit_affine(c, weight, _middle(c, left), rigidity=10.0, rounds=6)
            fits = distances(model, c, 0.15)[left] < 9
            if np.count_nonzero(fits) < LEAST_POINTS:
                break
            out.append((model, _place(c.xy[left[fits]], shape, cell)))
            left = left[~fits]
    return out


def _middle(c: Constraints, index: NDArray[np.int64]) -> Affine:
    """Constant motion to start from: the median over the constraints."""
    matrix = np.zeros((2, 3))
    matrix[:, 2] = np.median(c.moved[index], axis=0)
    return Affine(matrix)


def _place(xy: Floats, shape: tuple[int, int], cell: int) -> Floats:
    out = np.zeros(shape, dtype=np.uint8)
    x, y = xy.astype(np.int64).T
    out[y, x] = 1
    size = 2 * cell + 1
    return np.asarray(cv2.dilate(out, np.ones((size, size), np.uint8)), dtype=np.float32) * 0.7


def rate_of(model: Affine, c: Constraints, now: float) -> Rate:
    """A displacement over a baseline as a motion per second."""
    return Rate(model.matrix / c.span_s, max(model.sigma, 0.02) / c.span_s, now, c.span_s)


def same_motion(
    a: Track, b: Track, c: Constraints, owner: NDArray[np.int64], keys: tuple[int, int]
) -> bool | None:
    """Whether one motion explains the constraints of two tracks.

    Args:
        a: One track.
        b: The other.
        c: Constraints over one baseline.
        owner: (h, w) labels.
        keys: The labels of the two tracks.

    Returns:
        None when there is too little to tell.
    """
    x, y = c.xy.astype(np.int64).T
    at = owner[y, x]
    in_a, in_b = at == keys[0], at == keys[1]
    if min(in_a.sum(), in_b.sum()) < 4:
        return None
    start = a.predicted(c.lag, c.span_s)
    both = fit_affine(c, (in_a | in_b).astype(np.float32), start)
    m2 = distances(both, c, 0.15)
    return bool(np.median(m2[in_a]) < ALIKE and np.median(m2[in_b]) < ALIKE)
