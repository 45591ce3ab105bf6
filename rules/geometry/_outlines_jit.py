"""Compiled geometry of outlines: support functions, distances, registration.

An outline is a ring of points, with a bounding box per run of `RUN` points. A nearest-point search visits
only runs whose boxes are nearer than the best so far, starting from the run of the previous point's result.
Neighbours on one outline have neighbours on the other, so hardly more than one run is visited; the result is
exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float64]

RUN = 16
"""Neighbouring points that share a box."""


@compiled
def run_boxes(points: Floats) -> Floats:
    """(R, 4) left, top, right, bottom of each run of an outline (N, 2), pixels."""
    count = len(points)
    runs = (count + RUN - 1) // RUN
    boxes = np.empty((runs, 4))
    for k in range(runs):
        first = k * RUN
        left, top = points[first, 0], points[first, 1]
        right, bottom = left, top
        for n in range(first + 1, min(count, first + RUN)):
            x, y = points[n, 0], points[n, 1]
            left, top = min(left, x), min(top, y)
            right, bottom = max(right, x), max(bottom, y)
        boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3] = left, top, right, bottom
    return boxes


@compiled
def outline_support(
    points: Floats,
    directions: Floats,
    width: float,
    height: float,
    support: Floats,
    free: NDArray[np.bool_],
) -> None:
    """Support function of an outline, and whether it is clear of the border there.

    Args:
        points: (N, 2) pixels.
        directions: (K, 2) unit vectors.
        width: Image width, pixels.
        height: Image height, pixels.
        support: (K,) output: max of p . n, pixels.
        free: (K,) output: whether the farthest point is clear of the image border.
    """
    for k in range(len(directions)):
        nx, ny = directions[k, 0], directions[k, 1]
        most, at = -np.inf, 0
        for n in range(len(points)):
            along = nx * points[n, 0] + ny * points[n, 1]
            if along > most:
                most, at = along, n
        x, y = points[at, 0], points[at, 1]
        support[k] = most
        free[k] = x > 1.5 and y > 1.5 and x < width - 2.5 and y < height - 2.5


@compiled
def _in_run(
    x: float, y: float, points: Floats, run: int, best: float, found: int
) -> tuple[float, int]:
    """The nearer of the best so far and the points of a run: squared distance and point."""
    for n in range(run * RUN, min(len(points), run * RUN + RUN)):
        dx, dy = points[n, 0] - x, points[n, 1] - y
        far = dx * dx + dy * dy
        if far < best:
            best, found = far, n
    return best, found


@compiled
def _nearest(
    x: float, y: float, points: Floats, boxes: Floats, start: int, bound: float
) -> tuple[float, int]:
    """The point nearest to (x, y) and nearer than a bound.

    Args:
        x: Pixels.
        y: Pixels.
        points: (N, 2) pixels.
        boxes: (R, 4) boxes of its runs.
        start: The run to visit first.
        bound: Squared distance beyond which points are ignored.

    Returns:
        Squared distance and number of the point; the bound and -1 when there is none.
    """
    best, found = _in_run(x, y, points, start, bound, -1)
    for run in range(len(boxes)):
        dx = max(boxes[run, 0] - x, x - boxes[run, 2], 0.0)
        dy = max(boxes[run, 1] - y, y - boxes[run, 3], 0.0)
        if dx * dx + dy * dy < best and run != start:
            best, found = _in_run(x, y, points, run, best, found)
    return best, found


@compiled
def least_distance(
    first: Floats, first_boxes: Floats, second: Floats, second_boxes: Floats, bound: float
) -> float:
    """Distance of the nearest points of two outlines, pixels; infinite beyond the bound."""
    best = np.nextafter(bound * bound, np.inf)
    for k in range(len(first_boxes)):
        box = first_boxes[k]
        for run in range(len(second_boxes)):
            dx = max(second_boxes[run, 0] - box[2], box[0] - second_boxes[run, 2], 0.0)
            dy = max(second_boxes[run, 1] - box[3], box[1] - second_boxes[run, 3], 0.0)
            if dx * dx + dy * dy < best:
                for n in range(k * RUN, min(len(first), k * RUN + RUN)):
                    best, _ = _in_run(first[n, 0], first[n, 1], second, run, best, 0)
    return np.sqrt(best) if best <= bound * bound else np.inf


@compiled
def signed_extent(
    points: Floats, step: int, other: Floats, boxes: Floats, mask: NDArray[np.bool_], x: int, y: int
) -> tuple[float, float]:
    """Least and greatest signed distance of an outline's points to a region.

    Args:
        points: (N, 2) pixels.
        step: Only every `step`-th point is used.
        other: (K, 2) outline of the region.
        boxes: (R, 4) boxes of its runs.
        mask: (h, w) the region.
        x: Left of the mask, pixels.
        y: Top of the mask, pixels.

    Returns:
        Pixels, negative inside.
    """
    least, most, start = np.inf, -np.inf, 0
    height, width = mask.shape
    for n in range(0, len(points), step):
        far, at = _nearest(points[n, 0], points[n, 1], other, boxes, start, np.inf)
        start = at // RUN
        far = np.sqrt(far)
        column, row = int(np.rint(points[n, 0])) - x, int(np.rint(points[n, 1])) - y
        if 0 <= column < width and 0 <= row < height and mask[row, column]:
            far = -far
        least, most = min(least, far), max(most, far)
    return least, most


@compiled
def near_outline(points: Floats, other: Floats, boxes: Floats, bound: float) -> NDArray[np.bool_]:
    """(N,) whether points are within a bound, pixels, of an outline."""
    near = np.empty(len(points), np.bool_)
    start = 0
    for n in range(len(points)):
        _, at = _nearest(points[n, 0], points[n, 1], other, boxes, start, bound * bound)
        near[n] = at >= 0
        start = at // RUN if at >= 0 else start
    return near


@compiled
def resampled(points: Floats, count: int) -> Floats:
    """A closed outline (N, 2) resampled to `count` evenly spaced points."""
    size = len(points)
    along = np.empty(size + 1)
    along[0] = 0.0
    for n in range(size):
        m = n + 1 if n + 1 < size else 0
        dx, dy = points[m, 0] - points[n, 0], points[m, 1] - points[n, 1]
        along[n + 1] = along[n] + np.sqrt(dx * dx + dy * dy)
    out = np.empty((count, 2))
    step, n = along[size] / count, 0
    for k in range(count):
        at = k * step
        while n < size - 1 and along[n + 1] <= at:
            n += 1
        m = n + 1 if n + 1 < size else 0
        length = along[n + 1] - along[n]
        for i in range(2):
            slope = (points[m, i] - points[n, i]) / length if length > 0.0 else 0.0
            out[k, i] = slope * (at - along[n]) + points[n, i]
    return out


@compiled
def longest_edge(points: Floats) -> float:
    """Greatest distance of neighbouring points of a closed outline (N, 2), pixels."""
    widest = 0.0
    for n in range(len(points)):
        dx, dy = points[n, 0] - points[n - 1, 0], points[n, 1] - points[n - 1, 1]
        widest = max(widest, dx * dx + dy * dy)
    return float(np.sqrt(widest))


@compiled
def icp_step(normals: Floats, off: Floats, count: int, wild: float) -> tuple[bool, float, float]:
    """The translation that moves points onto an outline, by weighted least squares across it.

    Args:
        normals: (N, 2) unit vectors across the outline.
        off: (N, 2) from each point to its match on the outline, pixels.
        count: Number of matches.
        wild: Distance beyond which a point is down-weighted, pixels.

    Returns:
            Whether it is determined, and (x, y) pixels. It is not where the outline has a single
            direction, so that motion along it is unobservable.
    """
    xx = xy = yy = bx = by = 0.0
    for n in range(count):
        nx, ny = normals[n, 0], normals[n, 1]
        across = off[n, 0] * nx + off[n, 1] * ny
        weight = 1.0 / max(abs(across), wild)
        wx, wy = weight * nx, weight * ny
        xx, xy, yy = xx + wx * nx, xy + wx * ny, yy + wy * ny
        bx, by = bx + wx * across, by + wy * across
    mean, half = 0.5 * (xx + yy), np.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    if mean + half > 50.0 * (mean - half):  # the ratio of the eigenvalues
        return False, 0.0, 0.0
    determinant = xx * yy - xy * xy
    return True, (yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant


@compiled
def register(
    points: Floats,
    normals: Floats,
    shift: tuple[float, float],
    target: Floats,
    boxes: Floats,
    limits: tuple[float, float, float],
) -> tuple[bool, float, float]:
    """Register an outline to a later one, by iterated closest points.

    Args:
        points: (N, 2) pixels.
        normals: (N, 2) unit vectors across the outline.
        shift: (x, y) initial translation, pixels.
        target: (K, 2) the later outline.
        boxes: (R, 4) boxes of its runs.
        limits: Most distance of a match, pixels; fewest matches; distance beyond which a point is
            down-weighted, pixels.

    Returns:
        Whether enough points match, and the new translation.
    """
    reach, least, wild = limits
    x, y = shift
    across, off = np.empty_like(normals), np.empty_like(normals)
    last = np.full(len(points), -1)
    for _ in range(4):
        found = start = 0
        for n in range(len(points)):
            px, py = points[n, 0] + x, points[n, 1] + y
            # In the first iteration points have no run yet; their neighbour's is the next best.
            start = last[n] if last[n] >= 0 else start
            _, at = _nearest(px, py, target, boxes, start, reach * reach)
            if at >= 0:
                start = at // RUN
                last[n] = start
                across[found] = normals[n]
                off[found, 0], off[found, 1] = target[at, 0] - px, target[at, 1] - py
                found += 1
        if found < least:
            return False, x, y
        known, dx, dy = icp_step(across, off, found, wild)
        if not known:
            return False, x, y
        x, y = x + dx, y + dy
        if max(abs(dx), abs(dy)) < 0.02:
            break
    return True, x, y
