"""Point tracking from frame to frame: on objects, and all over the image."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.pose import Bytes, Doubles
from visup.percepts.appearance.models.scene import Scene

STILL = np.eye(2, 3)
NO_POINTS = np.zeros((0, 2), dtype=np.float32)
_GRID = 12, 8  # grid of the image; one camera point per cell
WINDOW_PX = 13
"""Side of the window of a tracked point, pixels."""
_BACK = 0.7  # most forward-backward error, pixels


@dataclass(frozen=True, slots=True, eq=False)
class PointMotion:
    """Points of one frame and their positions in the next.

    Attributes:
        before: (N, 2) float32, working pixels of the previous frame.
        after: (N, 2) float32, in this frame.
        owner: (N,) int64, number of the object that each point is on.
    """

    before: NDArray[np.float32]
    after: NDArray[np.float32]
    owner: NDArray[np.int64]

    def of(self, owner: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """The points of one owner, before and after."""
        mine = self.owner == owner
        return self.before[mine], self.after[mine]


def track_points(
    old: Scene, new: Scene, points: NDArray[np.float32], owner: NDArray[np.int64]
) -> PointMotion:
    """Track points; those that fail the forward-backward check are dropped.

    Args:
        old: The previous frame.
        new: The frame.
        points: (N, 2) float32, working pixels of the previous frame.
        owner: (N,) int64, carried along.
    """
    if not len(points):
        return PointMotion(points, points, owner)
    after, found = track_from(old.grey, new.grey, points, points, levels=3)
    return PointMotion(points[found], after[found], owner[found])


def track_from(
    here: Bytes,
    there: Bytes,
    points: NDArray[np.float32],
    guess: NDArray[np.float32],
    *,
    levels: int,
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Track points from one image to another.

    Args:
        here: (h, w) uint8.
        there: (h, w) uint8.
        points: (N, 2) float32, pixels of the first image.
        guess: (N, 2) float32, about where they are in the second one.
        levels: Levels of the pyramid above the image: more of them follow faster motion, but a point on a
            plain surface then follows what moves near it.

    Returns:
        (N, 2) float32 positions in the second image; (N,) bool, whether they pass the forward-backward
        check.
    """
    start = points.reshape(-1, 1, 2)
    follow = partial(
        cv2.calcOpticalFlowPyrLK,
        winSize=(WINDOW_PX, WINDOW_PX),
        maxLevel=levels,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    at, found, _ = follow(here, there, start, guess.reshape(-1, 1, 2).copy())
    back, back_found, _ = follow(there, here, at, start.copy())
    off = np.abs(back - start).reshape(-1, 2).max(axis=1)
    fine = (found.ravel() > 0) & (back_found.ravel() > 0) & (off < _BACK)
    return np.asarray(at.reshape(-1, 2), dtype=np.float32), fine


def grid_points(
    scene: Scene, taken: NDArray[np.bool_] | None, known: NDArray[np.float32] = NO_POINTS
) -> NDArray[np.float32]:
    """(N, 2) float32: the best point to track in each cell of a grid, away from objects.

    Args:
        scene: The frame.
        taken: (h, w) bool, where objects are; None where none are known.
        known: (K, 2) float32, points in whose cells no other is needed, working pixels.
    """
    width, height = scene.size
    strength = cv2.cornerMinEigenVal(cv2.pyrDown(scene.grey), 5)
    if taken is not None:
        small = cv2.resize(
            taken.view(np.uint8), strength.shape[::-1], interpolation=cv2.INTER_NEAREST
        )
        strength[small > 0] = 0
    cols, rows = _GRID
    h, w = strength.shape[0] // rows, strength.shape[1] // cols
    if h < 2 or w < 2:
        return np.zeros((0, 2), dtype=np.float32)
    cells = strength[: h * rows, : w * cols].reshape(rows, h, cols, w).swapaxes(1, 2)
    flat = cells.reshape(rows * cols, h * w)
    best = flat.argmax(axis=1)
    good = flat[np.arange(len(flat)), best] > 1e-5
    x, y = np.clip(known.T // ((2 * w,), (2 * h,)), 0, ((cols - 1,), (rows - 1,))).astype(int)
    good[y * cols + x] = False
    row, col = np.divmod(np.arange(rows * cols), cols)
    y, x = row * h + best // w, col * w + best % w
    at = np.stack([x, y], axis=1)[good] * 2.0 + 0.5
    return np.asarray(np.minimum(at, (width - 1, height - 1)), dtype=np.float32)


def similarity_of(
    before: NDArray[np.float32], after: NDArray[np.float32], off: float
) -> tuple[Doubles, float] | None:
    """The similarity that most points follow, and their share.

    Args:
        before: (N, 2) float32.
        after: (N, 2) float32.
        off: Tolerance of a point, pixels.
    """
    if len(before) < 4:
        return None
    found, fits = cv2.estimateAffinePartial2D(
        before, after, method=cv2.RANSAC, ransacReprojThreshold=off, maxIters=300
    )
    if found is None:
        return None
    return np.asarray(found, dtype=np.float64), float(np.mean(fits))
