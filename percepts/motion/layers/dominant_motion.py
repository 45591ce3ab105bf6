"""The dominant motion: that of the widest part of the image, by random sampling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.motion_constraints import Constraints, mahalanobis
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers._dominant_motion_jit import (
    explained_weights,
    grid_cells,
    sample_fits,
)
from visup.percepts.motion.layers.affine import Affine, Doubles, fit_affine, widened

BALANCE_GRID = (6, 8)
FAR = 12.0  # squared Mahalanobis distance from which a motion does not explain a constraint at all


def balanced_weights(
    xy: Floats, shape: tuple[int, int], keep: Floats
) -> tuple[Floats, NDArray[np.int64]]:
    """Weights that give each part of the image the same total, however many points it has.

    Args:
        xy: (N, 2) positions.
        shape: (h, w) of the image.
        keep: (N,) initial weight of each point, 0 to 1.

    Returns:
        (N,) float32 weights that sum to 1 in each occupied cell; (N,) int64 cell numbers.
    """
    cell = grid_cells(xy, shape, BALANCE_GRID)
    total = np.bincount(cell, weights=keep, minlength=BALANCE_GRID[0] * BALANCE_GRID[1])
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
    part = _UsableConstraints(
        c.xy[usable], c.moved[usable], widened(c.information[usable], slack), weight[usable]
    )
    best, best_score = guesses[0], 1.03 * part.scores(guesses[:1])[0] + 1e-6
    for guess, score in zip(guesses[1:], part.scores(guesses[1:]), strict=True):
        if score > best_score:
            best, best_score = guess, score
    if best_score < 0.8 * part.weight.sum():
        pick = usable[_draw_samples(rng, part.weight)]
        samples = sample_fits(c.xy, c.moved, c.information, pick)
        scores = part.affine_scores(samples)
        first = int(scores.argmax())
        if scores[first] > best_score:
            best = Affine(samples[first])
    # Hardly regularised: zoom and rotation of the camera must not be damped.
    return fit_affine(c, weight * 20, best, rigidity=0.02, rounds=5, slack=slack, cutoff=2.5)


@dataclass(frozen=True, slots=True, eq=False)
class _UsableConstraints:
    """The constraints to fit: (N, 2), (N, 2), (N, 3), (N,)."""

    xy: Floats
    moved: Floats
    info: Floats
    weight: Floats

    def scores(self, models: Sequence[Affine]) -> Floats:
        """Total weight that each of M motions explains, (M,) float32."""
        if any(m.bend is not None for m in models):
            each = [mahalanobis(m.at(self.xy) - self.moved, self.info) for m in models]
            return np.asarray(np.maximum(0, 1 - np.stack(each) / FAR) @ self.weight)
        return self.affine_scores(np.array([m.matrix for m in models]).reshape(-1, 2, 3))

    def affine_scores(self, matrices: Doubles) -> Floats:
        """The same of (M, 2, 3) affine motions."""
        by_coefficient = np.ascontiguousarray(matrices.transpose(1, 2, 0), dtype=np.float32)
        return explained_weights(self.xy, self.moved, self.info, self.weight, by_coefficient, FAR)


def _draw_samples(rng: np.random.Generator, weight: Floats, samples: int = 40) -> NDArray[np.int64]:
    """Random samples of four, by weight, (samples, 4). Repeated points are harmless."""
    heap = np.cumsum(weight, dtype=np.float64)
    at = np.searchsorted(heap, rng.random((samples, 4)) * heap[-1], side="right")
    return np.asarray(np.minimum(at, len(weight) - 1))
