"""An image region reduced to the small square in which poses are fitted."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.records import Frame, Region

SIDE = 52
"""Side of the square, pixels: enough to resolve two degrees, few enough for a thousand renderings."""

_MARGIN = 0.12


@dataclass(frozen=True, slots=True, eq=False)
class RegionImage:
    """A region resampled to a square.

    Attributes:
        cover: (SIDE, SIDE) float64, share of each pixel that the region covers.
        tone: (SIDE, SIDE) float64, grey value, 0 to 255.
        pixel: Side of a pixel of the square, pixels of the frame.
    """

    cover: NDArray[np.float64]
    tone: NDArray[np.float64]
    pixel: float


def region_image(frame: Frame, region: Region) -> RegionImage:
    """Resample a region.

    Args:
        frame: The frame that shows it.
        region: The region; its mask lies within the frame.
    """
    x, y, w, h = region.bbox
    side = max(w, h) * (1.0 + 2.0 * _MARGIN)
    pad = int(np.ceil(side / 2)) + 1
    # Convert no more than the square's surroundings.
    left, top = max(0, x - pad), max(0, y - pad)
    crop = frame.image[top : y + h + pad, left : x + w + pad]
    grey = np.asarray(cv2.cvtColor(crop, cv2.COLOR_BGR2GRAY), np.float32)
    mask = np.zeros(grey.shape, dtype=np.float32)
    mask[y - top : y - top + h, x - left : x - left + w] = region.mask
    pixel = side / SIDE
    if pixel > 1.0:
        mask = np.asarray(cv2.GaussianBlur(mask, (0, 0), 0.35 * pixel), np.float32)
        grey = np.asarray(cv2.GaussianBlur(grey, (0, 0), 0.35 * pixel), np.float32)
    centre = np.array([x - left + w / 2 - 0.5, y - top + h / 2 - 0.5])
    shift = (SIDE - 1) / 2 - centre / pixel
    warp = np.array([[1 / pixel, 0.0, shift[0]], [0.0, 1 / pixel, shift[1]]])
    cover = cv2.warpAffine(mask, warp, (SIDE, SIDE))
    tone = cv2.warpAffine(grey, warp, (SIDE, SIDE), borderMode=cv2.BORDER_REPLICATE)
    return RegionImage(np.clip(cover, 0, 1).astype(np.float64), tone.astype(np.float64), pixel)
