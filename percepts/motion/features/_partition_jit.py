"""Growing cells from seeds and linking them, compiled; `superpixels` says what they are for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Labels = NDArray[np.int32]
Bytes = NDArray[np.uint8]


LEVELS = 256
NEAR = 8
"""Steps by which how far a pixel is from the seeds is told, pixels; what is farther counts as the last."""


@compiled
def watershed(right: Bytes, down: Bytes, distance: Bytes, marks: Labels) -> None:
    """The watershed of seeds as a minimum spanning forest (Cousty et al. 2009): each pixel goes to a seed.

    Neighbouring pixels are joined in the order of how little they differ, and on a plateau in the order
    of how near they are to the seeds, so that what is flat is shared out evenly; trees that have each a
    seed are not joined. It takes a third of the time of flooding by queues, which visits pixels in an
    order that no cache foresees, and leaves no lines between the cells.

    Args:
        right: (h, w) how far each pixel differs from the next one; the last in a row is not used.
        down: (h - 1, w) how far each differs from the one below.
        distance: (h, w) of each pixel from the next seed, pixels, below `NEAR`.
        marks: (h, w) int32, seeds from 1 and 0 elsewhere; becomes the cells. Without a seed all stay 0.
    """
    width, flat = marks.shape[1], marks.ravel()
    order = _edges_in_order(right, down, distance.ravel())
    parent = np.arange(marks.size).astype(np.int32)
    for edge in order:
        p = edge >> 1
        one = _root(parent, p)
        other = _root(parent, p + (width if edge & 1 else 1))
        if one == other or (flat[one] > 0 and flat[other] > 0):
            continue
        if flat[one] > 0:
            parent[other] = one
        else:
            parent[one] = other
    for p in range(marks.size):
        flat[p] = flat[_root(parent, p)]


@compiled
def _edges_in_order(right: Bytes, down: Bytes, near: Bytes) -> Labels:
    """All edges between neighbours, weak ones first: 2 p of pixel p and the next, 2 p + 1 and that below."""
    height, width = right.shape
    along, below = right.ravel(), down.ravel()
    last = np.int32(NEAR - 1)
    keys = np.empty(2 * right.size, np.int16)
    place = np.zeros(LEVELS * NEAR + 1, np.int32)
    for y in range(height):
        for x in range(width):
            p = y * width + x
            if x < width - 1:
                keys[2 * p] = along[p] * NEAR + min(last, min(near[p], near[p + 1]))
                place[keys[2 * p] + 1] += 1
            if y < height - 1:
                keys[2 * p + 1] = below[p] * NEAR + min(last, min(near[p], near[p + width]))
                place[keys[2 * p + 1] + 1] += 1
    for key in range(LEVELS * NEAR):
        place[key + 1] += place[key]
    order = np.empty(place[-1], np.int32)
    for y in range(height):
        for x in range(width):
            p = y * width + x
            if x < width - 1:
                order[place[keys[2 * p]]] = 2 * p
                place[keys[2 * p]] += 1
            if y < height - 1:
                order[place[keys[2 * p + 1]]] = 2 * p + 1
                place[keys[2 * p + 1]] += 1
    return order


@compiled
def _root(parent: Labels, p: int) -> int:
    """The root of a pixel's tree; the way there is halved."""
    while parent[p] != p:
        parent[p] = parent[parent[p]]
        p = parent[p]
    return p


@compiled
def cell_borders(labels: Labels, count: int) -> tuple[Labels, Labels, Labels]:
    """Pairs of cells that touch, and along how many pixels.

    Args:
        labels: (h, w) cells, 0 to count - 1.
        count: How many cells.

    Returns:
        (N,) the lower and (N,) the higher cell of each pair, in their order, and (N,) pixels.
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
                # Neighbours are few: each goes to its place among those before it.
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
    """The lower and the higher cell wherever one pixel and the next, or that below it, differ."""
    height, width = labels.shape
    low, high = np.empty(2 * labels.size, np.int32), np.empty(2 * labels.size, np.int32)
    count = 0
    # Written always and kept when they differ: which do cannot be foreseen.
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
        (count + 1,) where the rows begin, (2 N,) columns and values, ascending in each row.
    """
    ends = np.zeros(count + 1, np.int32)
    for n in range(len(one)):
        ends[one[n] + 1] += 1
        ends[other[n] + 1] += 1
    for k in range(count):
        ends[k + 1] += ends[k]
    filled = ends[:-1].copy()
    columns, data = np.empty(2 * len(one), np.int32), np.empty(2 * len(one), np.float32)
    # All that is lower than a cell comes before what is higher: so first as the higher of a pair.
    for n in range(len(one)):
        at = filled[other[n]]
        columns[at], data[at] = one[n], values[n]
        filled[other[n]] += 1
    for n in range(len(one)):
        at = filled[one[n]]
        columns[at], data[at] = other[n], values[n]
        filled[one[n]] += 1
    return ends, columns, data
