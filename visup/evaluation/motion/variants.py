"""Variants of the same footage that should not change results, to measure their stability."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame

Image = NDArray[np.uint8]

SMALLER_SCALE = 0.75  # scale of the smaller image
JPEG_QUALITY = 50  # JPEG: with visible blocks, but recognisable objects


@dataclass(frozen=True, slots=True)
class Variant:
    """A variant of a video.

    Attributes:
        image: Transforms each image, (H, W, 3) uint8.
        labels: Transforms its mask, (H, W) uint8, accordingly.
        every: Use every n-th frame.
    """

    image: Callable[[Image], Image] = lambda image: image
    labels: Callable[[Image], Image] = lambda labels: labels
    every: int = 1

    def apply(self, frame: Frame) -> Frame:
        """The transformed frame."""
        return replace(frame, image=self.image(frame.image))


def _mirrored(image: Image) -> Image:
    return np.ascontiguousarray(image[:, ::-1])


def _smaller(interpolation: int) -> Callable[[Image], Image]:
    def resized(image: Image) -> Image:
        height, width = image.shape[:2]
        size = (max(1, round(width * SMALLER_SCALE)), max(1, round(height * SMALLER_SCALE)))
        return np.asarray(cv2.resize(image, size, interpolation=interpolation), dtype=np.uint8)

    return resized


def _compressed(image: Image) -> Image:
    _, data = cv2.imencode(".jpg", image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)


PLAIN = "plain"
UNCHANGED = Variant()
VARIANTS: Mapping[str, Variant] = {
    PLAIN: UNCHANGED,
    "mirrored": Variant(_mirrored, _mirrored),
    "half the frames": Variant(every=2),
    "smaller": Variant(_smaller(cv2.INTER_AREA), _smaller(cv2.INTER_NEAREST)),
    "compressed": Variant(_compressed),
}
"""Variants by name; the first is the identity."""
