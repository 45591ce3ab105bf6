"""Robust least squares for rates of rotation, with or without a change of rate.

Residuals are rotation vectors in units of their standard deviations (which differ for directions and in-plane
rotation), down-weighted when large (Geman and McClure). The views of a model are discrete, so errors persist
as long as a view: covariances allow for errors correlated over time (Newey and West, 1987).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.rules.pose.rotations import Floats, right_jacobian, rotation_matrices, rotation_vectors

Numbers = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class FitSettings:
    """Settings of the fit.

    Attributes:
        most: Most orientations used of a window, evenly spread.
        swing_deg: Standard deviation of directions.
        roll_deg: Standard deviation of in-plane rotation.
        robust: Residuals beyond this many standard deviations count little.
        jump_deg: A rotation by more than this between two orientations starts a new segment.
        look_back: Number of previous orientations that one may continue.
        most_pieces: Most segments used; the longest.
        steps: Gauss-Newton steps from a nearby start.
        view_deg: Uncertainty of the rotation over a window due to discrete views.
        view_share: Between two views the rotation is over- or underestimated by this share, ...
        view_most_deg: ... over a window by at most this, since the next view corrects it.
        change_sigma_s: Standard deviation of the time of a change about its start value.
        fastest_deg_s: Greatest rate considered.
    """

    most: int = 96
    swing_deg: float = 6.0
    roll_deg: float = 5.0
    robust: float = 2.5
    jump_deg: float = 50.0
    look_back: int = 4
    most_pieces: int = 4
    steps: int = 2
    view_deg: float = 3.5
    view_share: float = 0.3
    view_most_deg: float = 8.0
    change_sigma_s: float = 2.0
    fastest_deg_s: float = 120.0


@dataclass(frozen=True, slots=True, eq=False)
class OrientationSeries:
    """Orientations over time.

    Attributes:
        times: (N,) seconds, ascending.
        orientations: (N, 3, 3) model to camera.
    """

    times: Floats
    orientations: Floats

    def since(self, time: float) -> OrientationSeries:
        """The orientations from a time on."""
        first = int(np.searchsorted(self.times, time))
        return OrientationSeries(self.times[first:], self.orientations[first:])


def first_rate(turns: OrientationSeries, settings: FitSettings) -> Floats:
    """An initial guess: the median over pairs some time apart, (3,) radians per second."""
    t, r = turns.times, turns.orientations
    found = []
    for lag in (0.3, 0.8):
        later = np.searchsorted(t, t + lag)
        first = np.flatnonzero(later < len(t))
        later = later[first]
        turn = rotation_vectors(r[later] @ np.swapaxes(r[first], 1, 2))
        small = (turn**2).sum(axis=1) < np.radians(settings.jump_deg) ** 2
        if small.sum() >= 3:
            found.append(np.median((turn / (t[later] - t[first])[:, None])[small], axis=0))
    return np.asarray(found[-1]) if found else np.zeros(3)


def long_pieces(turns: OrientationSeries, rate: Floats, settings: FitSettings) -> Numbers:
    """Number of the segment of each orientation, or -1 when it is too short.

    An orientation continues the latest of the few before it from which it is no jump, so that a
    momentary error breaks no segment.
    """
    piece = _linked(turns, rate, settings)
    sizes = np.bincount(piece)
    longest = np.argsort(-sizes, kind="stable")[: settings.most_pieces]
    number = np.full(len(sizes), -1, np.intp)
    kept = longest[sizes[longest] >= 4]
    number[kept] = np.arange(len(kept))
    return np.asarray(number[piece], np.intp)


def _linked(turns: OrientationSeries, rate: Floats, settings: FitSettings) -> Numbers:
    t, r = turns.times, turns.orientations
    links = []
    for back in range(1, min(settings.look_back, len(t) - 1) + 1):
        ahead = rotation_matrices(rate * (t[back:] - t[:-back])[:, None]) @ r[:-back]
        turn = rotation_vectors(r[back:] @ np.swapaxes(ahead, 1, 2))
        near = (turn**2).sum(axis=1) < np.radians(settings.jump_deg) ** 2
        links.append([False] * back + near.tolist())
    piece = [0] * len(t)
    count = 1
    for k in range(1, len(t)):
        back = next((b for b, near in enumerate(links, 1) if near[k]), 0)
        piece[k] = piece[k - back] if back else count
        count += not back
    return np.array(piece, np.intp)


def thinned(
    turns: OrientationSeries, pieces: Numbers, settings: FitSettings
) -> tuple[OrientationSeries, Numbers]:
    """At most `most` of the orientations that belong to a segment, evenly spread."""
    used = np.flatnonzero(pieces >= 0)
    if len(used) > settings.most:
        used = used[np.linspace(0, len(used) - 1, settings.most).round().astype(np.intp)]
    # A short segment may have lost all its orientations, so the others are renumbered.
    renumbered = np.unique(pieces[used], return_inverse=True)[1].astype(np.intp)
    return OrientationSeries(turns.times[used], turns.orientations[used]), renumbered


class SpinFit:
    """The least-squares fit of one window.

    Args:
        turns: Orientations, at least one of each segment.
        pieces: (N,) segment of each orientation, from 0.
        rates: (1, 3), or (2, 3) before and after a change; start values, radians per second.
        change: Start value of the time of the change, seconds, or None without one.
        settings: Settings.
    """

    def __init__(
        self,
        turns: OrientationSeries,
        pieces: Numbers,
        rates: Floats,
        change: float | None,
        settings: FitSettings,
    ) -> None:
        self._s, self._turns, self._pieces = settings, turns, pieces
        self.rates, self.change, self._sought = rates, change, change
        self._count = int(pieces.max()) + 1
        self._each = np.arange(len(pieces))
        spread = np.radians([settings.swing_deg, settings.swing_deg, settings.roll_deg])
        self._scale = (1 / spread)[:, None]
        self._anchor()
        near = [self._nearest(k) for k in range(self._count)]
        back = rotation_matrices(-self.rates[self._phase[near]] * self._lever[near][:, None])
        self._middle = back @ turns.orientations[near]
        self.cost = np.inf

    @property
    def residuals(self) -> int:
        """Number of residuals minus number of parameters."""
        parameters = 3 * (len(self.rates) + self._count) + (self.change is not None)
        return max(1, 3 * len(self._pieces) - parameters)

    @property
    def span(self) -> float:
        """Time over which the last rate was fitted, seconds."""
        return float(self._turns.times[-1]) - self.since

    @property
    def since(self) -> float:
        """Start of the last rate, seconds."""
        begin = float(self._turns.times[0])
        return begin if self.change is None else max(begin, self.change)

    def run(self, steps: int) -> bool:
        """Take Gauss-Newton steps; false when the fit diverges."""
        for _ in range(steps):
            change, *_ = self._solved()
            phases = len(self.rates)
            self.rates = self.rates + change[: 3 * phases].reshape(-1, 3)
            ends = change[3 * phases : 3 * (phases + self._count)].reshape(-1, 3)
            self._middle = rotation_matrices(ends) @ self._middle
            if self.change is not None:
                self._move_change(float(change[-1]))
            if np.linalg.norm(self.rates, axis=1).max() > np.radians(self._s.fastest_deg_s):
                return False
        _, self._scores, self._inverse, self.cost = self._solved()
        return True

    def promise(self) -> float:
        """Predicted decrease of cost by one step, with linearised residuals."""
        step, scores, *_ = self._solved()
        return float(step @ scores.sum(axis=0)) / 3

    def covariance(self, phase: int) -> Floats:
        """(3, 3) covariance of the rate before (0) or after (-1) the change."""
        k = 3 * (phase % len(self.rates))
        return np.asarray(self._covariance()[k : k + 3, k : k + 3], np.float64)

    def contrast(self) -> float:
        """Squared difference of the rates before and after the change, in variances."""
        both = self._covariance()[:6, :6]
        across = both[:3, :3] + both[3:, 3:] - both[:3, 3:] - both[3:, :3]
        unseen = np.radians(self._s.view_deg) / max(self.span, 1e-6)
        apart = self.rates[1] - self.rates[0]
        return float(apart @ np.linalg.solve(across + np.eye(3) * unseen**2, apart))

    def _move_change(self, by: float) -> None:
        assert self.change is not None
        t = self._turns.times
        step = min(max(by, -1.5), 1.5)
        old, new = self.change, min(max(self.change + step, t[0] + 0.5), t[-1] - 0.5)
        # Segments that contain the change are anchored at it: their anchor moves along.
        held = self._held
        half = rotation_matrices(self.rates.mean(axis=0) * (new - old))
        self.change = new
        self._anchor()
        same = held & self._held
        self._middle[same] = half @ self._middle[same]

    def _anchor(self) -> None:
        """Update the time of each orientation relative to its segment's anchor."""
        t = self._turns.times
        belongs = self._pieces[None] == np.arange(self._count)[:, None]
        middle = belongs @ t / belongs.sum(axis=1)
        self._phase = np.zeros(len(t), np.intp)
        self._held = np.zeros(self._count, bool)
        if self.change is not None:
            self._phase = (t >= self.change).astype(np.intp)
            after = belongs @ self._phase
            self._held = (after > 0) & (after < belongs.sum(axis=1))
            middle = np.where(self._held, self.change, middle)
        self._lever = t - middle[self._pieces]

    def _nearest(self, piece: int) -> int:
        return int(np.abs(np.where(self._pieces == piece, self._lever, np.inf)).argmin())

    def _equations(self) -> tuple[Floats, Floats, Floats]:
        """Residuals (N, 3) in standard deviations, their derivatives (N, 3, P), squares (N,)."""
        rate = self.rates[self._phase]
        turn = rate * self._lever[:, None]
        there = rotation_matrices(turn)
        before = np.swapaxes(self._middle[self._pieces], 1, 2)
        off = rotation_vectors(np.swapaxes(there, 1, 2) @ self._turns.orientations @ before)
        white = self._scale * there
        residual = (white @ off[..., None])[..., 0]
        phases, count = len(self.rates), len(turn)
        derivatives = np.zeros((count, 3, phases + self._count, 3))
        slopes = white @ (right_jacobian(turn) * self._lever[:, None, None])
        derivatives[self._each, :, self._phase] = slopes
        derivatives[self._each, :, phases + self._pieces] = white
        flat = derivatives.reshape(count, 3, -1)
        if self.change is not None:
            moved = -(white @ (rate * self._held[self._pieces][:, None])[..., None])
            flat = np.concatenate([flat, moved], axis=2)
        return residual, flat, (residual**2).sum(axis=1) / 3

    def _solved(self) -> tuple[Floats, Floats, Floats, float]:
        """The parameter step (P,), the scores (N, P), the inverse normal matrix, the cost."""
        residual, derivatives, square = self._equations()
        soft = 1 + square / self._s.robust**2
        weight = 1 / soft**2
        scores = ((weight[:, None] * residual)[:, None] @ derivatives)[:, 0]
        flat = derivatives.reshape(-1, derivatives.shape[2])
        normal = (flat * np.repeat(weight, 3)[:, None]).T @ flat
        total = scores.sum(axis=0)
        if self.change is not None and self._sought is not None:
            normal[-1, -1] += 1 / self._s.change_sigma_s**2
            total[-1] += (self._sought - self.change) / self._s.change_sigma_s**2
        # Undetermined parameters (such as the time of change of equal rates) stay as they are.
        normal[np.diag_indices_from(normal)] += 1e-9 * np.trace(normal)
        inverse: Floats = np.asarray(np.linalg.inv(normal), np.float64)
        return inverse @ total, scores, inverse, float((square / soft).sum())

    def _covariance(self) -> Floats:
        return np.asarray(self._inverse @ _newey_west(self._scores) @ self._inverse, np.float64)


def _newey_west(scores: Floats) -> Floats:
    """Covariance of the sum of scores (N, P) correlated over time (Newey and West)."""
    count = len(scores)
    reach = max(1, count // 5)
    total = scores.T @ scores
    for lag in range(1, reach + 1):
        both = scores[lag:].T @ scores[:-lag]
        total += (1 - lag / (reach + 1)) * (both + both.T)
    return np.asarray(total * (count / max(1, count - scores.shape[1])), np.float64)
