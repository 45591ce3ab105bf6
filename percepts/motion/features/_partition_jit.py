"""Compiled loops of `superpixels`: the watershed, adjacency of its cells, and their Laplacian."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Labels = NDArray[np.int32]
Bytes = NDArray[np.uint8]
Pixels = NDArray[np.uint32]

LINE, WAITS = -1, -2  # labels of pixels on a boundary, and of pixels in a queue
LEVELS = 256


@compiled
def watershed(right: Bytes, down: Bytes, marks: Labels) -> None:
    """Seeded watershed: pixel for pixel the result of `cv2.watershed`, in a third to half of its time.

    Pixels beside the cells wait in one first-in, first-out queue for each edge strength; the weakest is
    emptied first. A pixel between two cells becomes a boundary.

    Args:
        right: (h, w) how far each pixel differs from the next one; the last in a row is not used.
        down: (h - 1, w) how far each differs from the one below.
        marks: (h, w) int32, seeds from 1 and 0 elsewhere; becomes the cells, -1 between them and at
            the border of the image. Pixels that no seed reaches stay 0.
    """
    height, width = marks.shape
    flat, east, south = marks.ravel(), right.ravel(), down.ravel()
    one, row = np.uint64(1), np.uint64(width)
    marks[0], marks[height - 1] = LINE, LINE
    marks[:, 0], marks[:, width - 1] = LINE, LINE
    after, first, last = _seed_queues(flat, east, south, height, width)
    # A processor cannot guess whether a neighbour is free, so there is no branch on it: each neighbour is
    # written behind the end of its queue, and the end moves only if it was free (2.9 ms, not 8.1).
    lowest = np.uint64(0)
    while True:
        while first[lowest] == last[lowest]:
            lowest += one
            if lowest == np.uint64(LEVELS):
                return
        p = np.uint64(after[np.uint64(first[lowest])])
        first[lowest] = p
        a, b, c, d = flat[p - one], flat[p + one], flat[p - row], flat[p + row]
        cell = max(max(a, b), max(c, d))
        between = ((a > 0) & (a != cell)) | ((b > 0) & (b != cell))
        if between | ((c > 0) & (c != cell)) | ((d > 0) & (d != cell)):
            flat[p] = LINE
            continue
        flat[p] = cell
        for side in range(4):
            if side == 0:
                label, q, level = a, p - one, np.uint64(east[p - one])
            elif side == 1:
                label, q, level = b, p + one, np.uint64(east[p])
            elif side == 2:
                label, q, level = c, p - row, np.uint64(south[p - row])
            else:
                label, q, level = d, p + row, np.uint64(south[p])
            free, end = label == 0, last[level]
            flat[q] = WAITS if free else label
            after[np.uint64(end)] = q
            last[level] = np.uint32(q) if free else end
            lowest = min(lowest, level if free else lowest)


@compiled
def _seed_queues(
    flat: Labels, east: Bytes, south: Bytes, height: int, width: int
) -> tuple[Pixels, Pixels, Pixels]:
    """The queues of the pixels beside the seeds: linked lists, one for each level.

    Returns:
        What follows each pixel, and after the last one, for each level, its first pixel; what precedes the
        first pixel that waits on each level; and the last that waits there: the same where none does.
    """
    one, row = np.uint64(1), np.uint64(width)
    after = np.empty(len(flat) + LEVELS, np.uint32)
    first = np.arange(len(flat), len(flat) + LEVELS).astype(np.uint32)
    last = first.copy()
    highest = np.uint8(LEVELS - 1)
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            p = np.uint64(y * width + x)
            west, right_of = flat[p - one] > 0, flat[p + one] > 0
            above, below = flat[p - row] > 0, flat[p + row] > 0
            if (flat[p] == 0) & (west | right_of | above | below):
                edge = min(
                    min(east[p - one] if west else highest, east[p] if right_of else highest),
                    min(south[p - row] if above else highest, south[p] if below else highest),
                )
                level = np.uint64(edge)
                after[np.uint64(last[level])] = p
                last[level], flat[p] = p, WAITS
    return after, first, last


@compiled
def cell_borders(labels: Labels, count: int) -> tuple[Labels, Labels, Labels]:
    """Pairs of adjacent cells and the length of their common border.

    Args:
        labels: (h, w) cells, 0 to count - 1.
        count: How many cells.

    Returns:
        (N,) the lower and (N,) the higher cell of each pair, sorted, and (N,) pixels.
    """
    low, high = _steps(labels)
    room = np.zeros(count + 1, np.int64)
    for n in range(len(low)):
        room[low[n] + 1] += 1
    begin = np.cumsum(room)
    filled, other = begin.copy(), np.empty(len(low), np.int32)
    for n in range(len(low)):
        other[filled[low[n]]] = high[n]
        filled[low[n]] += 1
    one, two = np.empty(len(low), np.int32), np.empty(len(low), np.int32)
    along, pixels, pairs = np.zeros(count, np.int32), np.empty(len(low), np.int32), 0
    for k in range(count):
        first = pairs
        for n in range(begin[k], begin[k + 1]):
            b = other[n]
            if not along[b]:
                # Neighbours are few, so insertion sort is enough.
                place = pairs
                while place > first and two[place - 1] > b:
                    two[place] = two[place - 1]
                    place -= 1
                two[place], one[pairs] = b, k
                pairs += 1
            along[b] += 1
        for n in range(first, pairs):
            pixels[n], along[two[n]] = along[two[n]], 0
    return one[:pairs], two[:pairs], pixels[:pairs]


@compiled
def _steps(labels: Labels) -> tuple[Labels, Labels]:
    """The lower and higher cell wherever a pixel differs from the one right of or below it."""
    height, width = labels.shape
    low, high = np.empty(2 * labels.size, np.int32), np.empty(2 * labels.size, np.int32)
    count = 0
    # Written unconditionally, advanced only on a difference: the branch is unpredictable.
    for y in range(height):
        for x in range(width - 1):
            a, b = labels[y, x], labels[y, x + 1]
            low[count], high[count] = min(a, b), max(a, b)
            count += a != b
    for y in range(height - 1):
        for x in range(width):
            a, b = labels[y, x], labels[y + 1, x]
            low[count], high[count] = min(a, b), max(a, b)
            count += a != b
    return low[:count], high[:count]


@compiled
def csr_links(
    one: Labels, other: Labels, values: Floats, count: int
) -> tuple[Labels, Labels, Floats]:
    """Pairs of cells as a symmetric matrix in rows (CSR).

    Args:
        one: (N,) the lower cell of each pair, ascending.
        other: (N,) the higher, ascending for each of those.
        values: (N,) float32.
        count: How many cells.

    Returns:
        (count + 1,) row starts, (2 N,) columns and values, ascending in each row.
    """
    ends = np.zeros(count + 1, np.int32)
    for n in range(len(one)):
        ends[one[n] + 1] += 1
        ends[other[n] + 1] += 1
    for k in range(count):
        ends[k + 1] += ends[k]
    filled = ends[:-1].copy()
    columns, data = np.empty(2 * len(one), np.int32), np.empty(2 * len(one), np.float32)
    # Lower neighbours come before higher ones in a row, so pairs are first entered as the higher.
    for n in range(len(one)):
        at = filled[other[n]]
        columns[at], data[at] = one[n], values[n]
        filled[other[n]] += 1
    for n in range(len(one)):
        at = filled[one[n]]
        columns[at], data[at] = other[n], values[n]
        filled[one[n]] += 1
    return ends, columns, data


@compiled
def laplacian(
    ends: Labels,
    neighbours: Labels,
    weights: Floats,
    inside: NDArray[np.int64],
    own: NDArray[np.float64],
) -> tuple[NDArray[np.float64], Labels, Labels, NDArray[np.float64]]:
    """The weighted Laplacian of M cells, in columns (CSC), and their affinity to all others.

    The diagonal comes last in each column.

    Args:
        ends: CSR row starts of the affinities.
        neighbours: Their columns.
        weights: Their values.
        inside: (M,) numbers of the cells, ascending.
        own: (M,) additional terms of the diagonal.

    Returns:
        Values, rows, (M + 1,) column starts; (M,) sums of affinities to other cells.
    """
    number = np.full(len(ends) - 1, np.int32(-1))
    for m in range(len(inside)):
        number[inside[m]] = m
    room = len(neighbours) + len(inside)
    data, rows = np.empty(room), np.empty(room, np.int32)
    columns, beyond = np.zeros(len(inside) + 1, np.int32), np.zeros(len(inside))
    at = 0
    for m in range(len(inside)):
        cell, degree, within = inside[m], 0.0, 0.0
        for n in range(ends[cell], ends[cell + 1]):
            weight = float(weights[n])
            degree += weight
            if number[neighbours[n]] >= 0:
                within += weight
                data[at], rows[at] = -weight, number[neighbours[n]]
                at += 1
        data[at], rows[at] = degree + own[m], m
        at += 1
        columns[m + 1], beyond[m] = at, degree - within
    return data[:at], rows[:at], columns, beyond


@compiled
def may_be_foreground(
    share: Floats, weight: Floats, prior: Floats, persistence: Floats, least: float
) -> NDArray[np.bool_]:
    """Which cells have more than a least weight of labels other than the first, (count,).

    Args:
        share: (count, K) label shares by evidence.
        weight: (count,) their weight.
        prior: (count, K) label shares before.
        persistence: (count,) their weight.
        least: The weight.
    """
    out = np.empty(len(share), np.bool_)
    for c in range(len(share)):
        now, before = np.float32(0), np.float32(0)
        for k in range(1, share.shape[1]):
            now, before = now + share[c, k], before + prior[c, k]
        out[c] = now * weight[c] + before * persistence[c] > least
    return out
