"""Compiled loops of `truncated_views.py`: where remainders of cut views are sampled, and with what weight."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]


class Samples(NamedTuple):
    """Where the remainders of a view are sampled.

    Attributes:
        centres: (B, S, 2) centroid of the remainder of each bearing and share, units.
        units: (S,) unit of length of the remainders of each share, units.
        radii: (R,) of the rings, in units of the remainder.
        directions: (2, B, A) cosines and sines of the samples of a ring, for each bearing.
    """

    centres: Doubles
    units: Doubles
    radii: Doubles
    directions: Doubles


@compiled
def places_of_samples(samples: Samples, half: float, pixels: float) -> Floats:
    """Where the remainders of a view are sampled, in pixels of its raster.

    Args:
        samples: The same in units.
        half: Half the side of the raster, units.
        pixels: Pixels per unit.

    Returns:
        (2, B * S * R, A), columns and rows.
    """
    centres, units, radii, directions = samples
    bearings, angles = directions.shape[1:]
    found = np.empty((2, bearings * len(units) * len(radii), angles), np.float32)
    at = 0
    for i in range(bearings):
        for j in range(len(units)):
            for radius in radii:
                reach = units[j] * radius
                for k in range(angles):
                    x = centres[i, j, 0] + reach * directions[0, i, k]
                    y = centres[i, j, 1] + reach * directions[1, i, k]
                    found[0, at, k] = (x + half) * pixels - 0.5
                    found[1, at, k] = (y + half) * pixels - 0.5
                at += 1
    return found


@compiled
def weighted_remainders(
    tone: Floats,
    samples: Samples,
    weights: Doubles,
    normals: Doubles,
    offsets: Doubles,
    blur: float,
) -> Doubles:
    """Maps of remainders: the tone of each sample that the line leaves, weighted by the area it stands for.

    Args:
        tone: (B * S * R, A) tones of the view at the samples.
        samples: Where they are.
        weights: (R,) of the rings.
        normals: (B, 2) outward normals of the lines.
        offsets: (B, S) distances of the lines from the view's centroid, units.
        blur: Width of the lines' edge, units.

    Returns:
        (B, S, R * A).
    """
    centres, units, radii, directions = samples
    bearings, angles = directions.shape[1:]
    found = np.empty((bearings, len(units), len(radii) * angles))
    row = 0
    for i in range(bearings):
        for j in range(len(units)):
            for n in range(len(radii)):
                reach = units[j] * radii[n]
                for k in range(angles):
                    x = centres[i, j, 0] + reach * directions[0, i, k]
                    y = centres[i, j, 1] + reach * directions[1, i, k]
                    within = offsets[i, j] - (x * normals[i, 0] + y * normals[i, 1])
                    if within > blur:
                        inside = 1.0
                    elif within < -blur:
                        inside = 0.0
                    else:
                        inside = min(max(within / blur + 0.5, 0.0), 1.0)
                    found[i, j, n * angles + k] = tone[row, k] * inside * weights[n]
                row += 1
    return found
