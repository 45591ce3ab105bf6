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
def steepness(flow: Floats, every: int) -> Floats:
    """How steep the flow is at every n-th pixel, (h, w) float32: its change to the next ones, per pixel."""
    height, width = (flow.shape[0] - 1) // every + 1, (flow.shape[1] - 1) // every + 1
    out = np.empty((height, width), np.float32)
    for j in range(height):
        below = min(j + 1, height - 1) * every
        for i in range(width):
            y, x, right = j * every, i * every, min(i + 1, width - 1) * every
            total = np.float32(0)
            for k in range(2):
                along, down = flow[y, right, k] - flow[y, x, k], flow[below, x, k] - flow[y, x, k]
                total += along * along + down * down
            out[j, i] = np.sqrt(total) / np.float32(every)
    return out


@compiled
def inside_share(steep: Floats, limits: Floats) -> Floats:
    """Share of eight rays from each pixel to the border that cross edges an odd number of times, (h, w).

    A pixel enclosed by edges is inside along any ray (Papazoglou and Ferrari, Fast object segmentation
    in unconstrained video, 2013). An edge several pixels wide is crossed once.

    Args:
        steep: (h, w) float32.
        limits: (N,) float32, at most 8, from which it is an edge; the result is the mean over them.
    """
    height, width = steep.shape
    one = np.uint8(1)
    # One bit for each limit. A border of no edges spares the test whether a neighbour lies in the image.
    edges = np.zeros((height + 2, width + 2), np.uint8)
    for y in range(height):
        for x in range(width):
            for n in range(len(limits)):
                if steep[y, x] > limits[n]:
                    edges[y + 1, x + 1] |= one << np.uint8(n)
    ones = np.zeros(1 << len(limits), np.int32)
    for code in range(len(ones)):
        for n in range(len(limits)):
            ones[code] += (code >> n) & 1
    odd = np.zeros((height + 2, width + 2), np.uint8)
    total = np.zeros((height, width), np.int32)
    for ray in range(9):
        dx, dy = ray % 3 - 1, ray // 3 - 1
        if dx == 0 and dy == 0:
            continue
        for j in range(height):
            y = j + 1 if dy >= 0 else height - j
            for i in range(width):
                x = i + 1 if dx >= 0 else width - i
                begins = edges[y, x] & ~edges[y - dy, x - dx]
                odd[y, x] = odd[y - dy, x - dx] ^ begins
                total[y - 1, x - 1] += ones[odd[y, x]]
    return (total.astype(np.float32) * np.float32(0.125)) / np.float32(len(limits))


@compiled
def sampled_means(labels: Labels, coarse: Floats, looked: Floats) -> Floats:
    """Mean over the sampled pixels of each cell, (count,) float32, of a map at a fourth of the size.

    Args:
        labels: (h, w) cells.
        coarse: (h / 4, w / 4) float32.
        looked: (count,) sampled pixels of each cell.
    """
    height, width = labels.shape
    total, out = np.zeros(len(looked)), np.empty(len(looked), np.float32)
    for y in range(0, height, EVERY):
        for x in range(0, width, EVERY):
            total[labels[y, x]] += coarse[y // 4, x // 4]
    for c in range(len(looked)):
        out[c] = total[c] / max(looked[c], np.float32(1))
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
def smooth_untextured(
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
    out, share = values.copy(), np.empty(values.shape, np.float32)
    for c in range(count):
        total = np.float32(1e-6)
        for at in range(ends[c], ends[c + 1]):
            total += weights[at]
        for k in range(kinds):
            share[c, k] = np.float32(1) / (trust[c, k] + total)
    for sweep in range(2 * sweeps):
        for n in range(count):
            c = n if sweep % 2 == 0 else count - 1 - n
            for k in range(kinds):
                total = trust[c, k] * values[c, k]
                for at in range(ends[c], ends[c + 1]):
                    total += weights[at] * out[neighbours[at], k]
                out[c, k] = total * share[c, k]
    return out


@compiled
def nearest_lengths(ground: Floats, flow: Floats) -> Floats:
    """Length of the background motion nearest to the flow of each cell, (count,).

    Args:
        ground: (M, count, 2) displacements of each cell by the background's motions.
        flow: (count, 2) flow back at each.
    """
    out = np.zeros(len(flow), np.float32)  # as it stays where a flow is no number
    for c in range(len(flow)):
        least = np.float32(np.inf)
        for m in range(len(ground)):
            x, y = ground[m, c, 0], ground[m, c, 1]
            off = (x + flow[c, 0]) ** 2 + (y + flow[c, 1]) ** 2
            if off < least:
                least, out[c] = off, np.sqrt(x * x + y * y)
    return out
