"""Segmentation of the object at a point of an image.

The region reachable from the point by colour steps below a threshold grows with the threshold, and jumps
where it spills over the object's edge. The outline is the region before the greatest jump (as for maximally
stable extremal regions, from one seed). Of 93 objects outlined in briefs of real clips and rendered worlds, a
point in their middle gives 70 % with an overlap of half or more (median .73); objects of many colours fail.
"""

from __future__ import annotations

import math
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

SIDE = 320
"""Width to which the image is reduced, pixels: finer detail is texture."""

STEPS = np.arange(1.0, 60.0, 0.5)
"""Tested thresholds, in CIE L*a*b*; larger colour steps do not occur within one object."""

LEAST, MOST = 0.0008, 0.15
"""Shares of the image that an object may cover: less is a speck, more is the ground."""

MIN_JUMP = math.log(1.5)
"""Least logarithmic growth of area that counts as spilling over an edge."""

_CLOSED = 7  # holes and slits narrower than this are closed, pixels of the reduced image


def outline_at_point(
    image: NDArray[np.uint8], at: tuple[float, float]
) -> tuple[tuple[float, float], ...] | None:
    """The outline of the object at a point.

    Args:
        image: (H, W, 3) uint8, BGR.
        at: (x, y) in the image, pixels.

    Returns:
        Corners (x, y) in order, pixels; None where no edge surrounds the point.
    """
    height, width = image.shape[:2]
    if not (0 <= at[0] < width and 0 <= at[1] < height):
        return None
    by = min(1.0, SIDE / max(height, width))
    size = max(1, round(width * by)), max(1, round(height * by))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    calm = cv2.bilateralFilter(small, 7, 30.0, 5.0)
    lab = cv2.cvtColor(calm.astype(np.float32) / np.float32(255.0), cv2.COLOR_BGR2Lab)
    seed = min(size[0] - 1, int(at[0] * by)), min(size[1] - 1, int(at[1] * by))
    reached = _before_the_jump(np.asarray(lab, np.float32), seed)
    if reached is None:
        return None
    closed = cv2.morphologyEx(reached, cv2.MORPH_CLOSE, np.ones((_CLOSED, _CLOSED), np.uint8))
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = cv2.approxPolyDP(max(outlines, key=cv2.contourArea), 1.0, True).reshape(-1, 2)
    if len(largest) < 3:
        return None
    scale = (width / size[0], height / size[1])
    return tuple(
        ((x + 0.5) * scale[0] - 0.5, (y + 0.5) * scale[1] - 0.5) for x, y in largest.tolist()
    )


def _before_the_jump(lab: NDArray[np.float32], seed: tuple[int, int]) -> NDArray[np.uint8] | None:
    """(h, w) of 0 and 1: the region before the greatest jump; None without a jump."""
    whole = lab.shape[0] * lab.shape[1]
    found = [_reached(lab, seed, float(step)) for step in STEPS]
    # Beyond the largest step the region would jump to the whole image.
    areas = [*(int(np.count_nonzero(m)) for m in found), whole]
    best, most = None, MIN_JUMP
    for mask, (area, after) in zip(found, pairwise(areas), strict=True):
        if LEAST * whole <= area <= MOST * whole and math.log(after / area) > most:
            best, most = mask, math.log(after / area)
    return best


def _reached(lab: NDArray[np.float32], seed: tuple[int, int], step: float) -> NDArray[np.uint8]:
    """The region reachable from a point by colour steps up to `step`."""
    mask = np.zeros((lab.shape[0] + 2, lab.shape[1] + 2), np.uint8)
    flags = 4 | cv2.FLOODFILL_MASK_ONLY | (1 << 8)
    cv2.floodFill(lab, mask, seed, (0,) * 3, (step,) * 3, (step,) * 3, flags)
    return mask[1:-1, 1:-1]
