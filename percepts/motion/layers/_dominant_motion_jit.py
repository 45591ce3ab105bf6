"""Compiled loops of `dominant_motion`: fits to random samples, and the weight that each motion explains."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers._affine_jit import Doubles, add_equations, solve, with_slack

UNIT = 50.0  # pixels: positions are scaled by it, so that all coefficients are of one size
HOLD = 1e-2  # added to the normal equations, so that they can always be solved


@compiled
def sample_fits(xy: Floats, moved: Floats, information: Floats, pick: NDArray[np.int64]) -> Doubles:
    """Affine motions through each of (M, n) samples of N constraints, (M, 2, 3).

    Args:
        xy: (N, 2) positions.
        moved: (N, 2) displacements.
        information: (N, 3) inverse covariances.
        pick: (M, n) which constraints each sample holds.
    """
    samples, size = pick.shape
    out, alike = np.empty((samples, 2, 3)), np.ones(size)
    phi, normal, right = np.ones((size, 3)), np.empty((6, 6)), np.empty(6)
    for s in range(samples):
        at = pick[s]
        x, y = 0.0, 0.0
        for n in at:
            x, y = x + xy[n, 0] / size, y + xy[n, 1] / size
        for i in range(size):
            phi[i, 0], phi[i, 1] = (xy[at[i], 0] - x) / UNIT, (xy[at[i], 1] - y) / UNIT
        normal[:], right[:] = 0, 0
        for i in range(6):
            normal[i, i] = HOLD
        add_equations(phi, moved[at], with_slack(information[at], 0.0), alike, normal, right)
        solve(normal, right)
        for i in range(2):
            a, b = right[3 * i] / UNIT, right[3 * i + 1] / UNIT
            out[s, i, 0], out[s, i, 1], out[s, i, 2] = a, b, right[3 * i + 2] - a * x - b * y
    return out


@compiled
def explained_weights(
    xy: Floats, moved: Floats, information: Floats, weight: Floats, matrices: Floats, far: float
) -> Floats:
    """Total weight of the constraints that each of M motions explains, (M,) float32.

    Args:
        xy: (N, 2) positions.
        moved: (N, 2) displacements.
        information: (N, 3) inverse covariances.
        weight: (N,) float32.
        matrices: (2, 3, M) float32, the motions.
        far: Squared Mahalanobis distance from which a motion does not explain a constraint at all.
    """
    count = matrices.shape[2]
    out, one, far32 = np.zeros(count, np.float32), np.float32(1), np.float32(far)
    for n in range(len(xy)):
        x, y, u, v, w = xy[n, 0], xy[n, 1], moved[n, 0], moved[n, 1], weight[n]
        a, b, c = information[n, 0], information[n, 1], information[n, 2]
        b += b
        for m in range(count):  # the inner loop, so that the processor takes several at once
            ex = matrices[0, 0, m] * x + matrices[0, 1, m] * y + matrices[0, 2, m] - u
            ey = matrices[1, 0, m] * x + matrices[1, 1, m] * y + matrices[1, 2, m] - v
            off = (a * ex + b * ey) * ex + c * ey * ey
            out[m] += w * max(np.float32(0), one - off / far32)
    return out


@compiled
def grid_cells(xy: Floats, shape: tuple[int, int], grid: tuple[int, int]) -> NDArray[np.int64]:
    """The cell of a (rows, columns) grid over an image that each of (N, 2) positions lies in, (N,)."""
    rows, cols = grid
    down, along = np.float32(rows), np.float32(cols)
    height, width = np.float32(shape[0]), np.float32(shape[1])
    out = np.empty(len(xy), np.int64)
    for n in range(len(xy)):
        row = min(max(int(xy[n, 1] * down / height), 0), rows - 1)
        col = min(max(int(xy[n, 0] * along / width), 0), cols - 1)
        out[n] = row * cols + col
    return out
