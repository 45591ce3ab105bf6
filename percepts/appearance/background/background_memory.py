"""Past frames of the scene, which rule out places where a lost object cannot be.

A lost dark gripper resembles any dark corner of the room, and a wall that an arm uncovers may resemble what
the arm carries. A place that looks now as it did while the object was seen elsewhere is background, so the
object is not there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.point_tracking import STILL
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.pose import Doubles
from visup.percepts.appearance.models.scene import Scene

Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]

REDUCTION = 4
"""Working pixels per pixel of a remembered frame."""

FIRST_INTERVAL_S = 0.5
"""Interval between remembered frames, doubled whenever there are too many."""

MAX_FRAMES = 8

NOISE = 10
"""Largest difference of any channel that noise makes, levels of 8-bit Lab."""

CHANGED_SHARE = 0.2
"""Share of a place that must have changed for the object to be there."""

_SAME = np.eye(3)


@dataclass(frozen=True, slots=True, eq=False)
class RememberedFrame:
    """A past frame, and where each object was seen in it.

    Attributes:
        lab: (h, w, 3) uint8, CIE Lab, a quarter of the working size.
        covered: Name of an object -> (h, w) bool, the pixels that it covered, dilated by one.
        motion: (3, 3) similarity from its working pixels to those of the last frame.
    """

    lab: Bytes
    covered: Mapping[str, Mask]
    motion: Doubles

    def moved(self, camera: Doubles) -> RememberedFrame:
        """The same with the camera's motion into the next frame, a (2, 3) similarity, added to `motion`."""
        return replace(self, motion=np.vstack((camera, (0.0, 0.0, 1.0))) @ self.motion)


class BackgroundMemory:
    """Frames of the last minutes, moved with the camera; one per video.

    They are discarded when the camera's motion is unknown. An error in the motion makes places look changed,
    which is safe: changed places are searched.

    Attributes:
        frames: The frames, oldest first; the first one stays.
    """

    def __init__(self) -> None:
        self.frames: tuple[RememberedFrame, ...] = ()
        self._interval = FIRST_INTERVAL_S
        self._due = -np.inf

    def update(self, scene: Scene, seen: Mapping[str, Blob]) -> None:
        """Remember a frame, if it is time.

        Args:
            scene: The frame.
            seen: The visible pixels of each object that is seen in it, by name.
        """
        if scene.time < self._due:
            return
        covered = {name: _covered(scene, blob) for name, blob in seen.items()}
        self.frames = (*self.frames, RememberedFrame(_small(scene), covered, _SAME))
        if len(self.frames) > MAX_FRAMES:
            self.frames, self._interval = self.frames[::2], 2 * self._interval
        self._due = scene.time + self._interval - 1e-6

    def move(self, camera: Doubles | None) -> None:
        """Follow the camera into the next frame.

        Args:
            camera: (2, 3) similarity of the image, working pixels; None if unknown.
        """
        if camera is None:
            self.frames, self._interval, self._due = (), FIRST_INTERVAL_S, -np.inf
        elif camera is not STILL:
            self.frames = tuple(frame.moved(camera) for frame in self.frames)

    def changed(self, scene: Scene, name: str) -> Mask | None:
        """Where the frame differs from all remembered frames that show an object elsewhere.

        Args:
            scene: The frame.
            name: Name of the object.

        Returns:
            (h, w) bool, a quarter of the working size: the parts that may hold the object; None if no
            remembered frame shows it.
        """
        frames = [frame for frame in self.frames if name in frame.covered]
        if not frames:
            return None
        now = _small(scene)
        new = np.ones(now.shape[:2], dtype=bool)
        for frame in frames:
            new &= ~_unchanged(now, frame, name)
        return new


def has_changed(changed: Mask, place: Blob) -> bool:
    """Whether enough of a place has changed for an object to be there.

    Args:
        changed: (h, w) bool, a quarter of the working size, from `BackgroundMemory.changed`.
        place: The pixels that the object would cover.
    """
    left, top, _, _ = place.window
    ys, xs = np.nonzero(place.mask)
    rows = np.clip((ys + top) // REDUCTION, 0, changed.shape[0] - 1)
    columns = np.clip((xs + left) // REDUCTION, 0, changed.shape[1] - 1)
    return bool(len(ys) and np.mean(changed[rows, columns]) > CHANGED_SHARE)


def _small(scene: Scene) -> Bytes:
    size = tuple(max(1, n // REDUCTION) for n in scene.size)
    return np.asarray(cv2.resize(scene.lab[0], size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _covered(scene: Scene, blob: Blob) -> Mask:
    """(h, w) bool, a quarter of the working size: the pixels that an object touches, dilated by one."""
    left, top, right, bottom = blob.window
    whole = np.zeros(scene.size[::-1], dtype=np.uint8)
    whole[top:bottom, left:right] = blob.mask
    size = tuple(max(1, n // REDUCTION) for n in scene.size)
    small = cv2.resize(255 * whole, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.dilate(small, np.ones((3, 3), np.uint8))) > 0


def _unchanged(now: Bytes, frame: RememberedFrame, name: str) -> Mask:
    """(h, w) bool: pixels that equal a remembered frame where that shows background instead of an object."""
    before, known = (
        _warped_to_now(frame, frame.lab),
        _warped_to_now(frame, (~frame.covered[name]).view(np.uint8)),
    )
    return np.asarray((cv2.absdiff(now, before).max(axis=2) <= NOISE) & (known > 0))


def _warped_to_now(frame: RememberedFrame, image: Bytes) -> Bytes:
    """A remembered frame, or a mask in it, warped to the current camera view; 0 where it was out of view."""
    if np.array_equal(frame.motion, _SAME):
        return image
    motion = frame.motion[:2].copy()
    motion[:, 2] /= REDUCTION
    size = image.shape[1], image.shape[0]
    how = cv2.INTER_LINEAR if image.ndim == 3 else cv2.INTER_NEAREST
    return np.asarray(cv2.warpAffine(image, motion, size, flags=how), dtype=np.uint8)
