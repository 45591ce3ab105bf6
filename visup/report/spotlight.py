"""Highlights the regions on which an explanation is based."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.report.image_text import write
from visup.report.palette import object_colour

DIMMED = 0.35
"""Brightness of the rest of the image."""

LETTERS = 14


def spotlight(image: NDArray[np.uint8], regions: Iterable[Region]) -> NDArray[np.uint8]:
    """A dimmed frame with regions highlighted, outlined and numbered.

    Args:
        image: (H, W, 3) uint8 BGR; not changed.
        regions: Regions of the frame.

    Returns:
        (H, W, 3) uint8 BGR, a new image.
    """
    result = (image * DIMMED).astype(np.uint8)
    listed = sorted({r.id: r for r in regions}.values(), key=lambda r: r.id)
    for region in listed:
        x, y, w, h = region.bbox
        bright_part = result[y : y + h, x : x + w]
        bright_part[region.mask] = image[y : y + h, x : x + w][region.mask]
    for region in listed:
        colour = object_colour(region.id)
        outline = np.round(region.contour).astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(result, [outline], True, colour[::-1], 2, cv2.LINE_AA)
        at = (region.bbox[0], max(0, region.bbox[1] - LETTERS - 6))
        write(result, f"region {region.id}", at, LETTERS, colour)
    return result
