"""Solid texture: several octaves of value noise in space."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

Floats = NDArray[np.float32]
LATTICE_SIDE = 32
"""Values along each side of the lattice, after which the pattern repeats."""

OCTAVES = 4
CONTRAST_GAIN = 2.2
"""Contrast factor: sums of noise concentrate around zero."""


def pattern(points: NDArray[np.floating], seed: int) -> Floats:
    """The pattern at points in space.

    Args:
        points: (N, 3), in units of its largest blotches.
        seed: Chooses the pattern.

    Returns:
        (N,) float32, -1 to 1, about 0 in the mean.
    """
    lattice = _lattice(seed)
    total = np.zeros(len(points), np.float32)
    position = np.asarray(points, np.float32)
    weight, total_weight = 1.0, 0.0
    for _ in range(OCTAVES):
        cell = np.floor(position)
        fraction = position - cell
        # Smoothstep within each cell hides the lattice.
        eased = cell + fraction * fraction * (3 - 2 * fraction)
        total += np.float32(weight) * map_coordinates(lattice, eased.T, order=1, mode="grid-wrap")
        total_weight += weight
        # Shifted as well, so that the corners of the lattices do not coincide.
        weight, position = 0.6 * weight, 2 * position + np.float32(7.3)
    return np.asarray(np.clip(CONTRAST_GAIN * total / total_weight, -1, 1), np.float32)


@lru_cache(maxsize=16)
def _lattice(seed: int) -> Floats:
    values = np.random.default_rng(seed).uniform(-1, 1, (LATTICE_SIDE, LATTICE_SIDE, LATTICE_SIDE))
    return values.astype(np.float32)
