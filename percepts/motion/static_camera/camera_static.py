"""Whether the camera is static, from the motions measured in a frame."""

from __future__ import annotations

import numpy as np

from visup.percepts.motion.layers._dominant_motion_jit import grid_cells
from visup.percepts.motion.layers.affine import STILL, Affine, distances
from visup.percepts.motion.layers.dominant_motion import BALANCE_GRID
from visup.percepts.motion.tracks.measurements import FrameMeasurements

MIN_INFORMATION = 16.0
"""Least information of a point that would reveal motion, 1 / pixels squared."""
REST_DISTANCE = 9.0  # squared Mahalanobis distance up to which a point fits a static camera
MIN_FILLED = 0.5  # least share of the grid cells that must hold points with that information
STATIC_SHARE = 0.85  # least share of those cells that fit when the camera is static
MOVING_SHARE = 0.6  # share of those cells below which the camera moves


def is_camera_static(scene: FrameMeasurements) -> bool | None:
    """Whether the camera is static: points across the whole view, outside of objects, are at rest.

    Args:
        scene: Measurements of a frame.

    Returns:
        True or False; None when there is too little structure, or the evidence is mixed.
    """
    shares = [_still_share(scene, i) for i in range(len(scene.measured))]
    if any(s is not None and s < MOVING_SHARE for s in shares):
        return False
    return True if shares and all(s is not None and s >= STATIC_SHARE for s in shares) else None


def _still_share(scene: FrameMeasurements, number: int) -> float | None:
    """Share of the grid cells at rest in one measurement; None if too few cells hold points."""
    c = scene.measured[number].constraints
    use = c.information[:, 0] + c.information[:, 2] > MIN_INFORMATION
    use &= scene.owner[scene.cell_of(c)] == 0
    rows, cols = BALANCE_GRID
    place = grid_cells(c.xy, scene.image.shape, BALANCE_GRID)[use]
    fits = distances(Affine(STILL), c, 0.15)[use] < REST_DISTANCE
    all_ = np.bincount(place, minlength=rows * cols)
    rest = np.bincount(place[fits], minlength=rows * cols)
    filled = all_ >= 2
    if filled.sum() < MIN_FILLED * rows * cols:
        return None
    return float(np.mean(rest[filled] > 0.5 * all_[filled]))
