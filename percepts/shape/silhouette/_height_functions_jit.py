"""Compiled loops of `height_functions.py`: heights along outlines, their point costs, their alignment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float32]


@compiled
def heights_along(points: NDArray[np.float64], stops: NDArray[np.intp], out: Floats) -> None:
    """Height functions of an outline of P points, as `outline_heights` defines them, into (P, H)."""
    count, heights = len(points), len(stops) - 1
    # The outline is repeated, so that the stretch after any point needs no wrap-around.
    x, y = np.empty(2 * count), np.empty(2 * count)
    for i in range(count):
        x[i] = x[i + count] = points[i, 0]
        y[i] = y[i + count] = points[i, 1]
    for i in range(count):
        along_x, along_y = x[i + 1] - x[i - 1 + count], y[i + 1] - y[i - 1 + count]
        length = np.sqrt(along_x * along_x + along_y * along_y) + 1e-12
        along_x, along_y = along_x / length, along_y / length
        own = along_x * y[i] - along_y * x[i]
        for k in range(heights):
            right, down = 0.0, 0.0
            for j in range(i + 1 + stops[k], i + 1 + stops[k + 1]):
                right += x[j]
                down += y[j]
            steps = stops[k + 1] - stops[k]
            out[i, k] = (along_x * down - along_y * right) / steps - own
    for k in range(heights):
        most = 0.0
        for i in range(count):
            most = max(most, abs(out[i, k]))
        for i in range(count):
            out[i, k] /= most + 0.05


@compiled
def complexity(heights: Floats) -> float:
    """Variation of heights along an outline: the mean of their standard deviations."""
    count, width = heights.shape
    total = 0.0
    for k in range(width):
        mean, square = 0.0, 0.0
        for i in range(count):
            mean += heights[i, k]
        mean /= count
        for i in range(count):
            square += (heights[i, k] - mean) ** 2
        total += np.sqrt(square / count)
    return float(total / width)


@compiled
def transposed_heights(heights: Floats, mirror: bool, out: Floats) -> None:
    """Heights (P, H), or those of the mirror image, as (H, P)."""
    count, width = heights.shape
    for i in range(count):
        for k in range(width):
            if mirror:
                out[width - 1 - k, count - 1 - i] = heights[i, k]
            else:
                out[k, i] = heights[i, k]


@compiled
def point_costs(first: Floats, second: Floats, costs: Floats) -> None:
    """Root mean squared differences between all points of both, (P, P).

    Args:
        first: (P, H).
        second: (H, P).
        costs: Output, (P, P).
    """
    count, width = first.shape
    share = np.float32(1.0 / width)
    costs[:] = 0.0
    for i in range(count):
        for k in range(width):
            own = first[i, k]
            for j in range(count):
                apart = own - second[k, j]
                costs[i, j] += apart * apart
        for j in range(count):
            costs[i, j] = np.sqrt(costs[i, j] * share)


@compiled
def alignment_cost(costs: Floats, diagonal: int, band: int, skip: float, lanes: Floats) -> float:
    """Least mean cost of an alignment within a band about a diagonal; sideways steps cost `skip`.

    Args:
        costs: (P, P).
        diagonal: Point of the second outline where the middle of the band starts.
        band: Diagonals on either side.
        skip: Price of a sideways step.
        lanes: (3, 2 * band + 1), scratch.
    """
    count, width = len(costs), 2 * band + 1
    price = np.float32(skip)
    now, then, here = lanes[0], lanes[1], lanes[2]
    now[:] = 0.0
    for i in range(count):
        start = (i + diagonal - band + count) % count
        ahead = min(width, count - start)
        for k in range(ahead):
            here[k] = costs[i, start + k]
        for k in range(ahead, width):
            here[k] = costs[i, k - ahead]
        if i == 0:
            then[:] = here
        else:
            then[0] = min(now[0], now[1] + price) + here[0]
            for k in range(1, width - 1):
                aside = min(now[k - 1], now[k + 1]) + price
                then[k] = min(now[k], aside) + here[k]
            then[width - 1] = min(now[width - 1], now[width - 2] + price) + here[width - 1]
        now, then = then, now
    return float(now.min() / count)


@compiled
def best_diagonals(costs: Floats, sums: NDArray[np.float64], best: NDArray[np.intp]) -> int:
    """The diagonals whose sums are local minima, smallest first.

    Args:
        costs: (P, P).
        sums: (P,), scratch.
        best: Receives their numbers, as many as fit.

    Returns:
            How many were found.
    """
    count, wanted = len(costs), len(best)
    for d in range(count):
        total = 0.0
        for i in range(count - d):
            total += costs[i, i + d]
        for i in range(count - d, count):
            total += costs[i, i + d - count]
        sums[d] = total
    found = 0
    for d in range(count):
        if sums[d] > sums[d - 1] or sums[d] > sums[(d + 1) % count]:
            continue
        place = found
        while place > 0 and sums[d] < sums[best[place - 1]]:
            if place < wanted:
                best[place] = best[place - 1]
            place -= 1
        if place < wanted:
            best[place] = d
            found = min(found + 1, wanted)
    return found


@compiled
def alignments(
    first: Floats, second: Floats, rotations: int, band: int, skip: float, out: NDArray[np.float64]
) -> None:
    """Least mean costs of pairs of outlines, as they are and mirrored, over the best few rotations.

    Args:
        first: (B, P, H), or (1, P, H) to compare one with all.
        second: (B, P, H).
        rotations: How many rotations of each are tried.
        band: Diagonals on either side of each.
        skip: Price of a sideways step.
        out: (B, 2).
    """
    size, count, width = second.shape
    costs, lanes = np.empty((count, count), np.float32), np.empty((3, 2 * band + 1), np.float32)
    other = np.empty((width, count), np.float32)
    sums, best = np.empty(count, np.float64), np.empty(rotations, np.intp)
    for b in range(size):
        for side in range(2):
            transposed_heights(second[b], side == 1, other)
            point_costs(first[b if len(first) > 1 else 0], other, costs)
            found = best_diagonals(costs, sums, best)
            least = np.inf
            for k in range(found):
                least = min(least, alignment_cost(costs, best[k], band, skip, lanes))
            out[b, side] = least
