"""Repeated frames: whether an image repeats the previous one while motion went on.

Nearly equal images do not imply missing frames: objects may rest, and where a codec skips still parts nothing
differs at all. Lost frames leave two marks. The repeat is a repeat everywhere, not only where most changes;
and the first new image catches up: it shows the motion of all missing frames. An object that rested starts
from zero.
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

MAX_FRAMES = 25
ENOUGH = 6
DETECTABLE_PEAK = 1.5  # peak change from which near repeats can be detected, grey levels
NEAR_REPEAT_SHARE = 0.1  # all cells of a near repeat change by less than this share of the usual
RECODING_CHANGE = 1.0  # most change of a cell by recoding the same image, grey levels
FLOOR = 0.3  # change that is not motion, beyond that of the whole image, grey levels
MAX_FLOOR = 1.2  # bound of the latter: the whole image changes by more only when the camera moves
# A mover that rested starts at less than 0.8 of its usual pace in 19 of 20 pauses of real and rendered clips;
# after lost frames it exceeds that in three of four, since the lost step is made up for.
RESUMED_STEPS = 0.8
GAIN = 0.4  # share of the usual change per lost frame; below 1, since change saturates
MAX_GAIN = 2.0
CALMEST_SHARE = 0.1  # share of the cells counted as the calmest
NOISY_CHANGE = 0.01  # change of these from which there is always noise, grey levels


@dataclass(frozen=True, slots=True)
class Repeat:
    """An image compared with the previous ones.

    Attributes:
        same: It equals the previous one, from a source that has changed.
        near: It is the same, or differs no more than by coding although images usually differ much.
        resumes: It is new, and motion is where it would be had it continued during the repeats, at least
            one usual step on.
        catches_up: It is new, and clearly further than one usual step.
    """

    same: bool = False
    near: bool = False
    resumes: bool = False
    catches_up: bool = False


class RepeatDetector:
    """Compares each image with the previous one."""

    def __init__(self) -> None:
        self._image: NDArray[np.uint8] | None = None
        self._small: Floats | None = None
        self._repeated: Floats | None = None  # the repeated image
        self._run = 0
        self._exact = True
        self._peaks: deque[float] = deque(maxlen=MAX_FRAMES)
        self._motions: deque[float] = deque(maxlen=MAX_FRAMES)
        self._calmest: deque[float] = deque(maxlen=MAX_FRAMES)
        self.was_lively = False

    def compare(self, image: NDArray[np.uint8], small: Floats) -> Repeat:
        """Add an image.

        Args:
            image: (H, W, 3) uint8.
            small: (h, w) float32, the same, reduced.

        Returns:
            The comparison; all False until the source has first changed.
        """
        before, self._image = self._image, image
        smaller, self._small = self._small, small
        if before is None or smaller is None or before.shape != image.shape:
            self._run, self._repeated = 0, None
            return Repeat()
        change = per_cell(cv2.absdiff(small, smaller))
        same = not change.any() and bool(np.array_equal(before, image))
        self.was_lively = self.was_lively or not same
        if same or self._is_coded_repeat(change):
            self._repeated = smaller if self._repeated is None else self._repeated
            self._run, self._exact = self._run + 1, self._exact and same
            return Repeat(same and self.was_lively, self.was_lively)
        new = self._resumption(small)
        self._run, self._repeated, self._exact = 0, None, True
        calmest, peak = quantiles(change, CALMEST_SHARE, 0.95)
        self._calmest.append(calmest)
        self._peaks.append(peak)
        self._motions.append(_motion(change))
        return new

    def _is_coded_repeat(self, change: Floats) -> bool:
        if len(self._peaks) < ENOUGH:
            return False
        usual = median(self._peaks)
        return usual > DETECTABLE_PEAK and float(change.max()) < min(
            RECODING_CHANGE, NEAR_REPEAT_SHARE * usual
        )

    def _resumption(self, small: Floats) -> Repeat:
        """Compare a new image with the one repeated before it."""
        if self._repeated is None or len(self._motions) < ENOUGH:
            return Repeat()
        usual = median(self._motions)
        if self._exact and min(self._calmest) > NOISY_CHANGE:
            return Repeat(resumes=True, catches_up=True)
        if usual <= 0.0:
            return Repeat()
        steps = _motion(per_cell(cv2.absdiff(small, self._repeated))) / usual
        catches_up = steps > min(1.0 + GAIN * self._run, MAX_GAIN)
        return Repeat(
            resumes=catches_up or (self._exact and steps > RESUMED_STEPS), catches_up=catches_up
        )


def _motion(change: Floats) -> float:
    """Change summed over all moving parts: it grows with displacement, unlike that of a cell."""
    floor = FLOOR + min(quantiles(change, 0.5)[0], MAX_FLOOR)
    return float(np.maximum(change - floor, 0.0).sum())
