"""Layers of motion: affine models fitted to constraints by robust EM, with an outlier class.

The background is not one layer but a few large ones: what covers most of the image, what is fixed
to the camera (a sill, a bonnet, stars seen from a camera that keeps its attitude) and possibly a
second wide layer (a planet that drifts behind). Everything else that moves is an object.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.constraints import Constraints, mahalanobis
from visup.percepts.motion.image import Floats

Doubles = NDArray[np.float64]
GRID = (6, 8)
STILL: Doubles = np.zeros((2, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Affine:
    """A displacement field that is affine in position: d(x, y) = matrix @ (x, y, 1).

    Attributes:
        matrix: (2, 3) float64, pixels of displacement.
        sigma: Standard deviation of its displacements where it was fitted, pixels.
        support: How many constraints it rests on (sum of weights).
        bend: (2, 3) float64 coefficients of (x^2, xy, y^2) / 1000, for a camera that turns or a
            scene that is tilted; None for a plain affine motion.
    """

    matrix: Doubles
    sigma: float = 0.0
    support: float = 0.0
    bend: Doubles | None = None

    def at(self, xy: Floats) -> Floats:
        """Displacements of (N, 2) positions, (N, 2) float32."""
        out = xy @ self.matrix[:, :2].T + self.matrix[:, 2]
        if self.bend is not None:
            out = out + _squares(xy) @ self.bend.T
        return np.asarray(out, dtype=np.float32)

    def scaled(self, factor: float) -> Affine:
        """The same motion over a baseline that is `factor` times as long."""
        bend = None if self.bend is None else self.bend * factor
        return Affine(self.matrix * factor, self.sigma * factor, self.support, bend)


def _squares(xy: Floats) -> Doubles:
    x, y = xy.T.astype(np.float64)
    return np.stack([x * x, x * y, y * y], axis=1) / 1000.0


def fit_bent(c: Constraints, weight: Floats, start: Affine, slack: float = 0.15) -> Affine:
    """A robust quadratic fit, for the background of a camera that moves.

    Args:
        c: N constraints.
        weight: (N,) float32, how far each belongs to the layer.
        start: An affine fit.
        slack: Error of the model itself, pixels.

    Returns:
        The bent motion.
    """
    info = widened(c.information, slack)
    centre, spread = c.xy.mean(axis=0), float(c.xy.std()) + 1.0
    x, y = ((c.xy - centre) / spread).T.astype(np.float64)
    phi = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    moved = c.moved.astype(np.float64)
    fitted = start.at(c.xy)
    hold = np.diag([1.0, 1.0, 1.0, 1e-2, 1e-2, 1e-3] * 2) / slack**2
    for _ in range(5):
        m2 = mahalanobis((moved - fitted).astype(np.float32), info)
        w = weight / (1 + m2 / 3.0**2) ** 2
        model = _solve(phi, info.astype(np.float64), moved, w.astype(np.float64), hold)
        fitted = np.asarray(phi @ model.T, dtype=np.float32)
    return _unscaled(model, centre, spread, float(w.sum()))


def _unscaled(model: Doubles, centre: Doubles, spread: float, support: float) -> Affine:
    """A quadratic in centred and scaled coordinates as one in pixels."""
    a, b, c = (model[:, i] / spread**2 for i in range(3))
    d, e = model[:, 3] / spread, model[:, 4] / spread
    x, y = float(centre[0]), float(centre[1])
    linear_x = d - 2 * a * x - b * y
    linear_y = e - 2 * c * y - b * x
    constant = model[:, 5] - d * x - e * y + a * x * x + b * x * y + c * y * y
    matrix = np.stack([linear_x, linear_y, constant], axis=1)
    return Affine(matrix, 0.0, support, np.stack([a, b, c], axis=1) * 1000.0)


def distances(model: Affine, c: Constraints, slack: float = 0.0) -> Floats:
    """Squared Mahalanobis distance of each constraint to a layer.

    Args:
        model: The layer's displacement over the baseline of the constraints.
        c: N constraints.
        slack: Standard deviation to allow for the model itself, pixels.

    Returns:
        (N,) float32.
    """
    return mahalanobis(model.at(c.xy) - c.moved, widened(c.information, slack))


def log_likelihood(model: Affine, c: Constraints, slack: float) -> Floats:
    """Log likelihood of each constraint under a layer, relative to one that is exactly known.

    A layer that is allowed a wide error pays for it, or it would explain everything.

    Args:
        model: The layer's displacement over the baseline of the constraints.
        c: N constraints.
        slack: Standard deviation to allow for the model itself, pixels.

    Returns:
        (N,) float32, 0 at best.
    """
    wide = widened(c.information, slack)
    width = np.log(
        np.maximum(wide[:, 0] + wide[:, 2], 1e-9)
        / (c.information[:, 0] + c.information[:, 2] + 1e-9)
    )
    m2 = mahalanobis(model.at(c.xy) - c.moved, wide)
    return np.asarray(0.5 * width - 0.5 * m2, dtype=np.float32)


def widened(information: Floats, sigma: float) -> Floats:
    """Information after adding an isotropic variance to the covariance, (N, 3) float32."""
    if sigma <= 0:
        return information
    a, b, c = information.T.astype(np.float64)
    # (L^-1 + v I)^-1 = L (I + v L)^-1, in closed form for 2 x 2, safe when L is singular.
    v = sigma * sigma
    det = a * c - b * b
    scale = 1 + v * (a + c) + v * v * det
    return np.stack([(a + v * det) / scale, b / scale, (c + v * det) / scale], 1).astype(np.float32)


def fit_affine(
    c: Constraints,
    weight: Floats,
    guess: Affine,
    *,
    rigidity: float = 3.0,
    rounds: int = 4,
    slack: float = 0.1,
    cutoff: float = 3.5,
) -> Affine:
    """A robust affine fit by iteratively reweighted least squares (the M and E steps of one layer).

    Args:
        c: N constraints.
        weight: (N,) float32, how far each belongs to the layer.
        guess: Where to start.
        rigidity: How strongly the linear part is held at zero.
        rounds: Iterations.
        slack: Error of the model itself, pixels.
        cutoff: Mahalanobis distance beyond which a constraint hardly counts.

    Returns:
        The fitted layer; the guess with no support when there is nothing to fit.
    """
    total = float(weight.sum())
    if total < 3.0:
        return Affine(guess.matrix, guess.sigma, 0.0)
    info = widened(c.information, slack)
    centre = np.average(c.xy, axis=0, weights=weight)
    spread = float(np.sqrt(np.average(((c.xy - centre) ** 2).sum(1), weights=weight))) + 1.0
    phi = np.concatenate([(c.xy - centre) / spread, np.ones((len(c), 1))], axis=1)
    moved = c.moved.astype(np.float64)
    model = np.zeros((2, 3))
    fitted = guess.at(c.xy)
    # Along an edge nothing is known: the least motion is taken there, not a drifting guess.
    hold = np.diag([rigidity, rigidity, 0.01] * 2) / slack**2
    w = weight.astype(np.float64)
    for _ in range(rounds):
        m2 = mahalanobis((moved - fitted).astype(np.float32), info)
        w = weight / (1 + m2 / cutoff**2) ** 2
        model = _solve(phi, info.astype(np.float64), moved, w, hold)
        fitted = np.asarray(phi @ model.T, dtype=np.float32)
    linear = model[:, :2] / spread
    matrix = np.concatenate([linear, (model[:, 2] - linear @ centre)[:, None]], axis=1)
    support = float(w.sum())
    mean_info = float((w * (info[:, 0] + info[:, 2])).sum()) / 2 + 1e-9
    return Affine(matrix, float(1 / np.sqrt(mean_info)), support)


def _solve(phi: Doubles, info: Doubles, residual: Doubles, w: Doubles, hold: Doubles) -> Doubles:
    """Weighted normal equations of a model linear in `phi` (N, K); (2, K)."""
    a, b, c = (info * w[:, None]).T
    dx, dy = residual.T
    blocks = [(phi * k[:, None]).T @ phi for k in (a, b, c)]
    normal = np.block([[blocks[0], blocks[1]], [blocks[1], blocks[2]]]) + hold
    right = np.concatenate([phi.T @ (a * dx + b * dy), phi.T @ (b * dx + c * dy)])
    return np.asarray(np.linalg.solve(normal, right).reshape(2, -1))


def spread_weights(
    xy: Floats, shape: tuple[int, int], keep: Floats
) -> tuple[Floats, NDArray[np.int64]]:
    """Weights with which each part of the image counts once, however many points it has.

    Args:
        xy: (N, 2) positions.
        shape: (h, w) of the image.
        keep: (N,) weight of each point before that, 0 to 1.

    Returns:
        (N,) float32 weights that sum to 1 in each occupied cell; (N,) int64 cell numbers.
    """
    rows, cols = GRID
    row = np.clip(xy[:, 1] * rows / shape[0], 0, rows - 1).astype(np.int64)
    col = np.clip(xy[:, 0] * cols / shape[1], 0, cols - 1).astype(np.int64)
    cell = row * cols + col
    total = np.bincount(cell, weights=keep, minlength=rows * cols)
    return (keep / np.maximum(total[cell], 1e-6)).astype(np.float32) * (keep > 0), cell


def fit_dominant(
    c: Constraints, weight: Floats, guesses: tuple[Affine, ...], seed: int, slack: float = 0.15
) -> Affine:
    """The affine motion that explains the widest part of the image.

    Args:
        c: N constraints.
        weight: (N,) float32 spatially balanced weights.
        guesses: Motions to try first; earlier ones win ties.
        seed: For the random samples.
        slack: Error of the model itself, pixels.

    Returns:
        The refined best motion; the first guess when there is too little to go by.
    """
    usable = np.flatnonzero(weight > 0)
    if len(usable) < 8:
        return guesses[0]
    rng = np.random.default_rng(seed)
    info = widened(c.information, slack)

    def score(model: Affine) -> float:
        m2 = mahalanobis(model.at(c.xy) - c.moved, info)
        return float((weight * np.maximum(0, 1 - m2 / 12.0)).sum())

    best, best_score = guesses[0], 1.03 * score(guesses[0]) + 1e-6
    for guess in guesses[1:]:
        s = score(guess)
        if s > best_score:
            best, best_score = guess, s
    chance = weight[usable] / weight[usable].sum()
    if best_score < 0.8 * weight.sum():
        for _ in range(40):
            pick = rng.choice(usable, 4, replace=False, p=chance)
            model = _exact(c, pick)
            s = score(model)
            if s > best_score:
                best, best_score = model, s
    # No ties to the guess: zoom and rotation of the camera must come out whole.
    return fit_affine(c, weight * 20, best, rigidity=0.02, rounds=5, slack=slack, cutoff=2.5)


def _exact(c: Constraints, pick: NDArray[np.int64]) -> Affine:
    xy, moved = c.xy[pick].astype(np.float64), c.moved[pick].astype(np.float64)
    info = c.information[pick].astype(np.float64)
    centre = xy.mean(0)
    phi = np.concatenate([(xy - centre) / 50.0, np.ones((len(xy), 1))], axis=1)
    model = _solve(phi, info, moved, np.ones(len(xy)), np.eye(6) * 1e-2)
    linear = model[:, :2] / 50.0
    return Affine(np.concatenate([linear, (model[:, 2] - linear @ centre)[:, None]], axis=1))
