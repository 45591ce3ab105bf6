"""Regions of taught objects in frame pixels."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from visup.agent import Region
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.pose import Doubles
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.track import TaughtObjectTrack, TrackState
from visup.percepts.motion.outlines.region_outline import RegionOutline, describe_mask

VELOCITY_WINDOW_S = 0.2  # time over which a velocity is measured, seconds
JITTER_PX = 0.5  # error of a pose, working pixels
MIN_SIGMA = 0.5  # pixels per second


def object_outline(blob: Blob, scene: Scene) -> RegionOutline | None:
    """A blob of the working image in frame pixels; None when nothing remains."""
    mask, origin = _in_frame_pixels(blob, scene)
    return describe_mask(mask, origin, scene.frame_size) if mask.any() else None


def object_region(
    track: TaughtObjectTrack, shape: RegionOutline, scene: Scene, last: float | None
) -> Region:
    """The reported region of an object.

    Args:
        track: The track of the object.
        shape: Its visible outline.
        scene: The frame.
        last: Time of the previous frame, seconds; None when there was none.

    Returns:
        Its region in frame pixels.
    """
    velocity, sigma = _velocity(track, scene.scale, shape.centroid)
    region = shape.region(track.id, velocity, sigma, confidence(track))
    return replace(region, motion=_motion(track, scene.scale, last), visible_since=track.first_seen)


def confidence(track: TaughtObjectTrack) -> float:
    """Confidence that this is the object: it was recognised, and still looks as expected."""
    return float(0.7 + 0.3 * np.clip(track.peak, 0, 1) * track.explained_share)


def _in_frame_pixels(
    blob: Blob, scene: Scene
) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.bool_]], tuple[int, int]]:
    """A mask of the working image in frame pixels, and its corner there."""
    width, height = scene.frame_size
    if scene.size == scene.frame_size:
        return blob.mask, blob.window[:2]
    by = width / scene.size[0], height / scene.size[1]
    left, top, right, bottom = blob.window
    x0, y0 = round(left * by[0]), round(top * by[1])
    x1, y1 = min(round(right * by[0]), width), min(round(bottom * by[1]), height)
    soft = blob.mask.astype(np.float32)
    return np.asarray(cv2.resize(soft, (x1 - x0, y1 - y0)) > 0.5), (x0, y0)


def _velocity(
    track: TaughtObjectTrack, scale: float, at: tuple[float, float]
) -> tuple[tuple[float, float], float]:
    """(vx, vy) of a point of an object and its standard deviation, frame pixels per second."""
    if len(track.path) < 2:
        return (0.0, 0.0), 0.0
    now, pose = track.path[-1]
    before = next(p for p in track.path if now - p[0] <= VELOCITY_WINDOW_S + 1e-6)
    span = now - before[0]
    if span <= 0:
        return (0.0, 0.0), 0.0
    sigma = max(JITTER_PX / scale / span, MIN_SIGMA)
    if track.state is TrackState.RESTING:
        return (0.0, 0.0), sigma
    back = pose.motion_to(before[1])
    x, y = at[0] * scale, at[1] * scale
    was = back[:, :2] @ (x, y) + back[:, 2]
    return (float((x - was[0]) / scale / span), float((y - was[1]) / scale / span)), sigma


def _motion(track: TaughtObjectTrack, scale: float, last: float | None) -> Doubles | None:
    """(2, 3) affine from the previous frame to this one, frame pixels."""
    if last is None or len(track.path) < 2 or track.path[-2][0] < last - 1e-6:
        return None
    out = track.path[-2][1].motion_to(track.path[-1][1])
    out[:, 2] /= scale
    return out
