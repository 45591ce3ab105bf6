"""The motion of a layer per second, as measured over one baseline."""

from __future__ import annotations

from dataclasses import dataclass
from math import dist

import numpy as np

from visup.percepts.motion.layers.affine import Doubles


@dataclass(frozen=True, slots=True, eq=False)
class AffineRate:
    """A layer's motion per second as measured over one baseline.

    Attributes:
        matrix: (2, 3) float64, pixels per second, affine in position.
        sigma: Standard deviation, pixels per second.
        time: When it was measured, seconds.
        span_s: Baseline, seconds.
        bend: Quadratic part, as in `Affine`, per second, or None.
    """

    matrix: Doubles
    sigma: float
    time: float
    span_s: float
    bend: Doubles | None = None

    def velocity(self, where: tuple[float, float]) -> Doubles:
        """(vx, vy) at a position, pixels per second."""
        return np.array(self.shift(where))

    def shift(self, where: tuple[float, float]) -> tuple[float, float]:
        """As `velocity`, without arrays."""
        x, y = where
        (a, b, c), (d, e, f) = self.matrix.tolist()
        return a * x + b * y + c, d * x + e * y + f

    def gap(self, other: AffineRate, where: tuple[float, float]) -> float:
        """How much it differs from another motion at a position, pixels per second."""
        return dist(self.shift(where), other.shift(where))
