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

from visup.percepts.appearance.looks.blob import Blob
from visup.percepts.appearance.looks.pose import Doubles
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.scenery.points import STILL

Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]

COARSER = 4
"""Working pixels per pixel of a kept picture."""

FIRST_EVERY_S = 0.5
"""Interval between kept pictures, doubled whenever there are too many."""

MOST_KEPT = 8

NOISE = 10
"""Largest difference of any channel that noise makes, levels of 8-bit Lab."""

CHANGED = 0.2
"""Share of a place that must have changed for the object to be there."""

_SAME = np.eye(3)


@dataclass(frozen=True, slots=True, eq=False)
class KeptPicture:
    """A past frame, and where each object was seen in it.

    Attributes:
        lab: (h, w, 3) uint8, CIE Lab, a quarter of the working size.
        covered: Name of an object -> (h, w) bool, the pixels that it covered, dilated by one.
        motion: (3, 3) similarity from its working pixels to those of the last frame.
    """

    lab: Bytes
    covered: Mapping[str, Mask]
    motion: Doubles

    def moved(self, camera: Doubles) -> KeptPicture:
        """The same with the camera's motion into the next frame, a (2, 3) similarity, added to `motion`."""
        return replace(self, motion=np.vstack((camera, (0.0, 0.0, 1.0))) @ self.motion)


class BackgroundMemory:
    """Pictures of the last minutes, moved with the camera; one per video.

    They are discarded when the camera's motion is unknown. An error in the motion makes places look changed,
    which is safe: changed places are searched.

    Attributes:
        kept: The pictures, oldest first; the first one stays.
    """

    def __init__(self) -> None:
        self.kept: tuple[KeptPicture, ...] = ()
        self._every = FIRST_EVERY_S
        self._due = -np.inf

    def update(self, scene: Scene, seen: Mapping[str, Blob]) -> None:
        """Keep a frame, if it is time.

        Args:
            scene: The frame.
            seen: The visible pixels of each object that is seen in it, by name.
        """
        if scene.time < self._due:
            return
        covered = {name: _covered(scene, blob) for name, blob in seen.items()}
        self.kept = (*self.kept, KeptPicture(_small(scene), covered, _SAME))
        if len(self.kept) > MOST_KEPT:
            self.kept, self._every = self.kept[::2], 2 * self._every
        self._due = scene.time + self._every - 1e-6

    def move(self, camera: Doubles | None) -> None:
        """Follow the camera into the next frame.

        Args:
            camera: (2, 3) similarity of the picture, working pixels; None if unknown.
        """
        if camera is None:
            self.kept, self._every, self._due = (), FIRST_EVERY_S, -np.inf
        elif camera is not STILL:
            self.kept = tuple(k.moved(camera) for k in self.kept)

    def changed(self, scene: Scene, name: str) -> Mask | None:
        """Where the frame differs from all kept pictures that show an object elsewhere.

        Args:
            scene: The frame.
            name: Name of the object.

        Returns:
            (h, w) bool, a quarter of the working size: the parts that may hold the object; None if no kept
            picture shows it.
        """
        kept = [k for k in self.kept if name in k.covered]
        if not kept:
            return None
        now = _small(scene)
        new = np.ones(now.shape[:2], dtype=bool)
        for k in kept:
            new &= ~_unchanged(now, k, name)
        return new


def holds(changed: Mask, place: Blob) -> bool:
    """Whether enough of a place has changed for an object to be there.

    Args:
        changed: (h, w) bool, a quarter of the working size, from `BackgroundMemory.changed`.
        place: The pixels that the object would cover.
    """
    left, top, _, _ = place.window
    ys, xs = np.nonzero(place.mask)
    rows = np.clip((ys + top) // COARSER, 0, changed.shape[0] - 1)
    columns = np.clip((xs + left) // COARSER, 0, changed.shape[1] - 1)
    return bool(len(ys) and np.mean(changed[rows, columns]) > CHANGED)


def _small(scene: Scene) -> Bytes:
    size = tuple(max(1, n // COARSER) for n in scene.size)
    return np.asarray(cv2.resize(scene.lab[0], size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _covered(scene: Scene, blob: Blob) -> Mask:
    """(h, w) bool, a quarter of the working size: the pixels that an object touches, dilated by one."""
    left, top, right, bottom = blob.window
    whole = np.zeros(scene.size[::-1], dtype=np.uint8)
    whole[top:bottom, left:right] = blob.mask
    size = tuple(max(1, n // COARSER) for n in scene.size)
    small = cv2.resize(255 * whole, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.dilate(small, np.ones((3, 3), np.uint8))) > 0


def _unchanged(now: Bytes, kept: KeptPicture, name: str) -> Mask:
    """(h, w) bool: pixels that equal a kept picture where that shows background instead of an object."""
    before, known = _now(kept, kept.lab), _now(kept, (~kept.covered[name]).view(np.uint8))
    return np.asarray((cv2.absdiff(now, before).max(axis=2) <= NOISE) & (known > 0))


def _now(kept: KeptPicture, picture: Bytes) -> Bytes:
    """A kept picture, or a mask in it, warped to the current camera view; 0 where it was out of view."""
    if np.array_equal(kept.motion, _SAME):
        return picture
    motion = kept.motion[:2].copy()
    motion[:, 2] /= COARSER
    size = picture.shape[1], picture.shape[0]
    how = cv2.INTER_LINEAR if picture.ndim == 3 else cv2.INTER_NEAREST
    return np.asarray(cv2.warpAffine(picture, motion, size, flags=how), dtype=np.uint8)
