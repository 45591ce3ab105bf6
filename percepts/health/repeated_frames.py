"""Whether an image only repeats the one before, exactly or as a codec renders it."""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.health.standstill import Floats, per_cell

MOST = 25
ENOUGH = 6
LIVELY = 1.5  # grey levels of change where most changes, from which near repeats are told
NEARLY = 0.2  # share of the usual change


class RepeatDetector:
    """Compares each image with the one before."""

    def __init__(self) -> None:
        self._image: NDArray[np.uint8] | None = None
        self._small: Floats | None = None
        self._usual: deque[float] = deque(maxlen=MOST)
        self.was_lively = False

    def compare(self, image: NDArray[np.uint8], small: Floats) -> tuple[bool, bool]:
        """Take in an image.

        Args:
            image: (H, W, 3) uint8.
            small: (h, w) float32, the same made small.

        Returns:
            Whether it is the very same as the one before; whether it is so or hardly differs
            though images usually do. Neither holds before the source has changed at all.
        """
        before, self._image = self._image, image
        smaller, self._small = self._small, small
        if before is None or smaller is None or before.shape != image.shape:
            return False, False
        change = float(np.quantile(per_cell(cv2.absdiff(small, smaller)), 0.95))
        same = change == 0.0 and bool(np.array_equal(before, image))
        self.was_lively = self.was_lively or not same
        usual = float(np.median(self._usual)) if len(self._usual) >= ENOUGH else 0.0
        near = usual > LIVELY and change < NEARLY * usual
        if not (same or near):
            self._usual.append(change)
        return same and self.was_lively, (same or near) and self.was_lively
