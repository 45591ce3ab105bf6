"""Where the image has changed recently, which is where moving objects are searched for first."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.point_tracking import STILL
from visup.percepts.appearance.models.pose import Doubles
from visup.percepts.appearance.models.scene import Scene

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]

REDUCTION = 4  # working pixels per pixel of the compared images
INTERVAL_S = 0.2  # interval between two compared images
RECENT_S = 0.6  # how long a change counts as recent
LEAST = 12  # greatest difference of lightness that is noise, 8-bit levels
NEVER = np.float32(-1e6)


class ChangeMap:
    """The time when each part of the image last changed; one per video."""

    def __init__(self) -> None:
        self._previous: Bytes | None = None
        self._time = 0.0
        self._changed_at: Floats | None = None

    def update(self, scene: Scene, camera: Doubles) -> None:
        """Update with a frame.

        Args:
            scene: The frame.
            camera: (2, 3) similarity of the image since the previous frame.
        """
        early = scene.time - self._time < INTERVAL_S - 1e-6
        if early and camera is STILL and self._previous is not None:
            return
        width, height = (max(1, n // REDUCTION) for n in scene.size)
        whole = scene.grey[: height * REDUCTION, : width * REDUCTION]
        grey = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
        now = np.asarray(grey, dtype=np.uint8)
        if self._previous is None or self._changed_at is None or self._previous.shape != now.shape:
            self._changed_at = np.full(now.shape, NEVER)
            self._previous, self._time = now, scene.time
            return
        if camera is not STILL:
            small = camera.copy()
            small[:, 2] /= REDUCTION
            # Parts coming into view are new, not changed.
            self._previous = _warped(self._previous, small, now)
        if early:
            return
        off = cv2.absdiff(now, self._previous)
        strong = cv2.morphologyEx((off > LEAST).astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2)))
        grown = np.asarray(cv2.dilate(strong, np.ones((7, 7), np.uint8))) > 0
        self._changed_at[grown] = scene.time
        self._previous, self._time = now, scene.time

    def recently_changed(self, scene: Scene) -> NDArray[np.bool_] | None:
        """(h, w) bool, a quarter of the working size: the parts that changed recently.

        None if nothing did, or if most of the image did, which guides no search.
        """
        if self._changed_at is None:
            return None
        out = np.asarray(scene.time - self._changed_at < RECENT_S)
        return out if 0 < np.mean(out) < 0.7 else None


def _warped(was: Bytes, camera: Doubles, now: Bytes) -> Bytes:
    size = was.shape[1], was.shape[0]
    moved = cv2.warpAffine(was, camera, size, flags=cv2.INTER_LINEAR)
    known = cv2.warpAffine(np.ones_like(was), camera, size, flags=cv2.INTER_NEAREST)
    return np.where(np.asarray(known) > 0, moved, now).astype(np.uint8)
