"""Camera motion, from points of the static scene.

Points all over the image, away from objects, are tracked from a key frame on, so that slow drift
accumulates until it exceeds the noise. If enough points have moved with the scene during an earlier key
frame, only those are used: an arm that comes into view is not taken for the scene, even if it fills most of
the image.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.point_tracking import (
    NO_POINTS,
    STILL,
    grid_points,
    similarity_of,
    track_points,
)
from visup.percepts.appearance.models.pose import Doubles
from visup.percepts.appearance.models.scene import Scene

KEY_S = 0.5  # lifetime of a key frame, seconds
OFF_PX = 1.0  # tolerance of a scene point about the common motion, working pixels
STATIC_PX = 0.35  # most motion of points since the key frame while the camera rests, working pixels
STATIC_SHARE, AGREEING_SHARE = 0.6, 0.45
"""Shares of the points that must rest, or agree on a motion."""
LEAST = 8  # fewest points for an estimate


@dataclass(frozen=True, slots=True, eq=False)
class CameraTrack:
    """Points of the scene since a key frame.

    Attributes:
        key_time: Time of the key frame, seconds.
        key_points: (N, 2) float32, positions in the key frame, working pixels.
        points: (N, 2) float32, positions in the last frame.
        confirmed: (N,) bool, points that moved with the scene during an earlier key frame.
        motion: (2, 3) similarity of the image from the key frame to the last one; `STILL` itself while
            the camera rests; None while unknown.
    """

    key_time: float = -np.inf
    key_points: NDArray[np.float32] = field(default_factory=lambda: NO_POINTS)
    points: NDArray[np.float32] = field(default_factory=lambda: NO_POINTS)
    confirmed: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    motion: Doubles | None = field(default_factory=lambda: STILL)


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
        pixels: `STILL` itself when the camera rests, None when the points do not agree.
    """
    due = new.time - before.key_time > KEY_S or before.motion is None or len(before.points) < LEAST
    track = _new_key(before, old, taken) if due else before
    moved = track_points(old, new, track.points, np.arange(len(track.points)))
    left = moved.owner
    track = replace(
        track,
        key_points=track.key_points[left],
        points=moved.after,
        confirmed=track.confirmed[left],
    )
    motion = _scene_motion(track)
    return replace(track, motion=motion), _between(track.motion, motion)


def _new_key(before: CameraTrack, old: Scene, taken: NDArray[np.bool_] | None) -> CameraTrack:
    """Start a key frame: retain points of the scene, and add new ones where there are none."""
    with_scene = _moves_with_scene(before)
    if taken is not None and len(before.points):
        at = np.clip(np.round(before.points).astype(int), 0, (old.size[0] - 1, old.size[1] - 1))
        with_scene &= ~taken[at[:, 1], at[:, 0]]
    proven = before.points[with_scene]
    fresh = grid_points(old, taken, proven)
    points = np.concatenate([proven, fresh])
    known = np.arange(len(points)) < len(proven)
    return CameraTrack(old.time, points, points, known)


def _moves_with_scene(track: CameraTrack) -> NDArray[np.bool_]:
    """(N,) bool: points that move with the scene."""
    if track.motion is None:
        return np.zeros(len(track.points), dtype=bool)
    there = track.key_points @ track.motion[:, :2].T + track.motion[:, 2]
    return np.asarray(np.hypot(*(track.points - there).T) < OFF_PX)


def _scene_motion(track: CameraTrack) -> Doubles | None:
    """(2, 3) similarity of the image since the key frame."""
    use = (
        track.confirmed
        if np.count_nonzero(track.confirmed) >= LEAST
        else np.ones(len(track.points), bool)
    )
    key, now = track.key_points[use], track.points[use]
    if len(key) < LEAST:
        return STILL
    if np.mean(np.hypot(*(now - key).T) < STATIC_PX) > STATIC_SHARE:
        return STILL
    found = similarity_of(key, now, OFF_PX)
    if found is None or found[1] <= AGREEING_SHARE:
        return None
    there = key @ found[0][:, :2].T + found[0][:, 2]
    # Motion below the tracking accuracy counts as none, even if some points are hidden or shadowed.
    return STILL if np.hypot(*(there - key).T).max() < STATIC_PX else found[0]


def _between(old: Doubles | None, new: Doubles | None) -> Doubles | None:
    """The similarity from one to another; `STILL` itself where both are."""
    if new is None or old is None:
        return None
    if np.array_equal(old, new):
        return STILL
    linear = np.linalg.inv(old[:, :2])
    both = new[:, :2] @ linear
    return np.column_stack([both, new[:, 2] - both @ old[:, 2]])
