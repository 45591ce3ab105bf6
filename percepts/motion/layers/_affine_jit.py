"""Compiled loops of `affine`: robust least-squares fits of layers to constraints."""

from __future__ import annotations

from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Doubles = NDArray[np.float64]
SETTLED = 0.003  # pixels: a fit that moves by less has converged; far below the measurement error


@compiled
def displacements(xy: Floats, matrix: Doubles, bend: Doubles) -> Floats:
    """Displacements of (N, 2) positions under a (2, 3) affine motion with a (2, 3) bend."""
    out = np.empty(xy.shape, np.float32)
    for i in range(2):
        a, b, c = np.float32(matrix[i, 0]), np.float32(matrix[i, 1]), np.float32(matrix[i, 2])
        d, e = np.float32(bend[i, 0] / 1000.0), np.float32(bend[i, 1] / 1000.0)
        f = np.float32(bend[i, 2] / 1000.0)
        for n in range(len(xy)):
            x, y = xy[n, 0], xy[n, 1]
            out[n, i] = (a + d * x + e * y) * x + (b + f * y) * y + c
    return out


@compiled
def squared_misfits(
    xy: Floats, moved: Floats, information: Floats, matrix: Doubles, bend: Doubles, slack: float
) -> Floats:
    """Squared Mahalanobis distance of N constraints to a motion known up to `slack`."""
    at = displacements(xy, matrix, bend)
    out = np.empty(len(xy), np.float32)
    v = slack * slack
    for n in range(len(xy)):
        a, b, c = float(information[n, 0]), float(information[n, 1]), float(information[n, 2])
        det = a * c - b * b
        scale = 1 / (1 + v * (a + c) + v * v * det)
        ex, ey = float(at[n, 0] - moved[n, 0]), float(at[n, 1] - moved[n, 1])
        a, b, c = (a + v * det) * scale, b * scale, (c + v * det) * scale
        out[n] = (a * ex + 2 * b * ey) * ex + c * ey * ey
    return out


@compiled
def log_likelihoods(
    xy: Floats, moved: Floats, information: Floats, matrix: Doubles, bend: Doubles, slack: float
) -> Floats:
    """Log likelihood of N constraints under a motion, relative to one that is exactly known."""
    out = squared_misfits(xy, moved, information, matrix, bend, slack)
    v = slack * slack
    for n in range(len(xy)):
        a, b, c = float(information[n, 0]), float(information[n, 1]), float(information[n, 2])
        det = a * c - b * b
        wide = (a + c + 2 * v * det) / (1 + v * (a + c) + v * v * det)
        width = log(max(wide, 1e-9) / (a + c + 1e-9))
        out[n] = 0.5 * width - 0.5 * out[n]
    return out


@compiled
def reweighted_least_squares(
    phi: Doubles,
    moved: Floats,
    information: Floats,
    weight: Doubles,
    start: Floats,
    hold: Doubles,
    slack: float,
    cutoff: float,
    rounds: int,
) -> tuple[Doubles, Doubles, float]:
    """Iteratively reweighted least squares for a displacement field that is linear in `phi`.

    Args:
        phi: (N, K) float64.
        moved: (N, 2) float32 displacements.
        information: (N, 3) float32 inverse covariances.
        weight: (N,) float64.
        start: (N, 2) float32 displacements to begin with.
        hold: (K,) float64, how strongly each coefficient is held at zero; positive.
        slack: Error of the model itself, pixels.
        cutoff: Mahalanobis distance beyond which a constraint hardly counts.
        rounds: Most iterations.

    Returns:
        (2, K) coefficients, the last (N,) weights, and the mean information of N under these.

    Nine parameters: unpacking a record at each of hundreds of calls per frame costs more than a fit to few
    constraints.
    """
    count, k = phi.shape
    info = with_slack(information, slack)
    now = start.astype(np.float64)
    w, model = np.empty(count), np.zeros((2, k))
    normal, right = np.empty((2 * k, 2 * k)), np.empty(2 * k)
    for _ in range(rounds):
        _reweight(moved, info, weight, now, cutoff, w)
        normal[:], right[:] = 0, 0
        for i in range(k):
            normal[i, i] = normal[k + i, k + i] = hold[i]
        add_equations(phi, moved, info, w, normal, right)
        solve(normal, right)
        model = right.copy().reshape(2, k)
        if _move(phi, model, now) < SETTLED:
            break
    mean = 0.0
    for n in range(count):
        mean += w[n] * (info[n, 0] + info[n, 2])
    return model, w, mean


@compiled
def affine_fit(
    points: tuple[Floats, Floats, Floats],
    weight: Floats,
    guess: tuple[Doubles, Doubles],
    limits: tuple[float, float, float],
    rounds: int,
) -> tuple[Doubles, float, float]:
    """A robust affine fit to those of N constraints that have a weight.

    Args:
        points: (N, 2) positions, (N, 2) displacements, (N, 3) inverse covariances.
        weight: (N,), how far each belongs to the layer.
        guess: (2, 3) matrix and (2, 3) bend to start from.
        limits: How strongly the linear part is held at zero; error of the model, pixels; Mahalanobis distance
            beyond which a constraint hardly counts.
        rounds: Most iterations.

    Returns:
        (2, 3) matrix, standard deviation of its displacements, pixels, and sum of the last weights; that is
        negative when there is nothing to fit.
    """
    xy, moved, information = points
    use = np.flatnonzero(weight > 0)
    count, total, x, y = len(use), 0.0, 0.0, 0.0
    for n in use:
        total += weight[n]
        x += weight[n] * xy[n, 0]
        y += weight[n] * xy[n, 1]
    if total < 3.0:
        return guess[0], 0.0, -1.0
    x, y, wide = x / total, y / total, 0.0
    for n in use:
        wide += weight[n] * ((xy[n, 0] - x) ** 2 + (xy[n, 1] - y) ** 2)
    spread = sqrt(wide / total) + 1.0
    phi, share = np.ones((count, 3)), np.empty(count)
    for i in range(count):
        n = use[i]
        phi[i, 0], phi[i, 1], share[i] = (xy[n, 0] - x) / spread, (xy[n, 1] - y) / spread, weight[n]
    rigidity, slack, cutoff = limits
    # Along an edge motion is unknown: regularise towards none, not towards a drifting guess.
    hold = np.array([rigidity, rigidity, 0.01]) / slack**2
    start = displacements(xy[use], guess[0], guess[1])
    model, w, mean = reweighted_least_squares(
        phi, moved[use], information[use], share, start, hold, slack, cutoff, rounds
    )
    matrix = np.empty((2, 3))
    for i in range(2):
        matrix[i, 0], matrix[i, 1] = model[i, 0] / spread, model[i, 1] / spread
        matrix[i, 2] = model[i, 2] - (matrix[i, 0] * x + matrix[i, 1] * y)
    return matrix, 1 / sqrt(mean / 2 + 1e-9), w.sum()


@compiled
def with_slack(information: Floats, slack: float) -> Doubles:
    """(N, 3) information after adding an isotropic variance to the covariance."""
    v, out = slack * slack, np.empty((len(information), 3))
    for n in range(len(information)):
        a, b, c = float(information[n, 0]), float(information[n, 1]), float(information[n, 2])
        det = a * c - b * b
        scale = 1 / (1 + v * (a + c) + v * v * det)
        out[n, 0], out[n, 1], out[n, 2] = (a + v * det) * scale, b * scale, (c + v * det) * scale
    return out


@compiled
def _reweight(
    moved: Floats, info: Doubles, weight: Doubles, now: Doubles, cutoff: float, out: Doubles
) -> None:
    """Weights (N,) of constraints under the current displacements (N, 2)."""
    for n in range(len(moved)):
        a, b, c = info[n, 0], info[n, 1], info[n, 2]
        dx, dy = float(moved[n, 0]), float(moved[n, 1])
        ex, ey = dx - now[n, 0], dy - now[n, 1]
        off = 1 + ((a * ex + 2 * b * ey) * ex + c * ey * ey) / cutoff**2
        out[n] = weight[n] / (off * off)


@compiled
def add_equations(
    phi: Doubles, moved: Floats, info: Doubles, w: Doubles, normal: Doubles, right: Doubles
) -> None:
    """Add the weighted normal equations, (2K, 2K), lower triangle only, and (2K,)."""
    count, k = phi.shape
    for n in range(count):
        a, b, c = info[n, 0], info[n, 1], info[n, 2]
        dx, dy = float(moved[n, 0]), float(moved[n, 1])
        for i in range(k):
            p = w[n] * phi[n, i]
            right[i] += p * (a * dx + b * dy)
            right[k + i] += p * (b * dx + c * dy)
            for j in range(i + 1):
                normal[i, j] += p * phi[n, j] * a
                normal[k + i, k + j] += p * phi[n, j] * c
            for j in range(k):
                normal[k + i, j] += p * phi[n, j] * b


@compiled
def _move(phi: Doubles, model: Doubles, now: Doubles) -> float:
    """Set displacements (N, 2) to a model's; returns the longest step, pixels."""
    longest = 0.0
    for n in range(len(phi)):
        for i in range(2):
            there = 0.0
            for j in range(phi.shape[1]):
                there += model[i, j] * phi[n, j]
            longest = max(longest, abs(there - now[n, i]))
            now[n, i] = there
    return longest


@compiled
def solve(normal: Doubles, right: Doubles) -> None:
    """Solve a positive definite system in place by Cholesky; the lower triangle is read."""
    size = len(right)
    for i in range(size):
        for j in range(i + 1):
            total = normal[i, j]
            for k in range(j):
                total -= normal[i, k] * normal[j, k]
            normal[i, j] = sqrt(total) if i == j else total / normal[j, j]
    for i in range(size):
        for k in range(i):
            right[i] -= normal[i, k] * right[k]
        right[i] /= normal[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            right[i] -= normal[k, i] * right[k]
        right[i] /= normal[i, i]


@compiled
def median(values: Floats) -> float:
    """The median of (N,) float32, N > 0, rounded as `np.median` does."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    parts = np.partition(values, half)
    return float((parts[:half].max() + parts[half]) / np.float32(2))


@compiled
def quantile(values: Floats, share: float) -> float:
    """The quantile at `share` of (N,) float32, N > 0, linearly interpolated."""
    ordered, at = np.sort(values), share * (len(values) - 1)
    low = int(at)
    high = min(low + 1, len(values) - 1)
    return float(ordered[low]) + (at - low) * (float(ordered[high]) - float(ordered[low]))
