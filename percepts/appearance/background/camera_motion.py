"""Camera motion, from points of the static scene.

Points all over the image, away from objects, are tracked from a key frame, so that slow drift accumulates
until it exceeds the noise, and tracking errors do not. If enough points have moved with the scene during
an earlier key frame, only those are used: an arm that comes into view is not taken for the scene, even if it
fills most of the image.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.motion_consensus import (
    PointPairs,
    covariance_at,
    likeliest_motion,
    rest_of,
)
from visup.percepts.appearance.background.point_tracking import (
    NO_POINTS,
    STILL,
    WINDOW_PX,
    grid_points,
    track_from,
)
from visup.percepts.appearance.models.pose import Bytes, Doubles
from visup.percepts.appearance.models.scene import Scene

KEY_S = 0.5  # lifetime of a key frame, seconds
OFF_PX = 1.0  # tolerance of a scene point about the common motion, working pixels
STATIC_PX = 0.35  # most motion since the key frame of a camera that rests, working pixels
RESTING, AGREEING, YOUNG = 0.1, 0.5, 0.75
"""Least shares of the evidence of all points that must agree on rest; on a motion; and on a motion of points
that are neither known to move with the scene nor were followed for some time. In 40 random worlds motions
with more were right, apart from those of waves, which lose their support with time."""
BETTER = 1.5  # factor by which a motion must be better supported than rest
MATURE_S = 0.2  # age of a key frame from which points were followed for some time, seconds
LEAST = 8  # fewest points for an estimate
LEVELS = 2  # of the pyramid in which points are tracked
MARGIN_PX = WINDOW_PX // 2 + 1  # least distance of a point from objects, working pixels


@dataclass(frozen=True, slots=True, eq=False)
class CameraTrack:
    """Points of the scene since a key frame.

    Attributes:
        key_time: Time of the key frame, seconds.
        key_image: (h, w) uint8, its grey levels; None before the first one.
        key_points: (N, 2) float32, positions in the key frame, working pixels.
        points: (N, 2) float32, positions in the last frame.
        covariance: (N, 2, 2) of the positions, pixels².
        confirmed: (N,) bool, points that moved with the scene during an earlier key frame.
        motion: (2, 3) similarity of the image from the key frame to the last one; `STILL` itself while
            the camera rests; None while unknown.
        known: The same when it was known last.
    """

    key_time: float = -np.inf
    key_image: Bytes | None = None
    key_points: NDArray[np.float32] = field(default_factory=lambda: NO_POINTS)
    points: NDArray[np.float32] = field(default_factory=lambda: NO_POINTS)
    covariance: Doubles = field(default_factory=lambda: np.zeros((0, 2, 2)))
    confirmed: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    motion: Doubles | None = field(default_factory=lambda: STILL)
    known: Doubles = field(default_factory=lambda: STILL)


def track_camera(
    before: CameraTrack, old: Scene, new: Scene, taken: NDArray[np.bool_] | None
) -> tuple[CameraTrack, Doubles | None]:
    """Track the scene into the next frame.

    Args:
        before: The points up to the previous frame.
        old: The previous frame.
        new: The frame.
        taken: (h, w) bool, objects in the previous frame; None where none are known.

    Returns:
        The points, and the (2, 3) similarity of the image from the previous frame to this one, working
        pixels: `STILL` itself when the camera rests, None when the points do not agree. The first one after
        that includes the motion of the frames for which it was unknown.
    """
    due = new.time - before.key_time > KEY_S or len(before.points) < LEAST
    track = _new_key(before, old, taken) if due else before
    track = _tracked(track, new)
    motion = scene_motion(track, new.time - track.key_time)
    if motion is None:
        return replace(track, motion=None), None
    return replace(track, motion=motion, known=motion), _between(track.known, motion)


def _new_key(before: CameraTrack, old: Scene, taken: NDArray[np.bool_] | None) -> CameraTrack:
    """Start a key frame: retain points of the scene, and add new ones where there are none."""
    with_scene = _moves_with_scene(before)
    if taken is not None:
        # At its outline, the best points next to an object are those that move with it.
        side = 2 * MARGIN_PX + 1
        taken = cv2.dilate(taken.view(np.uint8), np.ones((side, side), np.uint8)) > 0
        at = np.clip(np.round(before.points).astype(int), 0, (old.size[0] - 1, old.size[1] - 1))
        with_scene &= ~taken[at[:, 1], at[:, 0]]
    proven = before.points[with_scene]
    points = np.concatenate([proven, grid_points(old, taken, proven)])
    return CameraTrack(
        key_time=old.time,
        key_image=old.grey,
        key_points=points,
        points=points,
        covariance=covariance_at(old.grey, points, WINDOW_PX),
        confirmed=np.arange(len(points)) < len(proven),
    )


def _tracked(track: CameraTrack, new: Scene) -> CameraTrack:
    """The points in a new frame, without those that are lost."""
    if track.key_image is None or not len(track.points):
        return track
    points, found = track_from(
        track.key_image, new.grey, track.key_points, track.points, levels=LEVELS
    )
    return replace(
        track,
        key_points=track.key_points[found],
        points=points[found],
        covariance=track.covariance[found],
        confirmed=track.confirmed[found],
    )


def _moves_with_scene(track: CameraTrack) -> NDArray[np.bool_]:
    """(N,) bool: points that move with the scene."""
    if track.motion is None:
        return np.zeros(len(track.points), dtype=bool)
    off = track.points - _moved(track.key_points, track.motion)
    return np.asarray(np.hypot(*off.T) < OFF_PX)


def scene_motion(track: CameraTrack, age_s: float) -> Doubles | None:
    """The motion of the image since the key frame.

    Args:
        track: The points, as tracked now.
        age_s: Time since the key frame, seconds.

    Returns:
        (2, 3) similarity, working pixels: `STILL` itself at rest, None if the points do not agree.
    """
    proven = int(np.count_nonzero(track.confirmed)) >= LEAST
    use = track.confirmed if proven else np.ones(len(track.points), bool)
    pairs = PointPairs(
        track.key_points[use].astype(float), track.points[use].astype(float), track.covariance[use]
    )
    if len(pairs.key) < LEAST:
        return STILL
    found = likeliest_motion(pairs, BETTER)
    least = AGREEING if proven or age_s >= MATURE_S else YOUNG
    if found.support < least * pairs.total:
        found = rest_of(pairs)
        if found.support < RESTING * pairs.total:
            return None
    # Motion below the tracking accuracy counts as none, even if some points are hidden or shadowed.
    shift = np.hypot(*(_moved(pairs.key, found.motion) - pairs.key).T).max()
    return STILL if shift < STATIC_PX else found.motion


def _moved(points: NDArray[Any], motion: Doubles) -> Doubles:
    moved: Doubles = points @ motion[:, :2].T + motion[:, 2]
    return moved


def _between(old: Doubles, new: Doubles) -> Doubles:
    """The similarity from one to another; `STILL` itself where both are."""
    if np.array_equal(old, new):
        return STILL
    linear = np.linalg.inv(old[:, :2])
    both = new[:, :2] @ linear
    return np.column_stack([both, new[:, 2] - both @ old[:, 2]])
