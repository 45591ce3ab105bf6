"""The background: the few image-wide or camera-fixed motions that are no object."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import dist, hypot

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.motion_constraints import Constraints
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers._affine_jit import median
from visup.percepts.motion.layers._dominant_motion_jit import grid_cells
from visup.percepts.motion.layers.affine import STILL, Affine, distances, fit_bent, log_likelihood
from visup.percepts.motion.layers.dominant_motion import (
    BALANCE_GRID,
    balanced_weights,
    fit_dominant,
)


def background_slack(model: Affine, c: Constraints) -> float:
    """Error to allow for a background motion, pixels: a wide scene is not quite a plane."""
    if not len(c):
        return 0.1
    # Every fourth is enough for the median.
    return 0.1 + 0.03 * median(np.hypot(*model.at(c.xy[::4]).T))


@dataclass(frozen=True, slots=True, eq=False)
class PrevalenceMap:
    """Which of two background motions prevails where (a planet above, a sill below).

    Without it, an arm that pauses before a drifting planet would be taken for something fixed.

    Attributes:
        votes: (2, rows, cols) float32, how often each motion was seen in each part of the image.
        shape: (h, w) of the image.
    """

    votes: Floats
    shape: tuple[int, int]

    def log_prior(self, xy: Floats, models: int) -> Floats:
        """(models, N) float32, at most 0; 0 where nothing is known."""
        if models != 2:
            return np.zeros((models, len(xy)), dtype=np.float32)
        smooth = np.stack([cv2.GaussianBlur(v, (5, 5), 1.0) for v in self.votes]) + 0.5
        chance = smooth / smooth.max(axis=0)
        row, col = self._place(xy)
        return np.asarray(np.log(np.maximum(chance, 0.02))[:, row, col], dtype=np.float32)

    def with_votes(
        self, c: Constraints, outside: Floats, models: tuple[Affine, ...]
    ) -> PrevalenceMap:
        """The map updated by more constraints of the background."""
        if len(models) != 2:
            return self
        fit = np.stack([distances(m, c, 0.1) for m in models])
        row, col = self._place(c.xy)
        votes = self.votes * 0.95
        for i in range(2):
            sure = (outside > 0.5) & (fit[i] < 6) & (fit[1 - i] > fit[i] + 9)
            np.add.at(votes[i], (row[sure], col[sure]), 1.0)
        return PrevalenceMap(votes, self.shape)

    def _place(self, xy: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        rows, cols = self.votes.shape[1:]
        row = np.clip(xy[:, 1] * rows / self.shape[0], 0, rows - 1).astype(np.int64)
        col = np.clip(xy[:, 0] * cols / self.shape[1], 0, cols - 1).astype(np.int64)
        return row, col


def empty_prevalence(shape: tuple[int, int]) -> PrevalenceMap:
    """A map without votes."""
    return PrevalenceMap(np.zeros((2, 12, 16), dtype=np.float32), shape)


@dataclass(frozen=True, slots=True, eq=False)
class BackgroundMotion:
    """The motions of the background over one baseline.

    Attributes:
        models: The motions; the camera's last.
        scale: How much wider than expected its errors are (parallax, a bent scene), at least 1.
        fixed: Whether something is fixed to the camera while the rest moves; None when
            the baseline is too short to tell.
        prevalence: Which motion prevails where.
        sure: Whether the camera's motion was measured across the view, not only predicted.
    """

    models: tuple[Affine, ...]
    scale: float
    fixed: bool | None
    prevalence: PrevalenceMap
    sure: bool
    _known: list[tuple[Constraints, Floats]] = field(default_factory=list, repr=False)

    def distances(self, c: Constraints) -> Floats:
        """Squared distance of each constraint to the likeliest background motion, (N,) float32.

        Cached, since every track asks for it with the same constraints.
        """
        if not self._known or self._known[0][0] is not c:
            self._known[:] = [(c, self._distances(c))]
        return self._known[0][1]

    def _distances(self, c: Constraints) -> Floats:
        prior = self.prevalence.log_prior(c.xy, len(self.models))
        each = [distances(m, c, background_slack(m, c)) / self.scale**2 for m in self.models]
        return np.asarray(np.min(np.stack(each) - 2 * prior, axis=0), dtype=np.float32)

    def moves_as(self, model: Affine, where: tuple[float, float]) -> bool:
        """Whether a layer moves as one of the background's motions does at a position."""
        own = model.shift(where)
        gap = min(dist(own, m.shift(where)) for m in self.models)
        return gap < 0.3 + 0.1 * hypot(*own)

    def log_likelihood(self, c: Constraints) -> Floats:
        """Log likelihood of each constraint under the nearest background motion, (N,) float32."""
        extra = 0.15 * (self.scale - 1)
        prior = self.prevalence.log_prior(c.xy, len(self.models))
        each = np.stack([log_likelihood(m, c, background_slack(m, c) + extra) for m in self.models])
        return np.asarray(np.max(each + prior, axis=0), dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class ExpectedBackground:
    """The prediction of the background before a frame.

    Attributes:
        camera: The camera's motion over the baseline, as predicted.
        fixed_too: Whether objects fixed to the camera are background as well.
        prevalence: Which motion prevailed where.
    """

    camera: Affine
    fixed_too: bool
    prevalence: PrevalenceMap


def fit_background(
    c: Constraints,
    outside: Floats,
    shape: tuple[int, int],
    expected: ExpectedBackground,
    seed: int,
) -> BackgroundMotion:
    """Fit the background to the constraints that belong to no object.

    Args:
        c: N constraints over one baseline.
        outside: (N,) float32, how far each point is outside all objects, 0 to 1.
        shape: (h, w) of the image.
        expected: Its prediction.
        seed: For random samples.

    Returns:
        The background.
    """
    weight, cell = balanced_weights(c.xy, shape, outside)
    still, guess = Affine(STILL), expected.camera
    to_still = distances(still, c, 0.1)
    # A large part that does not move in the image is background, whatever else fills the view.
    rests = float(weight[to_still < 9].sum()) > 0.3 * float(weight.sum())
    if expected.fixed_too or rests:
        # The fixed part is fitted first, or a quadratic fit would absorb it.
        moving = _image_wide_motion(c, outside * (to_still > 9), shape, seed)
        camera = moving or _camera_motion(c, outside, weight, (still, guess), shape, seed)
        models = [still, camera or guess]
    else:
        camera = _camera_motion(c, outside, weight, (still, guess), shape, seed)
        models = [camera or guess]
        away = distances(models[0], c, 0.15) > 16
        second = _image_wide_motion(c, outside * away, shape, seed)
        models = models if second is None else [second, models[0]]
    fixed = _is_fixed(c, outside, distances(models[-1], c, 0.15))
    if fixed and len(models) < 2:
        models.insert(0, still)
    rest = np.min([distances(m, c, 0.15) for m in models], axis=0)
    prevalence = expected.prevalence.with_votes(c, outside, tuple(models))
    scale = _scale(rest, weight, cell)
    return BackgroundMotion(tuple(models), scale, fixed, prevalence, camera is not None)


def _is_fixed(c: Constraints, outside: Floats, to_dominant: Floats) -> bool | None:
    if c.span_s < 0.4 or len(c) < 8:
        return None
    tight = (distances(Affine(STILL), c) < 4) & (to_dominant > 16) & (outside > 0.5)
    return bool(np.count_nonzero(tight) >= 8)


def _camera_motion(
    c: Constraints,
    outside: Floats,
    weight: Floats,
    guesses: tuple[Affine, ...],
    shape: tuple[int, int],
    seed: int,
) -> Affine | None:
    """The camera's motion; None when no motion fills enough of the view."""
    model = fit_dominant(c, weight, guesses, seed)
    if not _spans(c, model, outside, shape, 0.15):
        return None
    moved = median(np.hypot(*model.at(c.xy).T))
    return fit_bent(c, weight * 20, model) if moved > 0.5 else model


def _image_wide_motion(
    c: Constraints, weight: Floats, shape: tuple[int, int], seed: int
) -> Affine | None:
    """A motion that spans the image, such as a planet behind; objects are narrower."""
    if np.count_nonzero(weight) < 30:
        return None
    balanced, _ = balanced_weights(c.xy, shape, weight)
    model = fit_dominant(c, balanced, (Affine(STILL),), seed + 1)
    return model if _spans(c, model, weight, shape, 0.28) else None


def _spans(
    c: Constraints, model: Affine, weight: Floats, shape: tuple[int, int], share: float
) -> bool:
    """Whether the constraints that fit a motion reach across the image and fill a share of it."""
    fits = (distances(model, c, 0.15) < 9) & (weight > 0)
    cell = grid_cells(c.xy, shape, BALANCE_GRID)
    rows, cols = BALANCE_GRID
    filled = np.bincount(cell[fits], minlength=rows * cols).reshape(rows, cols) >= 2
    across = filled.any(0).sum() >= 0.7 * cols or filled.any(1).sum() >= 0.8 * rows
    return bool(across and filled.sum() >= share * rows * cols)


def _scale(m2: Floats, weight: Floats, cell: NDArray[np.int64]) -> float:
    """Robust width of the errors of the background, from their weighted 40 % quantile."""
    # A small part of the view does not represent the whole.
    if len(np.unique(cell[weight > 0])) < 0.25 * BALANCE_GRID[0] * BALANCE_GRID[1]:
        return 1.0
    order = np.argsort(m2, kind="stable")
    cumulated = np.cumsum(weight[order])
    at = int(np.searchsorted(cumulated, 0.4 * cumulated[-1]))
    return float(np.clip(np.sqrt(m2[order[min(at, len(m2) - 1)]]) / 1.1, 1.0, 6.0))
