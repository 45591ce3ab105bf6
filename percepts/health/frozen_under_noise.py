"""What the change from frame to frame is made of: white noise alone, or what a scene leaves.

Motion, light and codecs change neighbouring pixels alike; noise that a later stage puts on an image
changes each by itself, so that means of n pixels change by a part of 1 / n of the variance. When the
changes of a picture, which never were white, are white all over from one moment on, and stay so
against the image of that moment, then that image stands still under fresh noise, however little
moved before.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import median

import cv2
import numpy as np

from visup.percepts.health.image_quality import ImageQuality
from visup.percepts.health.quantiles import quantiles
from visup.percepts.health.standstill import AFTER_S, FEWEST, KEPT_S, MOST, per_cell

WHITE = (0.8, 1.25)  # median over the cells of what white noise shows; 1 but for rounding
UNEVEN = 1.6  # the same that few of its cells exceed
LIVE = 2.5  # median over the cells of what a scene shows, at least
FAINT = 2.5  # grey levels of change up to which noise would not hide what moves
STIRRED = 0.9  # share of the cells in which something changes at all


@dataclass(frozen=True, slots=True)
class ChangeStatistics:
    """What the change between two images is made of.

    Attributes:
        middle: Variance of means of pixels, times their number, as a share of that of pixels: the
            median over the cells. 1 for white noise.
        most: The same, which one cell in twenty exceeds.
        level: Root mean square over the image, grey levels.
        stirred: Share of the cells in which something changed.
    """

    middle: float
    most: float
    level: float
    stirred: float

    @property
    def is_white(self) -> bool:
        """Whether it is faint noise of each pixel by itself, all over."""
        return (
            WHITE[0] < self.middle < WHITE[1]
            and self.most < UNEVEN
            and self.level < FAINT
            and self.stirred > STIRRED
        )


NOTHING = ChangeStatistics(0.0, 0.0, 0.0, 0.0)


class NoiseOnlyDetector:
    """Since when an image stands still under fresh noise."""

    def __init__(self) -> None:
        self._last: ImageQuality | None = None
        self._first: ImageQuality | None = None  # of those under noise alone
        self._since = 0.0
        self._before: deque[tuple[float, float]] = deque(maxlen=MOST)

    def forget(self) -> None:
        """Start afresh: what came before says nothing about what comes."""
        self._last = self._first = None
        self._before.clear()

    def update(self, picture: ImageQuality, now: float) -> bool:
        """Take in a frame.

        Args:
            picture: The frame.
            now: Seconds.

        Returns:
            Whether it has stood still under noise for long enough, and was live before.
        """
        if self._last is not None and self._last.grey.shape != picture.grey.shape:
            self.forget()
        change = change_statistics(self._last, picture)
        stands = change.is_white and change_statistics(self._first or self._last, picture).is_white
        if stands and self._first is None:
            self._first, self._since = self._last, now
        elif not stands:
            self._first = None
            if change.stirred > 0:
                self._before.append((now, change.middle))
        self._last = picture
        live = [middle for time, middle in self._before if self._since - time < KEPT_S]
        long = now - self._since >= AFTER_S
        return stands and long and len(live) >= FEWEST and median(live) > LIVE


def change_statistics(before: ImageQuality | None, now: ImageQuality) -> ChangeStatistics:
    """What the change from one picture to another of the same size is made of."""
    if before is None or now.factor < 2:
        return NOTHING
    coarse = per_cell(np.square(now.small - before.small))
    rows, columns = (n * now.factor for n in now.small.shape)
    apart = cv2.absdiff(now.grey[:rows, :columns], before.grey[:rows, :columns])
    squares = np.square(apart, dtype=np.float32)
    fine = np.asarray(cv2.resize(squares, coarse.shape[::-1], interpolation=cv2.INTER_AREA))
    stirred = fine > 1e-3
    if not stirred.any():
        return NOTHING
    share = now.factor**2 * coarse[stirred] / fine[stirred]
    middle, most = quantiles(share, 0.5, 0.95)
    return ChangeStatistics(middle, most, float(np.sqrt(fine.mean())), float(stirred.mean()))
