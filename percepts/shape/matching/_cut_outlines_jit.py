"""Compiled loops of `cut_outlines.py`: cutting outlines, aligning them to a common frame, comparing them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.shape.silhouette._height_functions_jit import (
    alignment_cost,
    complexity,
    heights_along,
    point_costs,
    transposed_heights,
)

Doubles = NDArray[np.float64]

ON_LINE = 0.03
"""Points this near to the line count as on it, units: smoothing rounds its ends."""


@compiled
def clip_by_line(contour: Doubles, cos: float, sin: float, offset: float, out: Doubles) -> int:
    """Clip an outline by a line and rotate it so that the line is on the right.

    Args:
        contour: (N, 2).
        cos: Cosine of the bearing of the line's outward normal.
        sin: Its sine.
        offset: Distance of the line from the origin, along the normal.
        out: (2 N, 2), receives the points.

    Returns:
        The number of points.
    """
    count, remaining = len(contour), 0
    for i in range(count):
        p, q = contour[i], contour[(i + 1) % count]
        x, y = cos * p[0] + sin * p[1], cos * p[1] - sin * p[0]
        u, v = cos * q[0] + sin * q[1], cos * q[1] - sin * q[0]
        if x <= offset:
            out[remaining, 0], out[remaining, 1] = x, y
            remaining += 1
        if (x <= offset) != (u <= offset):
            part = (offset - x) / (u - x)
            out[remaining, 0], out[remaining, 1] = offset, y + part * (v - y)
            remaining += 1
    return remaining


@compiled
def normalise_polygon(points: Doubles, mirror: bool) -> None:
    """Centre a polygon (N, 2), scale it to unit area and optionally mirror it top to bottom, in place."""
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
def resample_evenly(points: Doubles, out: Doubles) -> None:
    """Resample a polygon (N, 2) evenly into (P, 2), from the lower end of its right edge."""
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
def to_common_frame(
    contour: Doubles, line: Doubles, mirror: bool, scratch: Doubles, out: Doubles
) -> None:
    """A cut outline in normal form, with the line on the right, starting at its lower end.

    Args:
        contour: (N, 2).
        line: Cosine and sine of its bearing, and its offset; infinite for no cut.
        mirror: Whether to mirror it top to bottom afterwards.
        scratch: (2 N, 2) at least.
        out: (P, 2).
    """
    remaining = clip_by_line(contour, line[0], line[1], line[2], scratch)
    if remaining < 3:
        remaining = clip_by_line(contour, line[0], line[1], np.inf, scratch)
    normalise_polygon(scratch[:remaining], mirror)
    resample_evenly(scratch[:remaining], out)


@compiled
def compare_cut(
    own: NDArray[np.float32],
    contours: tuple[Doubles, NDArray[np.intp]],
    lines: Doubles,
    alignment: tuple[NDArray[np.intp], int, float],
    out: Doubles,
) -> None:
    """Compare a cut silhouette with views cut likewise, in a common frame, without a rotation search.

    Args:
        own: (P, H) heights of the silhouette's outline as `to_common_frame`.
        contours: Concatenated points of all views (M, 2), and the start of each and the end of the last.
        lines: (K, 4) cosine, sine, offset, and 1 for mirrored.
        alignment: Stretches of heights, band, and price of a sideways step.
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
        to_common_frame(contour, lines[k], lines[k, 3] > 0.0, scratch, outline)
        heights_along(outline, stops, heights)
        transposed_heights(heights, False, other)
        point_costs(own, other, costs)
        out[k, 0] = alignment_cost(costs, 0, band, skip, lanes)
        out[k, 1] = complexity(heights)
