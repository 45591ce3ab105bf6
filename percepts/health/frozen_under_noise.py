"""Detection of a frozen image under fresh noise, from the spatial statistics of change.

Motion, light and codecs change neighbouring pixels together; noise added by a later stage changes each pixel
independently, so that means of n pixels change by 1 / n of the variance. When the changes of an image, which
were never white, become white everywhere at one moment, and stay so relative to the image of that moment,
then that image is frozen under fresh noise, however little moved before.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import median

import cv2
import numpy as np

from visup.percepts.health.image_quality import ImageQuality
from visup.percepts.health.quantiles import quantiles
from visup.percepts.health.standstill import AFTER_S, FEWEST, HISTORY_S, MAX_FRAMES, per_cell

WHITE_RANGE = (0.8, 1.25)  # range of the median over the cells for white noise; ideally 1
WHITE_LIMIT = 1.6  # the same exceeded by few of its cells
LIVE_MEDIAN = 2.5  # least median over the cells for a live scene
FAINT_LEVEL = 2.5  # change up to which noise would not hide motion, grey levels
CHANGED_SHARE = 0.9  # least share of cells that change at all


@dataclass(frozen=True, slots=True)
class ChangeStatistics:
    """Spatial statistics of the change between two images.

    Attributes:
        median_ratio: Variance of means of pixels, times their number, relative to that of pixels: median over
            the cells. 1 for white noise.
        high_ratio: The same, 95th percentile over the cells.
        level: Root mean square over the image, grey levels.
        changed_share: Share of the cells that changed.
    """

    median_ratio: float
    high_ratio: float
    level: float
    changed_share: float

    @property
    def is_white(self) -> bool:
        """Whether it is faint noise, independent in each pixel, everywhere."""
        return (
            WHITE_RANGE[0] < self.median_ratio < WHITE_RANGE[1]
            and self.high_ratio < WHITE_LIMIT
            and self.level < FAINT_LEVEL
            and self.changed_share > CHANGED_SHARE
        )


NO_CHANGE = ChangeStatistics(0.0, 0.0, 0.0, 0.0)


class NoiseOnlyDetector:
    """Detects that an image is frozen under fresh noise."""

    def __init__(self) -> None:
        self._last: ImageQuality | None = None
        self._first: ImageQuality | None = None  # of those that change by noise alone
        self._since = 0.0
        self._before: deque[tuple[float, float]] = deque(maxlen=MAX_FRAMES)

    def reset(self) -> None:
        """Reset the history."""
        self._last = self._first = None
        self._before.clear()

    def update(self, quality: ImageQuality, now: float) -> bool:
        """Add a frame.

        Args:
            quality: The frame.
            now: Seconds.

        Returns:
            Whether it has been still under noise for long enough, and was live before.
        """
        if self._last is not None and self._last.grey.shape != quality.grey.shape:
            self.reset()
        change = change_statistics(self._last, quality)
        noise_alone = (
            change.is_white and change_statistics(self._first or self._last, quality).is_white
        )
        if noise_alone and self._first is None:
            self._first, self._since = self._last, now
        elif not noise_alone:
            self._first = None
            if change.changed_share > 0:
                self._before.append((now, change.median_ratio))
        self._last = quality
        live_medians = [
            median_ratio for time, median_ratio in self._before if self._since - time < HISTORY_S
        ]
        lasting = now - self._since >= AFTER_S
        return (
            noise_alone
            and lasting
            and len(live_medians) >= FEWEST
            and median(live_medians) > LIVE_MEDIAN
        )


def change_statistics(before: ImageQuality | None, now: ImageQuality) -> ChangeStatistics:
    """Statistics of the change between two images of the same size."""
    if before is None or now.factor < 2:
        return NO_CHANGE
    coarse = per_cell(np.square(now.small - before.small))
    rows, columns = (n * now.factor for n in now.small.shape)
    apart = cv2.absdiff(now.grey[:rows, :columns], before.grey[:rows, :columns])
    squares = np.square(apart, dtype=np.float32)
    fine = np.asarray(cv2.resize(squares, coarse.shape[::-1], interpolation=cv2.INTER_AREA))
    changed = fine > 1e-3
    if not changed.any():
        return NO_CHANGE
    share = now.factor**2 * coarse[changed] / fine[changed]
    median_ratio, high_ratio = quantiles(share, 0.5, 0.95)
    return ChangeStatistics(
        median_ratio, high_ratio, float(np.sqrt(fine.mean())), float(changed.mean())
    )
