"""The working image (reduced, grey, with gradients) and a history of past ones."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class WorkImage:
    """One frame, preprocessed.

    Attributes:
        time: Seconds.
        scale: Working pixels per frame pixel.
        grey: (h, w) uint8.
        tone: (h, w, 3) uint8, the colours with shadows lifted, for appearance and superpixels.
        gx: (h, w) float32, gradient along x, grey levels per pixel.
        gy: (h, w) float32, gradient along y.
        half: (h / 2, w / 2) uint8, `grey` at half the size, for dense comparison.
    """

    time: float
    scale: float
    grey: NDArray[np.uint8]
    tone: NDArray[np.uint8]
    gx: Floats
    gy: Floats
    half: NDArray[np.uint8]

    @property
    def shape(self) -> tuple[int, int]:
        """(h, w) of the working image."""
        return self.grey.shape[0], self.grey.shape[1]


# A square root evens out photon noise and lifts shadows: in harsh light objects lie in both.
LIFT = np.clip(np.sqrt(np.arange(256) / 255.0) * 255.0, 0, 255).astype(np.uint8)


def prepare_image(frame: Frame, work_size: int) -> WorkImage:
    """Reduce a frame to the working size.

    Args:
        frame: Grey (H, W), (H, W, 1) or colour (H, W, 3) uint8.
        work_size: Longer side of the result, pixels; smaller frames keep their size.

    Returns:
        The working image.
    """
    image = frame.image
    if image.ndim == 2 or image.shape[2] == 1:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    height, width = image.shape[:2]
    scale = min(1.0, work_size / max(height, width))
    if scale < 1.0:
        size = (max(8, round(width * scale)), max(8, round(height * scale)))
        # Down to half the size, the four neighbours cover nearly all of a pixel's area.
        interpolation = cv2.INTER_LINEAR if scale >= 0.5 else cv2.INTER_AREA
        image = np.asarray(cv2.resize(image, size, interpolation=interpolation), dtype=np.uint8)
    image = np.asarray(cv2.GaussianBlur(image, (3, 3), 0.7), dtype=np.uint8)
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    gx = np.asarray(cv2.Scharr(grey, cv2.CV_32F, 1, 0, scale=1 / 32), dtype=np.float32)
    gy = np.asarray(cv2.Scharr(grey, cv2.CV_32F, 0, 1, scale=1 / 32), dtype=np.float32)
    tone = np.asarray(cv2.LUT(image, LIFT), dtype=np.uint8)
    even = grey[: grey.shape[0] // 2 * 2, : grey.shape[1] // 2 * 2]
    half = np.asarray(
        cv2.resize(even, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), dtype=np.uint8
    )
    return WorkImage(frame.time, scale, grey, tone, gx, gy, half)


def reduced(image: NDArray[np.uint8], most: int) -> NDArray[np.uint8]:
    """An image of at most so many pixels a side.

    Means over whole pixels come first: by a ratio that is no whole number they take eight times as long.

    Args:
        image: (H, W) or (H, W, C) uint8.
        most: Longer side of the result, pixels; smaller images keep their size.
    """
    height, width = image.shape[:2]
    scale = min(1.0, most / max(height, width))
    size = (max(8, round(width * scale)), max(8, round(height * scale)))
    whole = max(int(1 / scale), 1)
    if whole > 1:
        image = image[: height // whole * whole, : width // whole * whole]
        fewer = (width // whole, height // whole)
        image = np.asarray(cv2.resize(image, fewer, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)


class ImageHistory:
    """Past working images, as far back as the longest baseline, so that memory stays bounded.

    Args:
        span_s: Seconds to keep.
        most: Most images to keep, whatever the frame rate.
    """

    def __init__(self, span_s: float, most: int = 160) -> None:
        self._span = span_s
        self._images: deque[WorkImage] = deque(maxlen=most)

    def __len__(self) -> int:
        return len(self._images)

    def push(self, image: WorkImage) -> None:
        """Add an image and drop those beyond the span; at least two are retained."""
        self._images.append(image)
        while len(self._images) > 2 and image.time - self._images[1].time > self._span:
            self._images.popleft()

    def lags(self, wanted: Sequence[float]) -> tuple[int, ...]:
        """Baselines in frames nearest to the wanted ones, shortest first.

        Args:
            wanted: Seconds; 0 means one frame.

        Returns:
            Frames back from the newest image, each at least 1 and within the history.
        """
        if len(self._images) < 2:
            return ()
        now = self._images[-1].time
        times = np.array([now - image.time for image in self._images])[::-1]
        reach = [s for s in wanted if s <= times[-1] * 1.1]
        return tuple(sorted({max(1, int(np.argmin(np.abs(times - s)))) for s in reach}))

    def back(self, lag: int) -> WorkImage:
        """The image that many frames before the newest."""
        return self._images[-1 - lag]
