"""Pictures for the report: crops of objects, thumbnails, JPEG encoding."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    ObjectBelief,
)

CROP_SIZE = 112
JPEG_QUALITY = 82


def object_crop(image: NDArray[np.uint8], belief: ObjectBelief) -> NDArray[np.uint8]:
    """A crop of an object with a dimmed margin.

    Args:
        image: (H, W, 3) uint8 BGR.
        belief: An object visible in it.

    Returns:
        (h, w, 3) uint8 BGR, its longer side at most `CROP_SIZE` pixels.
    """
    x, y, w, h = belief.region.bbox
    margin = max(4, round(0.12 * max(w, h)))
    x0, y0 = max(0, x - margin), max(0, y - margin)
    x1, y1 = min(image.shape[1], x + w + margin), min(image.shape[0], y + h + margin)
    inside = belief.region.full_mask((image.shape[1], image.shape[0]))[y0:y1, x0:x1, None]
    part = image[y0:y1, x0:x1]
    dimmed = np.where(inside, part, part // 4)
    scale = CROP_SIZE / max(part.shape[:2])
    size = (max(1, round(part.shape[1] * scale)), max(1, round(part.shape[0] * scale)))
    interpolation = cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(dimmed, size, interpolation=interpolation), np.uint8)


def shrunk(image: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """The image reduced to at most `width` pixels, with the same aspect ratio."""
    if image.shape[1] <= width:
        return image
    height = max(1, round(image.shape[0] * width / image.shape[1]))
    return np.asarray(cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def jpeg_of(image: NDArray[np.uint8]) -> bytes:
    """An image as a JPEG file."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return bytes(data)
