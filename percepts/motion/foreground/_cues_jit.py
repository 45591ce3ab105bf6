"""Compiled loops over pixels and superpixels for `cues.py` and `belief.py`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Labels = NDArray[np.int32]
Grey = NDArray[np.uint8]
EVERY = 2  # sampling step along x and y, pixels


@compiled
def flow_links(old: Labels, new: Labels, flow: Floats) -> tuple[Labels, Labels]:
    """Pairs of a cell of the newer image and the older cell it comes from, (M,) and (M,).

    One pair for each sampled pixel that comes from within the image.
    """
    height, width = new.shape
    here = np.empty(((height + 1) // EVERY) * ((width + 1) // EVERY), np.int32)
    there = np.empty_like(here)
    count = 0
    for y in range(0, height, EVERY):
        for x in range(0, width, EVERY):
            u = x + int(np.rint(flow[y, x, 0]))
            v = y + int(np.rint(flow[y, x, 1]))
            if 0 <= u < width and 0 <= v < height:
                here[count], there[count] = new[y, x], old[v, u]
                count += 1
    return here[:count].copy(), there[:count].copy()


@compiled
def carried(here: Labels, there: Labels, values: Floats, looked: Floats) -> Floats:
    """Values (old count, K) of the older cells carried to the newer ones, (count, K).

    Args:
        here: (M,) cells of the newer image.
        there: (M,) the older cells they come from.
        values: Of the older cells.
        looked: (count,) sampled pixels of each newer cell; those newly in view count as 0.
    """
    kinds = values.shape[1]
    out = np.zeros((len(looked), kinds), np.float32)
    for i in range(len(here)):
        for k in range(kinds):
            out[here[i], k] += values[there[i], k]
    for c in range(len(looked)):
        for k in range(kinds):
            out[c, k] /= max(looked[c], np.float32(1))
    return out


@compiled
def flow_statistics(labels: Labels, flow: Floats, gx: Floats, gy: Floats, count: int) -> Floats:
    """Means over each cell, (count, 5): flow along x and y, its gradient, texture, sampled pixels.

    Args:
        labels: (h, w) cells.
        flow: (h, w, 2) pixels.
        gx: (h, w) gradient of grey values along x.
        gy: (h, w) along y.
        count: How many cells.
    """
    height, width = labels.shape
    out = np.zeros((count, 5), np.float32)
    for y in range(0, height, EVERY):
        below = min(y + EVERY, height - 1)
        for x in range(0, width, EVERY):
            next_x = min(x + EVERY, width - 1)
            c, steep = labels[y, x], np.float32(0)
            for k in range(2):
                right = flow[y, next_x, k] - flow[y, x, k]
                down = flow[below, x, k] - flow[y, x, k]
                steep += right * right + down * down
                out[c, k] += flow[y, x, k]
            out[c, 2] += np.sqrt(steep) / np.float32(EVERY)
            out[c, 3] += abs(gx[y, x]) + abs(gy[y, x])
            out[c, 4] += np.float32(1)
    for c in range(count):
        for k in range(4):
            out[c, k] /= max(out[c, 4], np.float32(1))
    return out


@compiled
def _sample(grey: Grey, x: float, y: float) -> float:
    """A bilinearly interpolated grey value; clamped at the border."""
    height, width = grey.shape
    x, y = min(max(x, 0.0), width - 1.001), min(max(y, 0.0), height - 1.001)
    u, v = int(x), int(y)
    a, b = x - u, y - v
    top = grey[v, u] * (1 - a) + grey[v, u + 1] * a
    low = grey[v + 1, u] * (1 - a) + grey[v + 1, u + 1] * a
    return float(top * (1 - b) + low * b)


@compiled
def warp_errors(
    labels: Labels,
    images: tuple[Grey, Grey],
    gradient: tuple[Floats, Floats],
    flow: Floats,
    ground: Floats,
) -> Floats:
    """Mean misfit of each cell, (count, 2), under the background's motion and under the flow.

    In units of what noise and a small motion error explain; at most 6 per pixel.

    Args:
        labels: (h, w) cells.
        images: The newest grey image and the one before.
        gradient: Of the newest image, along x and y.
        flow: (h, w, 2) from the newest image back to the one before.
        ground: (count, 2) displacement of the background at each cell.
    """
    height, width = labels.shape
    new, old = images
    gx, gy = gradient
    out = np.zeros((len(ground), 2), np.float32)
    number = np.zeros(len(ground), np.float32)
    for y in range(0, height, EVERY):
        for x in range(0, width, EVERY):
            c = labels[y, x]
            wide = 2.0 + 0.35 * (abs(gx[y, x]) + abs(gy[y, x]))
            still = abs(_sample(old, x - ground[c, 0], y - ground[c, 1]) - new[y, x])
            moved = abs(_sample(old, x + flow[y, x, 0], y + flow[y, x, 1]) - new[y, x])
            out[c, 0] += np.float32(min(still / wide, 6.0))
            out[c, 1] += np.float32(min(moved / wide, 6.0))
            number[c] += 1
    for c in range(len(ground)):
        out[c] /= max(number[c], np.float32(1))
    return out


@compiled
def inside_share(edges: NDArray[np.bool_]) -> Floats:
    """Share of eight rays from each pixel to the border that cross edges an odd number of times, (h, w).

    A pixel enclosed by edges is inside along any ray (Papazoglou and Ferrari, Fast object segmentation
    in unconstrained video, 2013). An edge several pixels wide is crossed once.
    """
    height, width = edges.shape
    out = np.zeros((height, width), np.float32)
    crossed = np.zeros((height, width), np.int32)
    for ray in range(9):
        dx, dy = ray % 3 - 1, ray // 3 - 1
        if dx == 0 and dy == 0:
            continue
        for j in range(height):
            y = j if dy >= 0 else height - 1 - j
            for i in range(width):
                x = i if dx >= 0 else width - 1 - i
                u, v = x - dx, y - dy
                inside = 0 <= u < width and 0 <= v < height
                begins = edges[y, x] and not (inside and edges[v, u])
                crossed[y, x] = (crossed[v, u] if inside else 0) + (1 if begins else 0)
                if crossed[y, x] % 2 == 1:
                    out[y, x] += np.float32(0.125)
    return out


@compiled
def neighbour_means(ends: Labels, neighbours: Labels, weights: Floats, values: Floats) -> Floats:
    """Mean of values (count, K) over the neighbours of each cell, by affinity; CSR as in `Superpixels`."""
    out = np.zeros(values.shape, np.float32)
    for c in range(len(values)):
        total = np.float32(1e-6)
        for at in range(ends[c], ends[c + 1]):
            total += weights[at]
            for k in range(values.shape[1]):
                out[c, k] += weights[at] * values[neighbours[at], k]
        for k in range(values.shape[1]):
            out[c, k] /= total
    return out


@compiled
def settled(
    ends: Labels,
    neighbours: Labels,
    weights: Floats,
    values: Floats,
    trust: Floats,
    sweeps: int,
) -> Floats:
    """Values (count, K) after the less trusted were smoothed towards similar neighbours.

    Each result balances its own value by trust and its neighbours' results by affinity: a linear system, for
    which this many forward and backward Gauss-Seidel sweeps are made; CSR as in `Superpixels`.

    Args:
        ends: CSR row starts.
        neighbours: CSR columns.
        weights: Their affinities.
        values: Of the cells.
        trust: (count, K) weight of each value.
        sweeps: How many, in each direction.
    """
    count, kinds = values.shape
    out = values.copy()
    for sweep in range(2 * sweeps):
        for n in range(count):
            c = n if sweep % 2 == 0 else count - 1 - n
            for k in range(kinds):
                total, number = trust[c, k] * values[c, k], trust[c, k] + np.float32(1e-6)
                for at in range(ends[c], ends[c + 1]):
                    total += weights[at] * out[neighbours[at], k]
                    number += weights[at]
                out[c, k] = total / number
    return out
