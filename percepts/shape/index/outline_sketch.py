"""Sketches: a shape's outline in a hundred bytes, to reject unlikely views quickly.

A sketch holds the outline's height functions (see `height_functions.py`) at a few points. Two sketches are
compared at all rotations, mirrored too, by one product; the magnitudes of a sketch's lowest frequencies, its
spectrum, do not depend on the starting point and can be compared as vectors.

Read next: `view_index.py`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

POINTS = 24
"""Points of a sketch, evenly spaced along the outline."""

HEIGHTS = 6
"""Heights of a point."""

FREQUENCIES = 6
"""Frequencies of a spectrum."""

SPECTRUM = FREQUENCIES * ((HEIGHTS + 1) // 2)
"""Entries of a spectrum."""

_UNIT = 127.0
_TURNS = (np.arange(POINTS)[:, None] + np.arange(POINTS)) % POINTS
_BETA = 0.2


def sketch(heights: NDArray[np.floating]) -> NDArray[np.int8]:
    """The sketch of an outline.

    Args:
        heights: (P, H) height functions in [-1, 1]; P a multiple of `POINTS`, H of `HEIGHTS`.

    Returns:
        (POINTS, HEIGHTS) int8: means over neighbours, in 127ths.

    Example:
        >>> sketch(np.full((96, 24), 0.5)).shape, int(sketch(np.full((96, 24), 0.5))[0, 0])
        ((24, 6), 64)
    """
    points, count = heights.shape
    means = heights.reshape(POINTS, points // POINTS, HEIGHTS, count // HEIGHTS).mean(axis=(1, 3))
    return np.asarray(np.round(np.clip(means, -1, 1) * _UNIT), dtype=np.int8)


def spectra(sketches: NDArray[np.int8]) -> NDArray[np.float32]:
    """Descriptors of sketches, invariant to starting point and mirroring.

    Args:
        sketches: (V, POINTS, HEIGHTS) int8.

    Returns:
        (V, SPECTRUM) float32.
    """
    angle = 2 * np.pi / POINTS * np.outer(np.arange(FREQUENCIES), np.arange(POINTS))
    waves = np.concatenate([np.cos(angle), np.sin(angle)]).astype(np.float32) / (POINTS * _UNIT)
    both = np.matmul(waves, sketches.astype(np.float32))
    size = np.hypot(both[:, :FREQUENCIES], both[:, FREQUENCIES:])
    # The mirror image has the heights in opposite order.
    means = 0.5 * (size + size[:, :, ::-1])
    return np.ascontiguousarray(means[:, :, : (HEIGHTS + 1) // 2].reshape(len(sketches), -1))


def sketch_distances(query: NDArray[np.int8], sketches: NDArray[np.int8]) -> NDArray[np.float32]:
    """Distance of one sketch from many, each at its best rotation, mirrored or not.

    Args:
        query: (POINTS, HEIGHTS) int8.
        sketches: (V, POINTS, HEIGHTS) int8.

    Returns:
        (V,) float32, 0 for equal sketches; for plain outlines smaller differences count more.
    """
    query_heights, others = (
        query.astype(np.float32) / _UNIT,
        sketches.astype(np.float32) / np.float32(_UNIT),
    )
    # The mirror image has both axes reversed.
    rotated = np.stack([query_heights, query_heights[::-1, ::-1]])[:, _TURNS].reshape(
        2 * POINTS, -1
    )
    correlations = (others.reshape(len(others), -1) @ rotated.T).max(axis=1)
    squares = (query_heights**2).sum() + (others**2).sum(axis=(1, 2)) - 2 * correlations
    mean = np.sqrt(np.maximum(squares, 0.0) / (POINTS * HEIGHTS))
    varied = query_heights.std(axis=0).mean() + others.std(axis=1).mean(axis=1)
    return np.asarray(mean / (_BETA + varied), dtype=np.float32)
