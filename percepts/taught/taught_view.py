"""Taught views: an outline drawn in one image, with the pixels in and around it.

Only the pixels are stored. Colours, keypoints, silhouettes and shock graphs are derived when needed, so that
a better recogniser also serves objects taught earlier.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError

SCENE_WIDTH = 480
"""Most width of the stored image, pixels."""

MIN_PIXELS = 24
"""Fewest pixels of an outline that can be recognised."""


@dataclass(frozen=True, slots=True, eq=False)
class TaughtView:
    """One outline of one object, in one image.

    Attributes:
        name: Name of the object; a task's actors may refer to it.
        image: (h, w, 3) uint8, BGR: the outline's box, with half its longer side around it as far as
            the image reaches.
        mask: (h, w) bool, the object in `image`.
        origin: (x, y) of `image` in the image, pixels.
        frame_size: (width, height) of the image, pixels.
        scene: (H, W, 3) uint8, BGR: the whole image, at most `SCENE_WIDTH` wide.
    """

    name: str
    image: NDArray[np.uint8]
    mask: NDArray[np.bool_]
    origin: tuple[int, int]
    frame_size: tuple[int, int]
    scene: NDArray[np.uint8]

    @property
    def bbox(self) -> tuple[int, int, int, int]:
        """(x, y, width, height) of the object in the image, pixels, half open."""
        x, y, w, h = cv2.boundingRect(self.mask.astype(np.uint8))
        return self.origin[0] + x, self.origin[1] + y, w, h


def taught_view(
    name: str, image: NDArray[np.uint8], outline: Sequence[Sequence[float]]
) -> TaughtView:
    """The view of an outline drawn in an image.

    Args:
        name: Name of the object.
        image: (H, W, 3) uint8, BGR.
        outline: At least three corners (x, y), pixels of the image.

    Raises:
        SettingsError: The outline has too few corners, or almost no pixels of the image in it.
    """
    corners = np.asarray(outline, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[1:] != (2,) or len(corners) < 3:
        raise SettingsError(
            f"the outline of '{name}' has too few corners",
            expected="at least three corners x,y",
        )
    if not np.isfinite(corners).all() or abs(corners).max() > 1 << 15:
        raise SettingsError(f"the outline of '{name}' has a corner far outside the picture")
    mask = np.zeros(image.shape[:2], dtype=np.uint8)
    cv2.fillPoly(mask, [np.round(corners).astype(np.int32)], (1,))
    return taught_view_from_mask(name, image, mask > 0)


def taught_view_from_mask(
    name: str, image: NDArray[np.uint8], mask: NDArray[np.bool_]
) -> TaughtView:
    """The view of a mask over a whole image; see `taught_view`.

    Raises:
        SettingsError: The mask has almost no pixels.
    """
    height, width = mask.shape
    if np.count_nonzero(mask) < MIN_PIXELS:
        raise SettingsError(
            f"there is nothing in the outline of '{name}'",
            expected=f"at least {MIN_PIXELS} pixels within the picture of {width} x {height}",
        )
    x, y, w, h = cv2.boundingRect(mask.astype(np.uint8))
    margin = max(w, h) // 2 + 1
    left, top = max(0, x - margin), max(0, y - margin)
    right, bottom = min(width, x + w + margin), min(height, y + h + margin)
    small = min(1.0, SCENE_WIDTH / width)
    size = max(1, round(width * small)), max(1, round(height * small))
    scene = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return TaughtView(
        name=name,
        image=image[top:bottom, left:right].copy(),
        mask=mask[top:bottom, left:right].copy(),
        origin=(left, top),
        frame_size=(width, height),
        scene=np.asarray(scene, dtype=np.uint8),
    )
