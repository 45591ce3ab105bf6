"""Deformation of an appearance with tracked points, for objects whose parts move about joints: arms, hands.

A pose says how an object moved as a whole. What its points moved beyond that is interpolated between them by
inverse distances (Shepard 1968), and warps the mask and the pixels.

*Approximation*: the warp is smooth and follows corners only. At a joint it mixes the motions of both links,
and a plain link without corners goes with the nearest ones.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.pose import Doubles, PatchPose

Floats = NDArray[np.float32]
Points = tuple[Floats, Floats]

MIN_POINTS = 8  # fewest points that tell a deformation
MIN_BEND = 0.3  # least deformation worth a warp, patch pixels
MAX_DISAGREEMENT = 1.5  # most that a point deviates from its neighbours, patch pixels
_NEIGHBOURS = 5  # points whose median motion is taken, with the point itself
_STEP = 4  # patch pixels from one interpolated value to the next
_SOFTENING = np.float32(2.0)  # distance below which a point hardly weighs more, patch pixels


def point_deformations(
    shape: tuple[int, int], before: PatchPose, after: PatchPose, points: Points
) -> Points | None:
    """What an object's points moved beyond the motion of its pose.

    Args:
        shape: (height, width) of the object's patch.
        before: Its pose in the previous frame.
        after: Its pose in this frame.
        points: (N, 2) float32, its points in the previous and in this frame, working pixels.

    Returns:
        (M, 2) float32 twice, patch pixels: where points are now, and (dx, dy) that they moved beyond the
        pose; None when too few points agree with their neighbours, or they move as the pose does.
    """
    if len(points[0]) < MIN_POINTS:
        return None
    at = _in_patch(points[0], before, shape)
    moved = _in_patch(points[1], after, shape)
    bend = _smoothed(at, moved - at)
    agree = np.linalg.norm(moved - at - bend, axis=1) < MAX_DISAGREEMENT
    if np.count_nonzero(agree) < MIN_POINTS:
        return None
    at, bend = at[agree], bend[agree]
    if np.quantile(np.linalg.norm(bend, axis=1), 0.8) < MIN_BEND:
        return None
    return at + bend, bend


def deformation(
    shape: tuple[int, int], before: PatchPose, after: PatchPose, points: Points
) -> Floats | None:
    """(h, w, 2) float32, (dx, dy): motion of what is now at each pixel beyond its pose, patch pixels.

    Arguments as for `point_deformations`; None in the same cases.
    """
    found = point_deformations(shape, before, after, points)
    return None if found is None else _interpolated(*found, shape)


def deformed(appearance: Appearance, motion: Floats) -> Appearance:
    """An appearance whose mask and pixels have moved by (h, w, 2) float32; the filter is not changed."""
    y, x = np.mgrid[: motion.shape[0], : motion.shape[1]].astype(np.float32)
    x, y = x - motion[..., 0], y - motion[..., 1]
    mask = cv2.remap(appearance.mask, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    lab = cv2.remap(appearance.lab, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return replace(
        appearance, mask=np.asarray(mask, dtype=np.float32), lab=np.asarray(lab, dtype=np.uint8)
    )


def with_former_size(pose: PatchPose, old: PatchPose, points: Points, camera: Doubles) -> PatchPose:
    """A pose estimated from points, with a scale that changes with the camera only.

    The points of an arm that folds come closer together, but the arm does not become smaller.

    Args:
        pose: The estimated pose.
        old: The pose in the previous frame.
        points: (N, 2) float32, points in the previous and in this frame, working pixels.
        camera: (2, 3) similarity of the image since then.

    Returns:
        The pose with that scale, shifted so that the points on either side of it balance (by the median).
    """
    pose = replace(pose, scale=old.moved(camera).scale)
    carried = old.motion_to(pose)
    before, after = points
    left = np.median(after - before @ carried[:, :2].T - carried[:, 2], axis=0)
    return replace(pose, x=pose.x + float(left[0]), y=pose.y + float(left[1]))


def _in_patch(points: Floats, pose: PatchPose, shape: tuple[int, int]) -> Floats:
    """(N, 2) float32: points of the image in the patch at a pose."""
    inverse = cv2.invertAffineTransform(pose.matrix(shape))
    return (points @ inverse[:, :2].T + inverse[:, 2]).astype(np.float32)


def _smoothed(at: Floats, motion: Floats) -> Floats:
    """(N, 2) float32: the median motion of each point and its nearest neighbours."""
    distance = np.linalg.norm(at[:, None] - at[None], axis=2)
    nearest = distance.argsort(axis=1, kind="stable")[:, :_NEIGHBOURS]
    return np.asarray(np.median(motion[nearest], axis=1), dtype=np.float32)


def _interpolated(at: Floats, values: Floats, shape: tuple[int, int]) -> Floats:
    """(h, w, 2) float32: values at points, interpolated by inverse distances to the fourth power."""
    height, width = shape
    y, x = np.mgrid[:height:_STEP, :width:_STEP].astype(np.float32)
    square = (x[..., None] - at[:, 0]) ** 2 + (y[..., None] - at[:, 1]) ** 2
    weight = (square + _SOFTENING**2) ** -2
    coarse = (weight @ values) / weight.sum(axis=-1, keepdims=True)
    size = coarse.shape[1] * _STEP, coarse.shape[0] * _STEP
    full = cv2.resize(coarse, size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(full[:height, :width], dtype=np.float32)
