"""What is not an object: the few wide or camera-fixed motions that make up the background."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from visup.percepts.motion.constraints import Constraints
from visup.percepts.motion.image import Floats
from visup.percepts.motion.layers import (
    GRID,
    STILL,
    Affine,
    distances,
    fit_dominant,
    spread_weights,
)


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """The motions of the background over one baseline.

    Attributes:
        models: The dominant one first.
        scale: How much wider than expected its errors are (parallax, a bent scene), at least 1.
        fixed: Whether something is seen to be fixed to the camera while the rest moves; None when
            the baseline is too short to tell.
    """

    models: tuple[Affine, ...]
    scale: float
    fixed: bool | None

    def distances(self, c: Constraints) -> Floats:
        """Squared distance of each constraint to the nearest background motion, (N,) float32."""
        slack = [0.1 + 0.03 * m.sigma for m in self.models]
        nearest = np.min([distances(m, c, s) for m, s in zip(self.models, slack, strict=True)], 0)
        return np.asarray(nearest / self.scale**2, dtype=np.float32)


def find_background(
    c: Constraints,
    outside: Floats,
    shape: tuple[int, int],
    guess: Affine,
    still_too: bool,
    seed: int,
) -> Background:
    """Fit the background to the constraints that belong to no object.

    Args:
        c: N constraints over one baseline.
        outside: (N,) float32, how far each point is outside all objects, 0 to 1.
        shape: (h, w) of the image.
        guess: Camera motion as predicted.
        still_too: Whether things fixed to the camera are background as well.
        seed: For random samples.

    Returns:
        The background.
    """
    weight, cell = spread_weights(c.xy, shape, outside)
    still = Affine(STILL)
    dominant = fit_dominant(c, weight, (still, guess), seed)
    models = [dominant]
    to_dominant = distances(dominant, c, 0.15)
    fixed = _is_fixed(c, outside, to_dominant)
    if still_too or fixed:
        models.append(still)
    rest = np.minimum(to_dominant, distances(still, c, 0.1) if len(models) > 1 else np.inf)
    second = _second(c, outside * (rest > 16), shape, seed)
    if second is not None:
        models.append(second)
        rest = np.minimum(rest, distances(second, c, 0.15))
    return Background(tuple(models), _scale(rest, weight, cell), fixed)


def _is_fixed(c: Constraints, outside: Floats, to_dominant: Floats) -> bool | None:
    if c.span_s < 0.4 or len(c) < 8:
        return None
    tight = (distances(Affine(STILL), c) < 4) & (to_dominant > 16) & (outside > 0.5)
    return bool(np.count_nonzero(tight) >= 8)


def _second(c: Constraints, weight: Floats, shape: tuple[int, int], seed: int) -> Affine | None:
    """A second wide motion, such as a planet behind; an object is narrower than a quarter of all."""
    if np.count_nonzero(weight) < 30:
        return None
    balanced, cell = spread_weights(c.xy, shape, weight)
    model = fit_dominant(c, balanced, (Affine(STILL),), seed + 1)
    fits = (distances(model, c, 0.15) < 9) & (weight > 0)
    rows, cols = GRID
    points_in = np.bincount(cell[fits], minlength=rows * cols).reshape(rows, cols) >= 2
    wide = points_in.any(0).sum() >= 0.7 * cols or points_in.any(1).sum() >= 0.8 * rows
    return model if wide and points_in.sum() >= 0.28 * rows * cols else None


def _scale(m2: Floats, weight: Floats, cell: Floats) -> float:
    """Robust width of the errors of the background, from their weighted 40 % quantile."""
    if weight.sum() <= 0:
        return 1.0
    order = np.argsort(m2, kind="stable")
    cumulated = np.cumsum(weight[order])
    at = int(np.searchsorted(cumulated, 0.4 * cumulated[-1]))
    return float(np.clip(np.sqrt(m2[order[min(at, len(m2) - 1)]]) / 1.1, 1.0, 6.0))
