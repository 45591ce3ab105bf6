"""Outlines of regions that are seen in several parts, one closed ring for each part.

An arm that leaves the image at the top and comes back in beside, or a body with a bar before it, is one
region in pieces. The contour of a region is that of its largest piece; who holds something with another piece
would be far from it, and a body would jump whenever another piece becomes the largest one.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from visup.agent import Region
from visup.rules.geometry._outlines_jit import longest_edge, resampled
from visup.rules.geometry.regions import Floats, densified, outline

MIN_SHARE = 0.15
"""Least share of a region's pixels in a part of it; smaller ones are specks of a segmenter."""


def rings(region: Region) -> list[Floats]:
    """The outlines of the parts of a region.

    Args:
        region: Any region.

    Returns:
        (N, 2) float each, pixels, the largest part first; the contour alone where it is all of the region,
        or the corners of its box if it has none.
    """
    contour = outline(region)
    least = MIN_SHARE * region.area
    if not len(region.contour) or region.area - _pixels(region.contour) < least:
        return [contour]
    x, y, _, _ = region.bbox
    found, _ = cv2.findContours(
        np.ascontiguousarray(region.mask).view(np.uint8),
        cv2.RETR_EXTERNAL,
        cv2.CHAIN_APPROX_NONE,
        offset=(x, y),
    )
    parts = sorted((p for p in found if _pixels(p) >= least), key=_pixels, reverse=True)
    if len(parts) < 2:
        return [contour]
    return [np.array(p, dtype=float, order="C").reshape(-1, 2) for p in parts]


def _pixels(ring: cv2.typing.MatLike) -> float:
    """Pixels on and within a ring of neighbouring pixels, by Pick's theorem."""
    return float(cv2.contourArea(ring)) + len(ring) / 2 + 1


def closed_rings(parts: Sequence[Floats], step: float) -> Floats:
    """(M, 2) points of rings, neighbours at most `step` pixels apart."""
    return concatenated([p if longest_edge(p) <= step else densified(p, step) for p in parts])


def even_rings(parts: Sequence[Floats], count: int) -> list[Floats]:
    """Rings resampled evenly, to some `count` points in all, at least one for each."""
    if len(parts) == 1:
        return [resampled(parts[0], count)]
    total = sum(map(len, parts))
    return [resampled(p, max(1, round(count * len(p) / total))) for p in parts]


def concatenated(parts: Sequence[Floats]) -> Floats:
    """(M, 2) points of all rings."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
