"""Compiled products of small matrices: threads of a linear algebra library cost more than they bring."""

from __future__ import annotations

import numpy as np

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Doubles = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@compiled
def affine_product(rows: Floats, matrix: Floats, offset: Floats) -> Floats:
    """The product rows @ matrix + offset, (N, H) float32, of (N, D), (D, H) and (H,)."""
    out = np.empty((rows.shape[0], matrix.shape[1]), np.float32)
    for n in range(rows.shape[0]):
        for h in range(matrix.shape[1]):
            out[n, h] = offset[h]
        for d in range(rows.shape[1]):
            value = rows[n, d]
            for h in range(matrix.shape[1]):
                out[n, h] += value * matrix[d, h]
    return out


@compiled
def smoothed_and_turned(matrix: Doubles, values: Doubles) -> Doubles:
    """(matrix @ values).T, (M, B) float64, of (B, B) and (B, M)."""
    bins, many = values.shape
    out = np.zeros((many, bins), np.float64)
    for k in range(bins):
        for b in range(bins):
            weight = matrix[b, k]
            if weight != 0:
                for m in range(many):
                    out[m, b] += weight * values[k, m]
    return out
