"""Pixels of the objects in view, and points on them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.colours import ColourModel, colour_bins
from visup.percepts.appearance.models.deformation import Points
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.redetection import footprint
from visup.percepts.appearance.tracking.track import IN_VIEW, TaughtObjectTrack

POINTS = 48  # most points tracked on each object
MIN_SPACING_PX = 3.0  # least distance of two of them, working pixels
MIN_SPACING = 0.05  # the same, as a share of the root of the object's area
MIN_QUALITY = 0.01  # least strength of a corner, as a share of the object's strongest
_REACH = 2  # pixels around a point whose colours are looked at, in each direction
_AROUND = np.indices((2 * _REACH + 1, 2 * _REACH + 1)).reshape(2, -1).T - _REACH


def visible_pixels(tracks: Sequence[TaughtObjectTrack], scene: Scene) -> dict[str, Blob]:
    """The visible pixels of the objects that are seen in a frame, by the key of their track."""
    seen = (t for t in tracks if t.state in IN_VIEW and t.last_seen == scene.time)
    return {t.key: t.visible for t in seen if t.visible is not None}


def object_mask(tracks: Sequence[TaughtObjectTrack], scene: Scene) -> NDArray[np.bool_]:
    """(h, w) bool: visible objects."""
    out = np.zeros(scene.size[::-1], dtype=bool)
    for t in tracks:
        if t.visible is not None:
            left, top, right, bottom = t.visible.window
            out[top:bottom, left:right] |= t.visible.mask
    return out


def occupied_blobs(track: TaughtObjectTrack, scene: Scene) -> Iterator[Blob]:
    """Blobs of an object in view; one just redetected has no pixels of its own yet."""
    if track.visible is not None:
        yield track.visible
    elif track.last_seen == scene.time and track.pose is not None and track.appearance is not None:
        covered = footprint(scene, track.pose, track.appearance)
        if covered is not None:
            yield covered


def points_on(scene: Scene, blob: Blob) -> NDArray[np.float32]:
    """(N, 2) float32: trackable points of an object, spread over it."""
    left, top, right, bottom = blob.window
    inner = cv2.erode(blob.mask.view(np.uint8), np.ones((3, 3), np.uint8))
    grey = np.ascontiguousarray(scene.grey[top:bottom, left:right])
    spacing = max(MIN_SPACING_PX, MIN_SPACING * float(np.sqrt(blob.area)))
    found = cv2.goodFeaturesToTrack(grey, POINTS, MIN_QUALITY, spacing, mask=inner)
    if found is None:
        return np.zeros((0, 2), dtype=np.float32)
    return np.asarray(found.reshape(-1, 2) + np.array([left, top]), dtype=np.float32)


def points_of_own_colour(scene: Scene, points: Points, colours: ColourModel) -> Points:
    """The points around which an object's colours outweigh those of its surroundings.

    Others may be on the background, which a mask that is a little too large shows.

    Args:
        scene: The frame.
        points: (N, 2) float32, points of the object in the previous frame and in this one, working pixels.
        colours: Its colours.
    """
    before, after = points
    at = np.round(after).astype(np.int64)[:, None] + _AROUND
    at = np.clip(at, 0, np.array(scene.size) - 1)
    odds = colours.odds(colour_bins(scene.lab[0][at[..., 1], at[..., 0]]))
    own = odds.mean(axis=1) > 0
    return before[own], after[own]
