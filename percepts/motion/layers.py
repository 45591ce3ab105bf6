"""Layers of motion: affine models fitted to constraints by robust EM, with an outlier class.

The background is not one layer but a few large ones: what covers most of the image, what is fixed
to the camera (a sill, a bonnet, stars seen from a camera that keeps its attitude) and possibly a
second wide layer (a planet that drifts behind). Everything else that moves is an object.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from visup.percepts.motion.constraints import Constraints, mahalanobis
from visup.percepts.motion.image import Floats

Doubles = NDArray[np.float64]
SETTLED = 0.003  # pixels, far below what is measured: a fit that moves by less is done
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
        x, y = np.ascontiguousarray(xy.T, dtype=np.float32)
        out = np.empty((len(xy), 2), dtype=np.float32)
        bend = np.zeros((2, 3)) if self.bend is None else self.bend / 1000.0
        for i, ((a, b, c), (d, e, f)) in enumerate(
            zip(self.matrix.tolist(), bend.tolist(), strict=True)
        ):
            if self.bend is None:
                out[:, i] = a * x + b * y + c
            else:
                out[:, i] = (a + d * x + e * y) * x + (b + f * y) * y + c
        return out

    def shift(self, where: tuple[float, float]) -> tuple[float, float]:
        """(x, y) displacement of one position; what `at` says, without arrays."""
        x, y = where
        (a, b, c), (d, e, f) = self.matrix.tolist()
        dx, dy = a * x + b * y + c, d * x + e * y + f
        if self.bend is not None:
            (p, q, r), (s, t, u) = self.bend.tolist()
            dx += (p * x * x + q * x * y + r * y * y) / 1000.0
            dy += (s * x * x + t * x * y + u * y * y) / 1000.0
        return dx, dy

    def scaled(self, factor: float) -> Affine:
        """The same motion over a baseline that is `factor` times as long."""
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
    phi = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)])
    hold = np.diag([1.0, 1.0, 1.0, 1e-2, 1e-2, 1e-3] * 2) / slack**2
    model, w = _reweighted(_System(c, use, phi, slack), share, start.at(xy), hold, 3.0, 5)
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
    a, b, c = np.ascontiguousarray(information.T, dtype=np.float64)
    # (L^-1 + v I)^-1 = L (I + v L)^-1, in closed form for 2 x 2, safe when L is singular.
    v = sigma * sigma
    det = a * c - b * b
    scale = 1 / (1 + v * (a + c) + v * v * det)
    out = np.empty(information.shape, dtype=np.float32)
    out[:, 0] = (a + v * det) * scale
    out[:, 1] = b * scale
    out[:, 2] = (c + v * det) * scale
    return out


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
    # What has no weight has no say, and an object has few of the constraints.
    use = np.flatnonzero(weight > 0)
    xy, share = c.xy[use], weight[use]
    centre = (share @ xy) / total
    spread = float(np.sqrt((share @ ((xy - centre) ** 2).sum(1)) / total)) + 1.0
    phi = np.ones((3, len(use)))
    phi[:2] = ((xy - centre) / spread).T
    # Along an edge nothing is known: the least motion is taken there, not a drifting guess.
    hold = np.diag([rigidity, rigidity, 0.01] * 2) / slack**2
    system = _System(c, use, phi, slack)
    model, w = _reweighted(system, share, guess.at(xy), hold, cutoff, rounds)
    linear = model[:, :2] / spread
    matrix = np.concatenate([linear, (model[:, 2] - linear @ centre)[:, None]], axis=1)
    mean_info = float(w @ (system.info[0] + system.info[2])) / 2 + 1e-9
    return Affine(matrix, float(1 / np.sqrt(mean_info)), float(w.sum()))


class _System:
    """Least squares for a displacement field that is linear in `phi` (K, N)."""

    def __init__(self, c: Constraints, use: NDArray[np.int64], phi: Doubles, slack: float) -> None:
        self.phi = phi
        self.info = widened(c.information[use], slack).T.astype(np.float64)
        self.moved = c.moved[use].T.astype(np.float64)
        a, b, d = self.info
        dx, dy = self.moved
        self._pull = np.stack([a * dx + b * dy, b * dx + d * dy])
        # Products of coordinates do not change from round to round.
        self._pairs = (phi[:, None] * phi).reshape(len(phi) ** 2, -1).T

    def solve(self, w: Doubles, hold: Doubles) -> Doubles:
        """(2, K) coefficients for (N,) weights."""
        k = len(self.phi)
        xx, xy, yy = ((self.info * w) @ self._pairs).reshape(3, k, k)
        normal = hold.copy()
        normal[:k, :k] += xx
        normal[:k, k:] += xy
        normal[k:, :k] += xy
        normal[k:, k:] += yy
        right = (self._pull * w) @ self.phi.T
        # What is held is held by more than nothing: the matrix is positive definite.
        _, found, _ = dposv(normal, right.ravel())
        return np.asarray(found.reshape(2, k))

    def squared(self, fitted: Doubles) -> Doubles:
        """Squared Mahalanobis distance of each constraint to (2, N) displacements, (N,)."""
        ex, ey = self.moved - fitted
        a, b, d = self.info
        return np.asarray((a * ex + 2 * b * ey) * ex + d * ey * ey)


def _reweighted(
    system: _System, weight: Floats, fitted: Floats, hold: Doubles, cutoff: float, rounds: int
) -> tuple[Doubles, Doubles]:
    """Iteratively reweighted least squares: (2, K) coefficients and the last (N,) weights."""
    displaced = fitted.T.astype(np.float64)
    for _ in range(rounds):
        w = weight / (1 + system.squared(displaced) / cutoff**2) ** 2
        model = system.solve(w, hold)
        before, displaced = displaced, model @ system.phi
        if np.abs(displaced - before).max() < SETTLED:
            break
    return model, w
