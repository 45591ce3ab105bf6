"""Compiled loops of `cell_features`: gradient histograms and mean colours of a patch's cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float32]

BINS = 9  # channels for gradient orientations, modulo 180 degrees
COLOURS = 3  # channels for the mean L, a and b of a cell
SPARE = 1  # channel for the mean log odds that the colours of a cell are the object's


@compiled
def _turn(x: np.float32, y: np.float32) -> np.float32:
    """The orientation of a gradient as a fraction of 180 degrees, 0 to 1, accurate to 0.001.

    A polynomial in place of `arctan2`, which would dominate the loop.
    """
    a, b = abs(x), abs(y)
    t = (b if b < a else a) / (a if b < a else b)
    turn = t * (np.float32(0.30952) - np.float32(0.06108) * t * t)
    if b > a:
        turn = np.float32(0.5) - turn
    if (x < 0) != (y < 0):
        turn = np.float32(1.0) - turn
    return turn


@compiled
def cell_histograms(lab: NDArray[np.uint8], odds: Floats, side: int) -> Floats:
    """Features of each cell of a patch: histogram of gradient orientations, mean Lab, mean log odds.

    Args:
        lab: (h, w, 3) uint8, CIE Lab as OpenCV codes it; h and w are multiples of `side`.
        odds: (h, w) float32, log odds of each pixel's colour.
        side: Side of a cell, pixels.

    Returns:
        (BINS + COLOURS + SPARE, h / side, w / side) float32.
    """
    height, width = lab.shape[:2]
    rows, cols = height // side, width // side
    out = np.zeros((BINS + COLOURS + SPARE, rows, cols), np.float32)
    share = np.float32(1.0 / (side * side))
    for y in range(rows * side):
        up, down = max(y - 1, 0), min(y + 1, height - 1)
        r = y // side
        for x in range(cols * side):
            left, right = max(x - 1, 0), min(x + 1, width - 1)
            best, gx, gy = np.int32(-1), np.int32(0), np.int32(0)
            for k in range(3):
                dx = np.int32(lab[y, right, k]) - np.int32(lab[y, left, k])
                dy = np.int32(lab[down, x, k]) - np.int32(lab[up, x, k])
                strength = dx * dx + dy * dy
                if strength > best:
                    best, gx, gy = strength, dx, dy
            c = x // side
            if best > 0:
                place = _turn(np.float32(gx), np.float32(gy)) * np.float32(BINS)
                low = int(place)
                part = place - np.float32(low)
                size = np.sqrt(np.float32(best))
                low %= BINS
                out[low, r, c] += size * (np.float32(1.0) - part)
                out[low + 1 if low + 1 < BINS else 0, r, c] += size * part
            for k in range(3):
                out[BINS + k, r, c] += np.float32(lab[y, x, k]) * share
            out[BINS + COLOURS, r, c] += odds[y, x] * share
    return out


@compiled
def normalise_edges(cells: Floats, least: float) -> Floats:
    """Normalise orientation histograms by the energy of the 3 x 3 cells around, against changes of lighting.

    Args:
        cells: From `cell_histograms`.
        least: Summed gradient magnitude of a cell below which edges are not amplified.

    Returns:
        The cells with orientation channels from 0 to 0.5; the others unchanged.
    """
    rows, cols = cells.shape[1:]
    energy = np.zeros((rows, cols), np.float32)
    for r in range(rows):
        for c in range(cols):
            for k in range(BINS):
                energy[r, c] += cells[k, r, c] * cells[k, r, c]
    out = cells.copy()
    for r in range(rows):
        for c in range(cols):
            total = np.float32(0.0)
            count = 0
            for v in range(max(r - 1, 0), min(r + 2, rows)):
                for u in range(max(c - 1, 0), min(c + 2, cols)):
                    total += energy[v, u]
                    count += 1
            scale = np.float32(1.0) / np.float32(np.sqrt(total / count) + least)
            for k in range(BINS):
                out[k, r, c] = min(cells[k, r, c] * scale, np.float32(1.0)) * np.float32(0.5)
    return out
