"""Blobs: binary masks within a window of the working image (`models/scene.py`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.pose import Window


@dataclass(frozen=True, slots=True, eq=False)
class Blob:
    """A set of pixels of the working image.

    Attributes:
        window: (left, top, right, bottom), working pixels, half open.
        mask: (bottom - top, right - left) bool.
    """

    window: Window
    mask: NDArray[np.bool_]

    @property
    def area(self) -> int:
        """Pixels in the mask."""
        return int(np.count_nonzero(self.mask))


def common_part(a: Blob, b: Blob) -> tuple[NDArray[np.bool_], NDArray[np.bool_]] | None:
    """The masks of two blobs, cropped (not copied) to where their windows overlap; None if they do not."""
    left, top = max(a.window[0], b.window[0]), max(a.window[1], b.window[1])
    right, bottom = min(a.window[2], b.window[2]), min(a.window[3], b.window[3])
    if right <= left or bottom <= top:
        return None
    one, other = (
        o.mask[top - o.window[1] : bottom - o.window[1], left - o.window[0] : right - o.window[0]]
        for o in (a, b)
    )
    return one, other


def overlap_of_smaller(a: Blob, b: Blob) -> float:
    """Intersection of two blobs as a share of the smaller one, 0 to 1 (not IoU)."""
    part = common_part(a, b)
    if part is None:
        return 0.0
    return float(np.count_nonzero(part[0] & part[1]) / max(min(a.area, b.area), 1))


def without(a: Blob, b: Blob) -> Blob:
    """Blob `a` minus the pixels of `b`; `a` itself if they share no pixel."""
    left = Blob(a.window, a.mask.copy())
    part = common_part(left, b)
    if part is None or not (part[0] & part[1]).any():
        return a
    part[0][part[1]] = False
    return left
