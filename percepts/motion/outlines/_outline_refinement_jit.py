"""Compiled loops of `outline_refinement`: tones beside an outline, and borders drawn where they change."""

from __future__ import annotations

from math import log

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Places = NDArray[np.int32]
"""(N, 2) rows and columns of pixels."""

BINS = 16
"""Bins of a histogram for each of the three channels."""

ABOUT = np.array([(0, -1), (0, 1), (-1, 0), (1, 0)], dtype=np.int64)
"""(4, 2) rows and columns from a pixel to its neighbours: left, right, above, below."""


@compiled
def places_of(mask: NDArray[np.bool_]) -> Places:
    """Pixels of a mask, row by row."""
    found = np.empty((mask.size, 2), np.int32)
    count = 0
    for y in range(mask.shape[0]):
        for x in range(mask.shape[1]):
            if mask[y, x]:
                found[count, 0], found[count, 1] = y, x
                count += 1
    return found[:count].copy()


@compiled
def window_log_odds(
    near: Places,
    full: Floats,
    tone: NDArray[np.uint8],
    inside: tuple[Floats, Floats],
    every: tuple[Floats, Floats],
    limits: tuple[float, float, float, float],
) -> Floats:
    """Log odds, by the tones in the window around each, that pixels are inside, (N,) float32.

    Args:
        near: The pixels.
        full: (h / 2, w / 2) share of the window around each that is inside.
        tone: (h, w, 3).
        inside: (h / 2, w / 2, 3) means over the window of the tones inside, 0 taken for others, and
            of their squares.
        every: The same of all tones.
        limits: Share of the window that each side must fill, least standard deviation of tones, most
            log odds.
    """
    least, noise, most, both = limits
    wide = full.shape[1]
    # The sides of four pixels are the same, and divisions are dear: each side is described once.
    known, sides = np.full(wide, -1, np.int64), np.empty((wide, 13))
    out = np.zeros(len(near), np.float32)
    for n in range(len(near)):
        y, x = near[n]
        v, u = y // 2, x // 2
        part = float(full[v, u])
        if part <= least or part >= 1 - least:
            continue
        side = sides[u]
        if known[u] != v:
            known[u] = v
            _describe_sides(part, inside, every, (v, u), (noise, both), side)
        away = side[12]
        for i in range(3):
            value = float(tone[y, x, i])
            gap, far = value - side[i], value - side[6 + i]
            away += far * far * side[9 + i] - gap * gap * side[3 + i]
        # The channels are strongly correlated: their mean, not their sum.
        out[n] = max(-most, min(most, 0.5 * away / 3))
    return out


@compiled
def _describe_sides(
    part: float,
    inside: tuple[Floats, Floats],
    every: tuple[Floats, Floats],
    place: tuple[int, int],
    limits: tuple[float, float],
    side: NDArray[np.float64],
) -> None:
    """Describe the tones of both sides in a window.

    Means and inverse variances inside, the same outside, and the logarithm of the variances' ratio.

    Args:
        part: Share of the window that is inside.
        inside: As in `window_log_odds`, as is the next.
        every: The same of all tones.
        place: Row and column of the window.
        limits: Least standard deviation of tones, and share of the window that describes both sides.
        side: (13,), written to.
    """
    noise, both = limits
    v, u = place
    ours, others = 1 / (part + both), 1 / (1 - part + both)
    ratio = 1.0
    for i in range(3):
        mean, square = every[0][v, u, i], every[1][v, u, i]
        one = (inside[0][v, u, i] + both * mean) * ours
        two = (inside[1][v, u, i] + both * square) * ours
        within = max(two - one * one, 0.0) + noise**2
        side[i], side[3 + i] = one, 1 / within
        one = (mean - inside[0][v, u, i] + both * mean) * others
        two = (square - inside[1][v, u, i] + both * square) * others
        beyond = max(two - one * one, 0.0) + noise**2
        side[6 + i], side[9 + i] = one, 1 / beyond
        ratio *= beyond * side[3 + i]
    side[12] = log(ratio)


@compiled
def histogram_odds(
    near: Places,
    inside: NDArray[np.uint8],
    ring: NDArray[np.uint8],
    tone: NDArray[np.uint8],
    neither: float,
) -> Floats:
    """Odds, by histograms of the object and of what surrounds it, that pixels are inside, (N,) float32.

    Args:
        near: The pixels; none speaks for itself.
        inside: (h, w), not 0 inside.
        ring: (h, w), not 0 inside and in the surroundings.
        tone: (h, w, 3).
        neither: Pixels that speak for neither side, added to each bin.
    """
    mine, others = np.zeros(BINS**3, np.float32), np.zeros(BINS**3, np.float32)
    ours, theirs = 0, 0
    for y in range(inside.shape[0]):
        for x in range(inside.shape[1]):
            if inside[y, x]:
                mine[bin_of(tone[y, x])] += 1
                ours += 1
            elif ring[y, x]:
                others[bin_of(tone[y, x])] += 1
                theirs += 1
    part = max(ours, 1) / (max(ours, 1) + max(theirs, 1))
    within, beyond = np.float32(1 / part), np.float32(1 / (1 - part))
    spread = np.float32(neither)
    out = np.empty(len(near), np.float32)
    for n in range(len(near)):
        y, x = near[n]
        at = bin_of(tone[y, x])
        own = np.float32(1 if inside[y, x] else 0)
        other = np.float32(1 if ring[y, x] and not inside[y, x] else 0)
        own, other = (mine[at] - own) * within, (others[at] - other) * beyond
        out[n] = (own + spread) / (other + spread)
    return out


@compiled
def share_odds(share: Floats, near: Places, least: float) -> Floats:
    """Odds of shares (h, w) at some pixels, (N,) float32; each share is `least` or more from 0 and 1."""
    out, low, high = np.empty(len(near), np.float32), np.float32(least), np.float32(1 - least)
    for n in range(len(near)):
        known = min(max(share[near[n, 0], near[n, 1]], low), high)
        out[n] = known / (np.float32(1) - known)
    return out


@compiled
def bin_of(tone: NDArray[np.uint8]) -> int:
    """The bin of a colour in a histogram."""
    width = 256 // BINS
    return int(((tone[0] // width) * BINS + tone[1] // width) * BINS + tone[2] // width)


@compiled
def gaps_to_neighbours(near: Places, tone: NDArray[np.uint8]) -> tuple[Floats, np.float32]:
    """Squared differences of each pixel and its four neighbours, (N, 4) float32, and their sharpness.

    Beyond the image they are infinite. The sharpness, which times a difference gives the exponent of a
    likeness, adapts to contrast and noise: half of one over the mean difference of the pixels given.

    Args:
        near: The pixels, row by row.
        tone: (h, w, 3).
    """
    height, width = tone.shape[0], tone.shape[1]
    out = np.full((len(near), len(ABOUT)), np.float32(np.inf))
    above = np.full(width, -1, np.int64)  # which pixel was the last one in each column
    total, count = np.float32(0), 0
    for n in range(len(near)):
        y, x = near[n]
        left, up = n - 1, above[x]
        if n and x and near[left, 0] == y and near[left, 1] == x - 1:
            out[n, 0] = out[left, 1]
        elif x:
            out[n, 0] = _gap(tone[y, x], tone[y, x - 1])
        if x + 1 < width:
            out[n, 1] = _gap(tone[y, x], tone[y, x + 1])
        if y and up >= 0 and near[up, 0] == y - 1:
            out[n, 2] = out[up, 3]
        elif y:
            out[n, 2] = _gap(tone[y, x], tone[y - 1, x])
        if y + 1 < height:
            out[n, 3] = _gap(tone[y, x], tone[y + 1, x])
        above[x] = n
        for k in range(len(ABOUT)):
            if out[n, k] < np.inf:
                total, count = total + out[n, k], count + 1
    sharp = np.float32(0.5 * count / max(total, np.float32(1e-3 * count + 1e-9)))
    return out, sharp


@compiled
def _gap(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> np.float32:
    """Squared difference of two tones."""
    first, second, third = int(a[0]) - int(b[0]), int(a[1]) - int(b[1]), int(a[2]) - int(b[2])
    return np.float32(first * first + second * second + third * third)


@compiled
def mean_field(
    share: Floats, near: Places, odds: Floats, alike: Floats, weight: float, sweeps: int
) -> Floats:
    """Shares of pixels that agree with their own evidence and with neighbours that look alike, (h, w).

    Args:
        share: (h, w) shares; those of pixels that are not near stay.
        near: The pixels that may change.
        odds: (N,) log odds of each by itself.
        alike: (N, 4) from `likeness_of_neighbours`.
        weight: Log odds that a neighbour just alike and sure of its side adds.
        sweeps: Number of passes; in each, all pixels look at the sides of the pass before, so that no
            direction in the image is favoured.
    """
    # A border of 0 takes no side, and spares the test whether a neighbour lies in the image. Places are
    # unsigned: negative ones would be counted from the end, and tested for.
    height, width = share.shape[0] + 2, share.shape[1] + 2
    side = np.zeros(height * width, np.float32)
    side.reshape(height, width)[1:-1, 1:-1] = np.float32(2) * share - np.float32(1)
    at = np.empty(len(near), np.uint64)
    for n in range(len(near)):
        at[n] = (near[n, 0] + 1) * width + near[n, 1] + 1
    one, row = np.uint64(1), np.uint64(width)
    taken, pull = np.empty(len(near), np.float32), np.zeros(len(near), np.float32)
    strength = np.float32(weight)
    for sweep in range(sweeps + 1):
        if sweep:
            for n in range(len(near)):
                p = at[n]
                beside = alike[n, 0] * side[p - one] + alike[n, 1] * side[p + one]
                pull[n] = beside + (alike[n, 2] * side[p - row] + alike[n, 3] * side[p + row])
        for n in range(len(near)):
            taken[n] = taken_side(odds[n] + strength * pull[n])
        for n in range(len(near)):
            side[at[n]] = taken[n]
    out = share.copy()
    for n in range(len(near)):
        out[near[n, 0], near[n, 1]] = np.float32(0.5) * (taken[n] + 1)
    return out


@compiled
def taken_side(odds: np.float32) -> np.float32:
    """-1 to 1 for log odds: tanh of their half, by a quotient of polynomials within 0.024 of it."""
    most, three_cubed = np.float32(3), np.float32(27)
    half = max(-most, min(most, np.float32(0.5) * odds))
    square = half * half
    return half * (three_cubed + square) / (three_cubed + np.float32(9) * square)
