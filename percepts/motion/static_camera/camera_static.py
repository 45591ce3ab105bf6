"""Whether the camera is static, from the motions measured in a frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.layers.affine import STILL, Affine, distances
from visup.percepts.motion.layers.dominant_motion import BALANCE_GRID
from visup.percepts.motion.tracks.measurements import FrameMeasurements

TELLS = 16.0  # least information of a point that would reveal motion, 1 / pixels squared
FITS = 9.0  # squared Mahalanobis distance up to which a point fits a static camera
SPREAD = 0.5  # least share of the grid cells that must hold such points
RESTS = 0.85  # least share of the cells explained by any motion that are at rest when the camera is static
MOVES = 0.6  # the same below which it moves; and least share of all cells that must be at rest
EXPLAINED = 0.5  # share of the cells explained by any motion below which it moves in some other way


def is_camera_static(scene: FrameMeasurements) -> bool | None:
    """Whether the camera is static: points across the whole view, outside of objects, are at rest.

    Noise puts some points off any motion, so rest is compared with the best motion of the background.

    Args:
        scene: Measurements of a frame.

    Returns:
        None when there is too little structure to tell, or the evidence is mixed.
    """
    shares = [_still_shares(scene, i) for i in range(len(scene.measured))]
    known = [s for s in shares if s is not None]
    if any(all_ < EXPLAINED or still < MOVES * all_ for still, all_ in known):
        return False
    rests = all(still >= max(MOVES, RESTS * all_) for still, all_ in known)
    return True if rests and known and len(known) == len(shares) else None


def _still_shares(scene: FrameMeasurements, number: int) -> tuple[float, float] | None:
    """The shares of the cells that fit a static camera, and that fit it or the background's motion."""
    c = scene.measured[number].constraints
    use = c.information[:, 0] + c.information[:, 2] > TELLS
    use &= scene.owner[scene.cell_of(c)] == 0
    rows, cols = BALANCE_GRID
    row = np.clip(c.xy[:, 1] * rows / scene.image.shape[0], 0, rows - 1).astype(np.int64)
    col = np.clip(c.xy[:, 0] * cols / scene.image.shape[1], 0, cols - 1).astype(np.int64)
    place = (row * cols + col)[use]
    all_ = np.bincount(place, minlength=rows * cols)
    filled = all_ >= 2
    if filled.sum() < SPREAD * rows * cols:
        return None

    def fitting(model: Affine) -> NDArray[np.bool_]:
        fits = distances(model, c, 0.15)[use] < FITS
        return (2 * np.bincount(place[fits], minlength=rows * cols) > all_)[filled]

    still = fitting(Affine(STILL))
    explained = still | fitting(scene.measured[number].background.models[-1])
    return float(still.mean()), float(explained.mean())
