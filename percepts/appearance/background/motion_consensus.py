"""The motion of the static scene that most of the evidence of tracked points agrees on.

A point on a plain floor can be off by pixels, one on a straight edge only along it. The covariance of a
tracked point is the noise of the image divided by the structure tensor of its window (Förstner and Gülch
1987); a motion is chosen by the likelihood of all points, each of which either follows it or is anywhere
(MLESAC: Torr and Zisserman 2000).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.point_tracking import STILL
from visup.percepts.appearance.models.pose import Bytes, Doubles

NOISE = 8.0
"""Grey levels: noise of the differences that move a tracked point. On 36 rendered clips the median error
along each axis of the structure tensor is 5 to 8 over the root of its eigenvalue, from 0.03 to 0.7 px."""
FLOOR_PX = 0.15  # least standard deviation of a point, pixels
PERSPECTIVE = 0.05
"""Share of its shift by which a point departs from a similarity when the camera turns."""
SEARCHED_PX = 20.0
"""Side of the area in which a point that does not follow the motion is anywhere, pixels."""
MOST_LIKELY = 4.0  # most that a single point can contribute, nats
CLEAR = 0.75  # share of the evidence that makes it needless to look for another motion than rest
LEAST = 3  # fewest points that a motion is fitted to
MOST_ZOOM, PAIRS, ROUNDS = 0.2, 64, 3
"""Most change of scale between two key frames; random pairs of points; rounds of refinement."""


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """A motion, and the part of the evidence that agrees with it.

    Attributes:
        motion: (2, 3) similarity; `STILL` itself for none.
        support: Log-likelihood ratio of the points that follow it against points anywhere, nats.
    """

    motion: Doubles
    support: float


@dataclass(frozen=True, eq=False)
class PointPairs:
    """Points of a key frame and where they are now.

    Attributes:
        key: (N, 2) float64, pixels.
        now: (N, 2) float64, pixels.
        covariance: (N, 2, 2) of `now` by the noise of the image, pixels².
    """

    key: Doubles
    now: Doubles
    covariance: Doubles

    @cached_property
    def information(self) -> Doubles:
        """(N, 2, 2) inverse covariances, also of what a similarity cannot describe, 1 / pixels²."""
        shift = np.square(self.now - self.key).sum(axis=1)
        departs = FLOOR_PX**2 + PERSPECTIVE**2 * shift
        found: Doubles = np.linalg.inv(self.covariance + departs[:, None, None] * np.eye(2))
        return found

    @cached_property
    def at_best(self) -> Doubles:
        """(N,) support by each point if it follows a motion exactly, nats."""
        spread = 0.5 * np.log(np.maximum(np.linalg.det(self.information), 1e-12))
        best: Doubles = np.clip(spread + np.log(SEARCHED_PX**2 / (2 * np.pi)), 0.0, MOST_LIKELY)
        return best

    @property
    def total(self) -> float:
        """Support of a motion that all points follow exactly, nats."""
        return float(self.at_best.sum())

    def support(self, motions: Doubles) -> Doubles:
        """(K, N) support of (K, 2, 3) motions by each point, nats."""
        x, y = (self.now[:, i] - motions[:, i, :2] @ self.key.T - motions[:, i, 2:] for i in (0, 1))
        (xx, xy), (_, yy) = self.information.transpose(1, 2, 0)
        squared = (xx * x + 2.0 * xy * y) * x + yy * y * y
        found: Doubles = np.maximum(self.at_best - 0.5 * squared, 0.0)
        return found

    def refined(self, motion: Doubles) -> Agreement:
        """A similarity fitted to the points that follow a motion, by least squares weighted by information.

        Args:
            motion: (2, 3).
        """
        design, shift = self._design, self.now - self.key
        for _ in range(ROUNDS):
            follows = self.support(motion[None])[0] > 0.0
            if np.count_nonzero(follows) < LEAST:
                break
            columns = design[follows].reshape(-1, 4)
            weighted = (self.information[follows] @ design[follows]).reshape(-1, 4)
            normal, right = weighted.T @ columns, weighted.T @ shift[follows].ravel()
            motion = self._similarity(np.linalg.lstsq(normal, right, rcond=None)[0])
        return Agreement(motion, float(self.support(motion[None]).sum()))

    @cached_property
    def _design(self) -> Doubles:
        """(N, 2, 4): the shift of each point by that of their centre, a change of scale, and a rotation."""
        design = np.zeros((len(self.key), 2, 4))
        design[:, (0, 1), (0, 1)] = 1.0
        design[:, :, 2] = x = self.key - self.key.mean(axis=0)
        design[:, :, 3] = x[:, ::-1] * (-1.0, 1.0)
        return design

    def _similarity(self, parameters: Doubles) -> Doubles:
        """(2, 3) of the four parameters of `_design`."""
        centre, (grown, turn) = self.key.mean(axis=0), parameters[2:]
        linear = np.array([[1.0 + grown, -turn], [turn, 1.0 + grown]])
        return np.column_stack([linear, centre + parameters[:2] - linear @ centre])


def likeliest_motion(pairs: PointPairs, better: float) -> Agreement:
    """The motion with the most support; rest if it is about as good.

    Args:
        pairs: The points.
        better: Factor by which a motion must be better supported than rest.
    """
    rest = rest_of(pairs)
    if len(pairs.key) < LEAST or rest.support > CLEAR * pairs.total:
        return rest
    tried = np.concatenate([_shifts(pairs), _similarities(pairs)])
    moving = pairs.refined(tried[int(pairs.support(tried).sum(axis=1).argmax())])
    return moving if moving.support > better * rest.support else rest


def rest_of(pairs: PointPairs) -> Agreement:
    """Rest, and the evidence for it."""
    return Agreement(STILL, float(pairs.support(STILL[None]).sum()))


def covariance_at(grey: Bytes, points: NDArray[np.float32], window: int) -> Doubles:
    """(N, 2, 2) covariances of points that are tracked from an image, pixels².

    Args:
        grey: (h, w) uint8.
        points: (N, 2) float32, pixels.
        window: Side of the tracked window, pixels.
    """
    reach = window // 2 + 1
    wide = np.pad(grey, reach, mode="edge")
    x, y = np.clip(np.round(points.T).astype(int), 0, np.reshape(grey.shape[::-1], (2, 1)) - 1)
    windows = np.lib.stride_tricks.sliding_window_view(wide, (2 * reach + 1, 2 * reach + 1))
    around = windows[y, x].astype(np.float32)
    dx, dy = _slope(around), _slope(around.swapaxes(1, 2)).swapaxes(1, 2)
    xx, xy, yy = (
        (a * b).sum(axis=(1, 2), dtype=np.float64) for a, b in ((dx, dx), (dx, dy), (dy, dy))
    )
    tensor = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
    tensor += 1e-3 * np.eye(2)
    found: Doubles = NOISE**2 * np.linalg.inv(tensor)
    return found


def _slope(windows: NDArray[np.float32]) -> NDArray[np.float32]:
    """(N, h - 2, w - 2) Scharr derivatives along x of (N, h, w) grey levels, per pixel."""
    smooth = (3.0 * windows[:, :-2] + 10.0 * windows[:, 1:-1] + 3.0 * windows[:, 2:]) / 16.0
    return np.asarray(0.5 * (smooth[:, :, 2:] - smooth[:, :, :-2]), dtype=np.float32)


def _shifts(pairs: PointPairs) -> Doubles:
    """(N, 2, 3): the translation of each point."""
    motions = np.tile(STILL, (len(pairs.key), 1, 1))
    motions[:, :, 2] = pairs.now - pairs.key
    return motions


def _similarities(pairs: PointPairs) -> Doubles:
    """(K, 2, 3): the similarities of random pairs of points, without those that zoom too much."""
    drawn = np.random.default_rng(0).integers(0, len(pairs.key), (PAIRS, 2))
    a, b = drawn[drawn[:, 0] != drawn[:, 1]].T
    key, now = (p[b] @ (1, 1j) - p[a] @ (1, 1j) for p in (pairs.key, pairs.now))
    turn = now / np.where(key == 0, 1.0, key)
    fine = (key != 0) & (np.abs(turn - 1) < MOST_ZOOM)
    turn, at, to = turn[fine], pairs.key[a[fine]], pairs.now[a[fine]]
    linear = np.stack(
        [np.stack([turn.real, -turn.imag], axis=-1), np.stack([turn.imag, turn.real], axis=-1)],
        axis=-2,
    )
    offset = to - np.einsum("kij,kj->ki", linear, at)
    return np.concatenate([linear, offset[:, :, None]], axis=2)
