"""Snapping a roughly drawn outline to the edges of what it encloses, by GrabCut.

Rother, Kolmogorov and Blake, "GrabCut": interactive foreground extraction using iterated graph cuts, 2004.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.teaching.outlines import DrawnOutline

_ITERATIONS = 3
_MAX_SIDE = 320  # longer side of the part of the picture that is cut out, pixels at most
_BAND = 0.06  # how far the drawn outline may be off, of the thing's size
_MIN_AREA_RATIO, _MAX_AREA_RATIO = (
    0.5,
    1.6,
)  # share of the drawn area that may be left or come to be
_SEED = 7


def snapped(picture: NDArray[np.uint8], outline: DrawnOutline) -> DrawnOutline:
    """An outline snapped to nearby edges; unchanged where there are none.

    Args:
        picture: (H, W, 3) uint8, BGR.
        outline: Drawn by hand, a little off.
    """
    x, y, width, height = _crop_box(picture, outline)
    small = min(1.0, _MAX_SIDE / max(width, height))
    size = max(1, round(width * small)), max(1, round(height * small))
    part = cv2.resize(picture[y : y + height, x : x + width], size, interpolation=cv2.INTER_AREA)
    scale = np.array([size[0] / width, size[1] / height])
    drawn = np.zeros(part.shape[:2], np.uint8)
    corners = (np.array(outline.corners) - (x, y)) * scale
    cv2.fillPoly(drawn, [np.round(corners).astype(np.int32)], (1,))
    found = _segmented_outline(np.asarray(part, np.uint8), drawn)
    if found is None:
        return outline
    placed = found / scale + (x, y)
    return DrawnOutline(
        outline.name, tuple((round(float(a), 1), round(float(b), 1)) for a, b in placed)
    )


def _crop_box(picture: NDArray[np.uint8], outline: DrawnOutline) -> tuple[int, int, int, int]:
    corners = np.array(outline.corners)
    margin = 0.35 * float(np.ptp(corners, axis=0).max()) + 4
    height, width = picture.shape[:2]
    left, top = np.clip(np.floor(corners.min(axis=0) - margin), 0, (width - 1, height - 1))
    right, bottom = np.clip(np.ceil(corners.max(axis=0) + margin), 1, (width, height))
    return int(left), int(top), max(1, int(right - left)), max(1, int(bottom - top))


def _segmented_outline(
    part: NDArray[np.uint8], drawn: NDArray[np.uint8]
) -> NDArray[np.float64] | None:
    """The outline of what is cut out, (N, 2), or None where that is nothing like what was drawn."""
    area = int(np.count_nonzero(drawn))
    band = max(2, round(_BAND * area**0.5))
    ring = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * band + 1, 2 * band + 1))
    mask = np.full(drawn.shape, cv2.GC_BGD, np.uint8)
    mask[cv2.dilate(drawn, ring) > 0] = cv2.GC_PR_BGD
    mask[drawn > 0] = cv2.GC_PR_FGD
    mask[cv2.erode(drawn, ring) > 0] = cv2.GC_FGD
    if not (mask == cv2.GC_FGD).any() or not (mask == cv2.GC_BGD).any():
        return None
    cv2.setRNGSeed(_SEED)
    cv2.grabCut(
        part,
        mask,
        (0, 0, 1, 1),
        np.zeros((1, 65)),
        np.zeros((1, 65)),
        _ITERATIONS,
        cv2.GC_INIT_WITH_MASK,
    )
    inside = ((mask == cv2.GC_FGD) | (mask == cv2.GC_PR_FGD)).astype(np.uint8)
    inside = cv2.morphologyEx(inside, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    outlines, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = max(outlines, key=cv2.contourArea, default=None)
    if (
        largest is None
        or not _MIN_AREA_RATIO * area <= cv2.contourArea(largest) <= _MAX_AREA_RATIO * area
    ):
        return None
    simplified = cv2.approxPolyDP(largest, 1.0, True).reshape(-1, 2)
    return simplified.astype(np.float64) if len(simplified) >= 3 else None
