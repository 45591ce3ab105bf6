"""Pixels of the objects in view."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.redetection import footprint
from visup.percepts.appearance.tracking.track import IN_VIEW, TaughtObjectTrack


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
