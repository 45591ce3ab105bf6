"""Layers of motion: affine models fitted to constraints by robust EM with an outlier class.

The background is not one layer but a few large ones: the dominant motion, what is fixed
to the camera (a sill, a bonnet, stars seen from a camera that keeps its attitude) and possibly a
second wide layer (a planet that drifts behind). Everything else that moves is an object.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.motion_constraints import Constraints
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers._affine_jit import (
    affine_fit,
    displacements,
    log_likelihoods,
    reweighted_least_squares,
    squared_misfits,
    with_slack,
)

Doubles = NDArray[np.float64]
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
        there = np.ascontiguousarray(xy, dtype=np.float32)
        return displacements(there, *self._coefficients)

    @property
    def _coefficients(self) -> tuple[Doubles, Doubles]:
        """(2, 3) and (2, 3) float64, as the compiled loops take them."""
        matrix = np.ascontiguousarray(self.matrix, dtype=np.float64)
        bend = STILL if self.bend is None else np.ascontiguousarray(self.bend, dtype=np.float64)
        return matrix, bend

    def shift(self, where: tuple[float, float]) -> tuple[float, float]:
        """(x, y) displacement of one position; as `at`, without arrays."""
        x, y = where
        (a, b, c), (d, e, f) = self.matrix.tolist()
        dx, dy = a * x + b * y + c, d * x + e * y + f
        if self.bend is not None:
            (p, q, r), (s, t, u) = self.bend.tolist()
            dx += (p * x * x + q * x * y + r * y * y) / 1000.0
            dy += (s * x * x + t * x * y + u * y * y) / 1000.0
        return dx, dy

    def scaled(self, factor: float) -> Affine:
        """The same motion over a baseline `factor` times as long."""
        bend = None if self.bend is None else self.bend * factor
        return Affine(self.matrix * factor, self.sigma * factor, self.support, bend)


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
    use = np.flatnonzero(weight > 0)
    if not len(use):
        return start
    xy, share = c.xy[use], weight[use]
    centre, spread = xy.mean(axis=0), float(xy.std()) + 1.0
    x, y = ((xy - centre) / spread).T.astype(np.float64)
    phi = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    hold = np.array([1.0, 1.0, 1.0, 1e-2, 1e-2, 1e-3]) / slack**2
    moved, information = c.moved[use], c.information[use]
    model, w, _ = reweighted_least_squares(
        phi, moved, information, share.astype(np.float64), start.at(xy), hold, slack, 3.0, 5
    )
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
    return squared_misfits(c.xy, c.moved, c.information, *model._coefficients, max(slack, 0.0))


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
    return log_likelihoods(c.xy, c.moved, c.information, *model._coefficients, max(slack, 0.0))


def widened(information: Floats, sigma: float) -> Floats:
    """Information after adding an isotropic variance to the covariance, (N, 3) float32."""
    if sigma <= 0:
        return information
    return with_slack(information, sigma).astype(np.float32)


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
    points, limits = (c.xy, c.moved, c.information), (rigidity, slack, cutoff)
    matrix, sigma, support = affine_fit(points, weight, guess._coefficients, limits, rounds)
    if support < 0:
        return Affine(guess.matrix, guess.sigma, 0.0)
    return Affine(matrix, sigma, support)
