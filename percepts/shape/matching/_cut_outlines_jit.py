"""Compiled loops of `cut_outlines.py`: outlines are cut, brought to a common frame, and compared there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.shape.silhouette._height_functions_jit import (
    aligned,
    complexity,
    heights_along,
    point_costs,
    turned_over,
)

Doubles = NDArray[np.float64]

ON_LINE = 0.03
"""Distance from the line up to which points count as lying on it, units: smoothing rounds its ends."""


@compiled
def kept_part(contour: Doubles, cos: float, sin: float, offset: float, out: Doubles) -> int:
    """What a line leaves of an outline, the line on the right: points (x away from what is cut, y).

    Args:
        contour: (N, 2).
        cos: Of the bearing of the line's outward normal.
        sin: Of the same.
        offset: Of the line from the origin, along the normal.
        out: (2 N, 2), where the points go.

    Returns:
        How many there are.
    """
    count, kept = len(contour), 0
    for i in range(count):
        p, q = contour[i], contour[(i + 1) % count]
        x, y = cos * p[0] + sin * p[1], cos * p[1] - sin * p[0]
        u, v = cos * q[0] + sin * q[1], cos * q[1] - sin * q[0]
        if x <= offset:
            out[kept, 0], out[kept, 1] = x, y
            kept += 1
        if (x <= offset) != (u <= offset):
            part = (offset - x) / (u - x)
            out[kept, 0], out[kept, 1] = offset, y + part * (v - y)
            kept += 1
    return kept


@compiled
def normal_form(points: Doubles, mirror: bool) -> None:
    """Move a polygon (N, 2) to its centroid and scale it to unit area, in place; mirrored top to bottom."""
    count, double, x, y = len(points), 0.0, 0.0, 0.0
    for i in range(count):
        p, q = points[i], points[(i + 1) % count]
        cross = p[0] * q[1] - q[0] * p[1]
        double += cross
        x += (p[0] + q[0]) * cross
        y += (p[1] + q[1]) * cross
    if abs(double) < 1e-12:
        return
    x, y = x / (3.0 * double), y / (3.0 * double)
    scale = 1.0 / np.sqrt(max(abs(double) / 2.0, 1e-9))
    for i in range(count):
        points[i, 0] = (points[i, 0] - x) * scale
        points[i, 1] = (points[i, 1] - y) * scale
    if mirror:
        for i in range((count + 1) // 2):
            j = count - 1 - i
            ax, ay, bx, by = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
            points[i, 0], points[i, 1] = bx, -by
            points[j, 0], points[j, 1] = ax, -ay


@compiled
def evenly(points: Doubles, out: Doubles) -> None:
    """Even spacing along a polygon (N, 2) from the lower end of its stretch on the right, into (P, 2)."""
    count, wanted = len(points), len(out)
    right = points[:, 0].max()
    first = -1
    for i in range(count):
        if points[i, 0] > right - ON_LINE and (first < 0 or points[i, 1] > points[first, 1]):
            first = i
    length = 0.0
    for i in range(count):
        p, q = points[i], points[(i + 1) % count]
        length += np.sqrt((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2)
    step, done, k = length / wanted, 0.0, 0
    for i in range(count):
        p, q = points[(first + i) % count], points[(first + i + 1) % count]
        edge = np.sqrt((q[0] - p[0]) ** 2 + (q[1] - p[1]) ** 2)
        while k < wanted and k * step <= done + edge:
            part = (k * step - done) / edge if edge > 0.0 else 0.0
            out[k, 0], out[k, 1] = p[0] + part * (q[0] - p[0]), p[1] + part * (q[1] - p[1])
            k += 1
        done += edge
    while k < wanted:
        out[k] = out[k - 1]
        k += 1


@compiled
def framed(contour: Doubles, line: Doubles, mirror: bool, scratch: Doubles, out: Doubles) -> None:
    """An outline once it is cut, in normal form, the line on the right, begun at the line's lower end.

    Args:
        contour: (N, 2).
        line: Cosine and sine of its bearing, and its offset; infinite where all is kept.
        mirror: Whether it is mirrored top to bottom then.
        scratch: (2 N, 2) at least.
        out: (P, 2).
    """
    kept = kept_part(contour, line[0], line[1], line[2], scratch)
    if kept < 3:
        kept = kept_part(contour, line[0], line[1], np.inf, scratch)
    normal_form(scratch[:kept], mirror)
    evenly(scratch[:kept], out)


@compiled
def compare_cut(
    own: NDArray[np.float32],
    contours: tuple[Doubles, NDArray[np.intp]],
    lines: Doubles,
    alignment: tuple[NDArray[np.intp], int, float],
    out: Doubles,
) -> None:
    """Compare a cut silhouette with views cut likewise, all in one frame, without any rotation to find.

    Args:
        own: (P, H) heights of the silhouette's outline as `framed`.
        contours: Points of all views one after another (M, 2), and where each begins and the last ends.
        lines: (K, 4) cosine, sine, offset, and 1 for what is mirrored.
        alignment: Stretches of heights, band and price of a step aside.
        out: (K, 2): mean cost of the best alignment, complexity of the outline.
    """
    points, starts = contours
    stops, band, skip = alignment
    count, width = own.shape
    outline, heights = np.empty((count, 2)), np.empty((count, width), np.float32)
    costs, other = np.empty((count, count), np.float32), np.empty((width, count), np.float32)
    lanes = np.empty((3, 2 * band + 1), np.float32)
    scratch = np.empty((2 * len(points) + 2, 2))
    for k in range(len(lines)):
        contour = points[starts[k] : starts[k + 1]]
        framed(contour, lines[k], lines[k, 3] > 0.0, scratch, outline)
        heights_along(outline, stops, heights)
        turned_over(heights, False, other)
        point_costs(own, other, costs)
        out[k, 0] = aligned(costs, 0, band, skip, lanes)
        out[k, 1] = complexity(heights)
