"""How much of the outline of one region lies along another one.

Two that lie against each other share a side, as a boat alongside a pier; two of which one stands before the
other at a distance meet at a mast or a corner only, however much their boxes overlap.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from visup.agent import Region
from visup.rules.geometry.outlines import CACHED_REGIONS, prepared_outline
from visup.rules.geometry.regions import box_gap


def common_border(a: Region, b: Region, near: float) -> float:
    """Share of one outline that lies along the other region, or within it, the greater one of the two.

    Args:
        a: One region.
        b: Another.
        near: Greatest gap, pixels.

    Returns:
        0 to 1, 0 where the gap is greater everywhere. What lies in a hole of the other may lie along its rim.
    """
    if box_gap(a.bbox, b.bbox) > near:
        return 0.0
    return max(_share(a, b, near), _share(b, a, near))


@lru_cache(maxsize=8 * CACHED_REGIONS)
def _share(a: Region, b: Region, near: float) -> float:
    """Share of the outline of a region along another one."""
    points = np.rint(prepared_outline(a).even).astype(int)
    (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0) + 1
    margin = int(np.ceil(near)) + 2
    left, top, right, bottom = left - margin, top - margin, right + margin, bottom + margin
    body = np.zeros((bottom - top, right - left), dtype=np.uint8)
    x, y, width, height = b.bbox
    x0, y0, x1, y1 = max(x, left), max(y, top), min(x + width, right), min(y + height, bottom)
    if x0 >= x1 or y0 >= y1:
        return 0.0
    body[y0 - top : y1 - top, x0 - left : x1 - left] = b.mask[y0 - y : y1 - y, x0 - x : x1 - x]
    if not body.any():
        return 0.0
    away = cv2.distanceTransform(1 - body, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # Outlines of adjacent regions are one pixel apart.
    along = away[points[:, 1] - top, points[:, 0] - left] <= near + 1.0
    return float(np.count_nonzero(along)) / len(points)
