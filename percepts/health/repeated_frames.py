"""Whether an image only repeats the one before, and whether what moves went on meanwhile.

That images hardly differ does not say that frames are missing: what moves may rest, and where a codec
skips what stands still nothing differs at all. Lost frames leave two marks. The repeat is a repeat all
over, not only where most changes; and the first new image catches up: it shows the motion of all the
frames that did not come. What has rested starts anew, from nothing.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import median

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.health.quantiles import quantiles
from visup.percepts.health.standstill import Floats, per_cell

MOST = 25
ENOUGH = 6
LIVELY = 1.5  # grey levels of change where most changes, from which near repeats are told
NEARLY = 0.1  # share of the usual change that no cell of a near repeat reaches
CODED = 1.0  # grey levels that coding the same image anew changes in any cell, at most
FLOOR = 0.3  # grey levels of change that are not motion, beyond those of the whole image
FLOOR_MOST = 1.2  # the whole image changes by more only when the camera moves
# A mover that has rested starts at less than 0.8 of its usual pace in 19 of 20 pauses of real and rendered
# clips; after lost frames it is past that in three of four, since a step that was lost is made up for.
RESUMED = 0.8
GAIN = 0.4  # of the usual change for each lost frame; less than 1, for change saturates
GAIN_MOST = 2.0
CALM = 0.1  # share of the cells that is calmest
RESTLESS = 0.01  # grey levels that these always change by where noise never rests


@dataclass(frozen=True, slots=True)
class Repeat:
    """What one image is to those before it.

    Attributes:
        same: It is the very same as the one before, of a source that did change.
        near: It is so, or differs by no more than coding although images usually differ by much.
        resumes: It is new, and what moves is where it would be had it gone on during the repeats
            before, at least as far as one usual step.
        catches_up: It is new, and clearly further than one usual step.
    """

    same: bool = False
    near: bool = False
    resumes: bool = False
    catches_up: bool = False


class RepeatDetector:
    """Compares each image with the one before."""

    def __init__(self) -> None:
        self._image: NDArray[np.uint8] | None = None
        self._small: Floats | None = None
        self._held: Floats | None = None  # what is repeated
        self._run = 0
        self._exact = True
        self._peaks: deque[float] = deque(maxlen=MOST)
        self._motions: deque[float] = deque(maxlen=MOST)
        self._calmest: deque[float] = deque(maxlen=MOST)
        self.was_lively = False

    def compare(self, image: NDArray[np.uint8], small: Floats) -> Repeat:
        """Take in an image.

        Args:
            image: (H, W, 3) uint8.
            small: (h, w) float32, the same made small.

        Returns:
            What it is to those before. Nothing holds before the source has changed at all.
        """
        before, self._image = self._image, image
        smaller, self._small = self._small, small
        if before is None or smaller is None or before.shape != image.shape:
            self._run, self._held = 0, None
            return Repeat()
        change = per_cell(cv2.absdiff(small, smaller))
        same = not change.any() and bool(np.array_equal(before, image))
        self.was_lively = self.was_lively or not same
        if same or self._is_coded_repeat(change):
            self._held = smaller if self._held is None else self._held
            self._run, self._exact = self._run + 1, self._exact and same
            return Repeat(same and self.was_lively, self.was_lively)
        new = self._resumed(small)
        self._run, self._held, self._exact = 0, None, True
        calmest, peak = quantiles(change, CALM, 0.95)
        self._calmest.append(calmest)
        self._peaks.append(peak)
        self._motions.append(_motion(change))
        return new

    def _is_coded_repeat(self, change: Floats) -> bool:
        if len(self._peaks) < ENOUGH:
            return False
        usual = median(self._peaks)
        return usual > LIVELY and float(change.max()) < min(CODED, NEARLY * usual)

    def _resumed(self, small: Floats) -> Repeat:
        """A new image, held against the one that was repeated before it."""
        if self._held is None or len(self._motions) < ENOUGH:
            return Repeat()
        usual = median(self._motions)
        if self._exact and min(self._calmest) > RESTLESS:
            return Repeat(resumes=True, catches_up=True)
        if usual <= 0.0:
            return Repeat()
        steps = _motion(per_cell(cv2.absdiff(small, self._held))) / usual
        catches_up = steps > min(1.0 + GAIN * self._run, GAIN_MOST)
        return Repeat(
            resumes=catches_up or (self._exact and steps > RESUMED), catches_up=catches_up
        )


def _motion(change: Floats) -> float:
    """Change summed over all that moves: it grows with the way, though that of a cell does not."""
    floor = FLOOR + min(quantiles(change, 0.5)[0], FLOOR_MOST)
    return float(np.maximum(change - floor, 0.0).sum())
