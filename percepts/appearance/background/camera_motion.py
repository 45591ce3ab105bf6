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
PRECISE_PX, PRECISE_SHARE = 0.5, 0.1
"""Tolerance of points that follow a motion precisely, working pixels; least share of such points."""
REST_SHARE = 0.2  # least share of points at rest in a new key frame
BETTER = 1.5  # factor by which a less simple motion must explain more points
MATURE_S = 0.4  # age of a key frame from which few points suffice, seconds
LEAST = 8  # fewest points for an estimate


Points = NDArray[np.float32]


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
        known: The same when it was known last.
    """

    key_time: float = -np.inf
    key_points: NDArray[np.float32] = field(default_factory=lambda: NO_POINTS)
    points: NDArray[np.float32] = field(default_factory=lambda: NO_POINTS)
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
    moved = track_points(old, new, track.points, np.arange(len(track.points)))
    left = moved.owner
    track = replace(
        track,
        key_points=track.key_points[left],
        points=moved.after,
        confirmed=track.confirmed[left],
    )
    motion = _scene_motion(track, new.time - track.key_time)
    if motion is None:
        return replace(track, motion=None), None
    return replace(track, motion=motion, known=motion), _between(track.known, motion)


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


def _scene_motion(track: CameraTrack, age_s: float) -> Doubles | None:
    """(2, 3) similarity of the image since the key frame, which is so old."""
    proven = int(np.count_nonzero(track.confirmed)) >= LEAST
    use = track.confirmed if proven else np.ones(len(track.points), bool)
    key, now = track.key_points[use], track.points[use]
    if len(key) < LEAST:
        return STILL
    found = _simplest_motion(key, now, mature=proven or age_s >= MATURE_S)
    if found is None:
        return None
    # Motion below the tracking accuracy counts as none, even if some points are hidden or shadowed.
    return STILL if np.hypot(*(_moved(key, found) - key).T).max() < STATIC_PX else found


def _simplest_motion(key: Points, now: Points, *, mature: bool) -> Doubles | None:
    """The motion that explains the most points precisely, the simplest of those that are about as good.

    Water, leaves and crowds move in many ways, but what moves with the camera follows one motion precisely.
    For a moment, however, many of them seem to agree.

    Args:
        key: (N, 2) float32, positions in the key frame, working pixels.
        now: (N, 2) float32, positions now.
        mature: Whether a few points suffice, since they are known to move with the scene, or were followed
            for long enough.

    Returns:
        (2, 3) similarity; `STILL` itself for none; None if no motion explains enough points.
    """
    best, most = STILL, _explained(key, now, STILL)
    if most > STATIC_SHARE * len(key):
        return STILL
    for motion in (_common_shift(key, now), _similarity(key, now, PRECISE_PX, PRECISE_SHARE)):
        count = 0 if motion is None else _explained(key, now, motion)
        if motion is not None and count > BETTER * most:
            best, most = motion, count
    share = PRECISE_SHARE if mature else REST_SHARE if best is STILL else AGREEING_SHARE
    if most >= max(LEAST, share * len(key)):
        return best
    return _similarity(key, now, OFF_PX, AGREEING_SHARE) if mature else None


def _common_shift(key: Points, now: Points) -> Doubles:
    """(2, 3): the translation that explains the most points."""
    shifts = (now - key).astype(np.float64)
    near = np.hypot(*(shifts[:, None] - shifts).transpose(2, 0, 1)) < STATIC_PX
    middle = shifts[near[int(near.sum(axis=1).argmax())]].mean(axis=0)
    return np.column_stack([np.eye(2), middle])


def _similarity(key: Points, now: Points, tolerance: float, share: float) -> Doubles | None:
    """(2, 3): the similarity that more than a share of the points follow; None if there is none."""
    found = similarity_of(key, now, tolerance)
    return found[0] if found is not None and found[1] > share else None


def _explained(key: Points, now: Points, motion: Doubles) -> int:
    """Number of points that follow a motion precisely."""
    return int(np.count_nonzero(np.hypot(*(now - _moved(key, motion)).T) < STATIC_PX))


def _moved(points: Points, motion: Doubles) -> Doubles:
    moved: Doubles = points @ motion[:, :2].T + motion[:, 2]
    return moved


def _between(old: Doubles, new: Doubles) -> Doubles:
    """The similarity from one to another; `STILL` itself where both are."""
    if np.array_equal(old, new):
        return STILL
    linear = np.linalg.inv(old[:, :2])
    both = new[:, :2] @ linear
    return np.column_stack([both, new[:, 2] - both @ old[:, 2]])
