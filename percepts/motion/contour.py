"""From a probability map to a clean mask and its contour, at the full size of the frame."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.image import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """A mask with what follows from it, in frame pixels.

    Attributes:
        bbox: (x, y, width, height), half open.
        mask: (height, width) bool, cropped to the box.
        contour: (N, 2) float32 outer boundary of the largest part.
        centroid: (x, y).
        area: Pixels.
        cut: Whether it touches the border of the frame.
    """

    bbox: tuple[int, int, int, int]
    mask: NDArray[np.bool_]
    contour: Floats
    centroid: tuple[float, float]
    area: float
    cut: bool


def outline(share: Floats, size: tuple[int, int], least: float) -> Outline | None:
    """The outline of a region.

    Args:
        share: (h, w) float32 probability, working pixels.
        size: (width, height) of the frame.
        least: Least area, frame pixels.

    Returns:
        The outline, or None when too little is left.
    """
    width, height = size
    smooth = cv2.GaussianBlur(share, (3, 3), 0.8)
    full = cv2.resize(smooth, (width, height), interpolation=cv2.INTER_LINEAR) > 0.5
    mask = clean(full, least)
    return None if mask is None else describe(mask)


def clean(mask: NDArray[np.bool_], least: float) -> NDArray[np.bool_] | None:
    """Drop specks, keep parts of at least a tenth of the largest (an occluder may split a region).

    Args:
        mask: (H, W) bool.
        least: Least area of the largest part, pixels.

    Returns:
        (H, W) bool, or None when the largest part is too small.
    """
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        mask.astype(np.uint8), connectivity=4
    )
    if count < 2:
        return None
    areas = stats[1:, cv2.CC_STAT_AREA]
    largest = int(areas.max())
    if largest < least:
        return None
    keep = np.zeros(count, dtype=bool)
    keep[1:] = areas >= max(0.1 * largest, 0.25 * least)
    return np.asarray(keep[labels])


def describe(mask: NDArray[np.bool_]) -> Outline:
    """Box, contour, centroid and area of a mask that is not empty."""
    x, y, w, h = cv2.boundingRect(mask.astype(np.uint8))
    crop = np.ascontiguousarray(mask[y : y + h, x : x + w])
    found, _ = cv2.findContours(
        crop.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE, offset=(x, y)
    )
    largest = max(found, key=cv2.contourArea)
    ys, xs = np.nonzero(crop)
    height, width = mask.shape
    return Outline(
        bbox=(x, y, w, h),
        mask=crop,
        contour=largest.reshape(-1, 2).astype(np.float32),
        centroid=(float(xs.mean()) + x, float(ys.mean()) + y),
        area=float(len(xs)),
        cut=bool(x == 0 or y == 0 or x + w == width or y + h == height),
    )
