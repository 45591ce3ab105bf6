"""Plane geometry of outlines and boxes, for many objects at once.

Everything is in image coordinates (pixels, x right, y down). The support function of an outline in direction
n is max(p . n), how far it reaches that way. From the support functions of two outlines in a fixed fan of
directions, array arithmetic gives the signed distance of their convex hulls and, over time, their velocities,
without relying on the centroid of a body cut off by the image border.
"""

from __future__ import annotations

from math import hypot

import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.compiled import compiled

Floats = NDArray[np.float64]
Box = tuple[int, int, int, int]

FAN = 16
_ANGLES = 2.0 * np.pi * np.arange(FAN) / FAN
DIRECTIONS: Floats = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)
"""(16, 2) unit vectors, evenly round the circle; the opposite of row k is row k + 8 modulo 16."""

RCC8 = (
    "disconnected",
    "externally_connected",
    "partially_overlapping",
    "equal",
    "tangential_proper_part",
    "non_tangential_proper_part",
    "tangential_proper_part_inverse",
    "non_tangential_proper_part_inverse",
)
"""Names of the eight relations of the region connection calculus, by their code."""


def outline(region: Region) -> Floats:
    """Contour of a region, or the corners of its box if it has none.

    Args:
        region: Any region.

    Returns:
        (N, 2) float, pixels, N >= 1; an array of its own, row by row.
    """
    if len(region.contour):
        return np.array(region.contour, dtype=float, order="C").reshape(-1, 2)
    x, y, w, h = region.bbox
    right, bottom = x + max(w, 1) - 1, y + max(h, 1) - 1
    return np.array([[x, y], [right, y], [right, bottom], [x, bottom]], dtype=float)


def hull_separation(support: Floats) -> Floats:
    """Signed distances between the convex hulls of all pairs of outlines.

    By the separating axis theorem the signed distance is the greatest of -(h_a(n) + h_b(-n)) over
    all directions n; with 16 of them it is at most 2 % too small for hulls that are apart.

    Args:
        support: (M, 16) float, pixels, rows from `outlines.reach`; NaN rows for invisible objects.

    Returns:
        (M, M) float, pixels; positive apart, negative the depth of penetration.
    """
    return _separations(np.ascontiguousarray(support))


@compiled
def _separations(support: Floats) -> Floats:
    count, fan = support.shape
    apart = np.empty((count, count))
    for i in range(count):
        for j in range(count):
            least = np.inf
            for k in range(fan):
                least = min(least, support[i, k] + support[j, (k + fan // 2) % fan])
            known = not (np.isnan(support[i, 0]) or np.isnan(support[j, 0]))
            apart[i, j] = -least if known else np.nan
    return apart


def masks_overlap(a: Region, b: Region) -> bool:
    """Whether two regions share a pixel."""
    return shared_pixels(a, b) > 0


def shared_pixels(a: Region, b: Region) -> int:
    """Number of pixels shared by two regions."""
    x0, y0 = max(a.bbox[0], b.bbox[0]), max(a.bbox[1], b.bbox[1])
    x1 = min(a.bbox[0] + a.bbox[2], b.bbox[0] + b.bbox[2])
    y1 = min(a.bbox[1] + a.bbox[3], b.bbox[1] + b.bbox[3])
    if x0 >= x1 or y0 >= y1:
        return 0
    return int(np.count_nonzero(_crop(a, x0, y0, x1, y1) & _crop(b, x0, y0, x1, y1)))


def pixels_in(region: Region, box: Box) -> int:
    """Number of pixels of a region in a box."""
    x0, y0 = max(region.bbox[0], box[0]), max(region.bbox[1], box[1])
    x1 = min(region.bbox[0] + region.bbox[2], box[0] + box[2])
    y1 = min(region.bbox[1] + region.bbox[3], box[1] + box[3])
    if x0 >= x1 or y0 >= y1:
        return 0
    return int(np.count_nonzero(_crop(region, x0, y0, x1, y1)))


def _crop(region: Region, x0: int, y0: int, x1: int, y1: int) -> NDArray[np.bool_]:
    x, y, _, _ = region.bbox
    return region.mask[y0 - y : y1 - y, x0 - x : x1 - x]


def box_gap(a: Box, b: Box) -> float:
    """Distance between two boxes, pixels; 0 where they meet or overlap."""
    dx = max(a[0] - (b[0] + b[2]), b[0] - (a[0] + a[2]), 0)
    dy = max(a[1] - (b[1] + b[3]), b[1] - (a[1] + a[3]), 0)
    return hypot(dx, dy)


def box_intersection(a: Box, b: Box) -> float:
    """Area of the intersection of two boxes, square pixels."""
    w = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    h = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return float(max(0, w) * max(0, h))


def box_iou(a: Box, b: Box) -> float:
    """Intersection over union of two boxes, 0 to 1."""
    shared = box_intersection(a, b)
    union = a[2] * a[3] + b[2] * b[3] - shared
    return shared / union if union > 0 else 0.0


def expanded(box: Box, margin: int) -> Box:
    """A box made larger by `margin` pixels on each side."""
    return (box[0] - margin, box[1] - margin, box[2] + 2 * margin, box[3] + 2 * margin)


def shifted(box: Box, dx: float, dy: float) -> Box:
    """A box moved by (dx, dy) pixels, rounded."""
    return (round(box[0] + dx), round(box[1] + dy), box[2], box[3])


def shifted_region(region: Region, dx: float, dy: float) -> Region:
    """A region translated by whole pixels.

    Args:
        region: Any region.
        dx: Pixels to the right, rounded.
        dy: Pixels down, rounded.

    Returns:
        A region whose box, contour and centroid are shifted; the mask is shared.
    """
    step = np.array([round(dx), round(dy)], dtype=np.float32)
    return Region(
        id=region.id,
        bbox=shifted(region.bbox, float(step[0]), float(step[1])),
        mask=region.mask,
        contour=region.contour + step,
        centroid=(region.centroid[0] + float(step[0]), region.centroid[1] + float(step[1])),
        area=region.area,
        velocity=region.velocity,
        velocity_sigma=region.velocity_sigma,
        motion=region.motion,
        cut=region.cut,
        confidence=region.confidence,
    )


def densified(points: Floats, step: float = 2.0) -> Floats:
    """A closed outline with points at most `step` pixels apart; unchanged where it already has."""
    to = np.roll(points, -1, axis=0)
    length = np.hypot(*(to - points).T)
    if length.max() <= step:
        return points
    parts = np.ceil(np.maximum(length, 1e-9) / step).astype(int)
    start = np.repeat(np.arange(len(points)), parts)
    share = (np.arange(len(start)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[start]
    return np.asarray(points[start] + share[:, None] * (to - points)[start])


def image_diagonal(frame_size: tuple[int, int]) -> float:
    """Image diagonal, pixels; the unit of relative thresholds."""
    return hypot(*frame_size)
