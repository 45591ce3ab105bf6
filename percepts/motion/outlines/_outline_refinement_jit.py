"""Compiled loops of `outline_refinement`: tones beside an outline, and borders drawn where they change."""

from __future__ import annotations

from math import exp, log

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
    out = np.zeros(len(near), np.float32)
    for n in range(len(near)):
        y, x = near[n]
        v, u = y // 2, x // 2
        part = float(full[v, u])
        if part <= least or part >= 1 - least:
            continue
        away, wide = 0.0, 1.0
        for i in range(3):
            mean, square = every[0][v, u, i], every[1][v, u, i]
            one = (inside[0][v, u, i] + both * mean) / (part + both)
            two = (inside[1][v, u, i] + both * square) / (part + both)
            within = max(two - one * one, 0.0) + noise**2
            gap = tone[y, x, i] - one
            one = (mean - inside[0][v, u, i] + both * mean) / (1 - part + both)
            two = (square - inside[1][v, u, i] + both * square) / (1 - part + both)
            beyond = max(two - one * one, 0.0) + noise**2
            far = tone[y, x, i] - one
            away += far * far / beyond - gap * gap / within
            wide *= beyond / within
        # The channels are strongly correlated: their mean, not their sum.
        out[n] = max(-most, min(most, 0.5 * (away + log(wide)) / 3))
    return out


@compiled
def histogram_log_odds(
    near: Places,
    inside: NDArray[np.uint8],
    ring: NDArray[np.uint8],
    tone: NDArray[np.uint8],
    limits: tuple[float, float],
) -> Floats:
    """Log odds, by histograms of the object and of what surrounds it, that pixels are inside, (N,) float32.

    Args:
        near: The pixels; none speaks for itself.
        inside: (h, w), not 0 inside.
        ring: (h, w), not 0 inside and in the surroundings.
        tone: (h, w, 3).
        limits: Pixels that speak for neither side, added to each bin; most log odds.
    """
    neither, most = limits
    mine, others = np.zeros(BINS**3, np.float32), np.zeros(BINS**3, np.float32)
    for y in range(inside.shape[0]):
        for x in range(inside.shape[1]):
            if inside[y, x]:
                mine[bin_of(tone[y, x])] += 1
            elif ring[y, x]:
                others[bin_of(tone[y, x])] += 1
    within, beyond = max(mine.sum(), np.float32(1)), max(others.sum(), np.float32(1))
    part, rest = within / (within + beyond), beyond / (within + beyond)
    out = np.empty(len(near), np.float32)
    for n in range(len(near)):
        y, x = near[n]
        at = bin_of(tone[y, x])
        own = 1 if inside[y, x] else 0
        other = 1 if ring[y, x] and not own else 0
        odds = log(((mine[at] - own) / part + neither) / ((others[at] - other) / rest + neither))
        out[n] = max(-most, min(most, odds))
    return out


@compiled
def bin_of(tone: NDArray[np.uint8]) -> int:
    """The bin of a colour in a histogram."""
    width = 256 // BINS
    return int(((tone[0] // width) * BINS + tone[1] // width) * BINS + tone[2] // width)


@compiled
def likeness_of_neighbours(near: Places, tone: NDArray[np.uint8]) -> Floats:
    """How alike each pixel and its four neighbours are, (N, 4) float32: 0 to 1, 0 beyond the image.

    The scale is the mean difference of the pixels given, so that it adapts to contrast and noise.
    """
    height, width = tone.shape[0], tone.shape[1]
    out = np.full((len(near), len(ABOUT)), np.float32(np.inf))
    total, count = np.float32(0), 0
    for n in range(len(near)):
        y, x = near[n]
        for k in range(len(ABOUT)):
            v, u = y + ABOUT[k, 0], x + ABOUT[k, 1]
            if 0 <= v < height and 0 <= u < width:
                apart = np.float32(0)
                for i in range(3):
                    gap = np.float32(tone[y, x, i]) - np.float32(tone[v, u, i])
                    apart += gap * gap
                out[n, k] = apart
                total, count = total + apart, count + 1
    sharp = np.float32(0.5) * count / max(total, np.float32(1e-3 * count + 1e-9))
    for n in range(len(near)):
        for k in range(len(ABOUT)):
            out[n, k] = exp(-sharp * out[n, k])
    return out


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
    # A border of 0 takes no side, and spares the test whether a neighbour lies in the image.
    side = np.zeros((share.shape[0] + 2, share.shape[1] + 2), np.float32)
    side[1:-1, 1:-1] = 2 * share - 1
    taken = np.empty(len(near), np.float32)
    for sweep in range(sweeps + 1):
        for n in range(len(near)):
            y, x = near[n, 0] + 1, near[n, 1] + 1
            pull = np.float32(0)
            if sweep:
                pull += alike[n, 0] * side[y, x - 1] + alike[n, 1] * side[y, x + 1]
                pull += alike[n, 2] * side[y - 1, x] + alike[n, 3] * side[y + 1, x]
            taken[n] = taken_side(odds[n] + weight * pull)
        for n in range(len(near)):
            side[near[n, 0] + 1, near[n, 1] + 1] = taken[n]
    out = share.copy()
    for n in range(len(near)):
        out[near[n, 0], near[n, 1]] = np.float32(0.5) * (taken[n] + 1)
    return out


@compiled
def taken_side(odds: float) -> float:
    """-1 to 1 for log odds: tanh of their half, by a quotient of polynomials within 0.024 of it."""
    half = max(-3.0, min(3.0, 0.5 * odds))
    return half * (27 + half * half) / (27 + 9 * half * half)
