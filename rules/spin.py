"""How fast an object turns, from the orientations that its views tell.

Over a window of time the object turns at one rate: R(t) = turned(w * (t - m)) R(m). Rate w and
orientation R(m) are fitted together by least squares (Gauss-Newton on rotations), each orientation
weighted by how well its direction and its turn in the plane are known, those that do not fit
discounted (weights of Geman and McClure). Where the orientations jump (to that of a symmetric
object's twin), both sides have an R(m) of their own and share w, which is the same for twins.

The views of a model are discrete, so that errors last as long as a view does: the covariance of w is
computed for errors that are correlated over time (Newey and West, 1987), and never less than half
a step between views over the window allows.

Windows: the shortest first, then each twice as long as the one before, as long as its rate agrees with that
of the shorter ones (Lepski's rule): an object that turns evenly is measured over a long time, one
that was hit a moment ago only since then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent import Spin
from visup.rules.turns import Floats, right_jacobian, rotation_vectors, turned


@dataclass(frozen=True, slots=True)
class SpinSettings:
    """How spin is measured.

    Attributes:
        windows_s: Lengths of the windows, rising.
        least: Orientations that a window needs.
        most: Orientations that are used of a window; of more, means over even stretches.
        swing_deg: Standard deviation of directions.
        roll_deg: Standard deviation of turns in the plane.
        robust: Residuals beyond so many standard deviations count little.
        jump_deg: A turn by more than this between two orientations begins a new piece.
        most_pieces: Pieces that are used; the longest.
        steps: Gauss-Newton steps from a start that is near, and twice as many and one from no start.
        view_deg: What the discreteness of views leaves unknown of the turn over a window.
        agree: Rates agree when they differ by fewer standard deviations than this.
        known_deg_s: A rate is told when its standard deviation is below this ...
        known_share: ... or below this share of the rate.
        fastest_deg_s: Greatest rate that is looked for.
    """

    windows_s: tuple[float, ...] = (3.0, 6.0, 12.0, 24.0)
    least: int = 8
    most: int = 64
    swing_deg: float = 6.0
    roll_deg: float = 5.0
    robust: float = 2.5
    jump_deg: float = 50.0
    most_pieces: int = 4
    steps: int = 2
    view_deg: float = 3.5
    agree: float = 2.0
    known_deg_s: float = 1.0
    known_share: float = 0.3
    fastest_deg_s: float = 120.0


@dataclass(frozen=True, slots=True, eq=False)
class Rate:
    """A fitted rate.

    Attributes:
        vector: (3,) rotation vector per second, camera frame, radians.
        covariance: (3, 3) of `vector`.
        scatter: Share of its trace that is due to scatter, which makes `vector` longer than it is.
        window: Seconds over which it was fitted.
    """

    vector: Floats
    covariance: Floats
    scatter: float
    window: float

    @property
    def sigma(self) -> float:
        """Standard deviation of a component of `vector`, the mean of the three."""
        return float(np.sqrt(np.trace(self.covariance) / 3))


@dataclass(frozen=True, slots=True, eq=False)
class Turns:
    """Orientations over time.

    Attributes:
        times: (N,) seconds, rising.
        orientations: (N, 3, 3) model to camera.
    """

    times: Floats
    orientations: Floats

    def since(self, time: float) -> Turns:
        """Those from a time on."""
        first = int(np.searchsorted(self.times, time))
        return Turns(self.times[first:], self.orientations[first:])


def measured_rate(turns: Turns, now: float, settings: SpinSettings) -> Rate | None:
    """The rate at which an object turns now.

    Args:
        turns: Its orientations up to now.
        now: Seconds.
        settings: How it is measured.

    Returns:
        The rate over the longest window that agrees with the shorter ones, or None while there are
        too few orientations.
    """
    agreed: list[Rate] = []
    for span in settings.windows_s:
        inside = turns.since(now - span - 1e-6)
        if len(inside.times) < settings.least:
            continue
        if agreed and inside.times[-1] - inside.times[0] < 1.2 * agreed[-1].window:
            break
        rate = fitted_rate(inside, agreed[-1].vector if agreed else None, settings)
        if rate is None:
            continue
        if not all(_agree(rate, shorter, settings) for shorter in agreed):
            break
        agreed.append(rate)
    return min(agreed, key=lambda r: r.sigma) if agreed else None


def spin_of(rate: Rate, settings: SpinSettings) -> Spin | None:
    """A rate in the words of the mind, or None when it is too uncertain to be told."""
    length = float(np.linalg.norm(rate.vector))
    axis = rate.vector / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])
    # The length of a scattered vector is too great.
    excess = rate.scatter * float(np.trace(rate.covariance))
    degrees = float(np.degrees(np.sqrt(max(0.0, length**2 - excess))))
    along = float(axis @ rate.covariance @ axis)
    sigma = float(np.degrees(np.sqrt(max(along, rate.sigma**2 if length**2 < excess else along))))
    if sigma > max(settings.known_deg_s, settings.known_share * degrees):
        return None
    x, y, z = axis.tolist()
    return Spin(degrees, sigma, (x, y, z))


def fitted_rate(turns: Turns, start: Floats | None, settings: SpinSettings) -> Rate | None:
    """One rate for all of a window; see the head of this file.

    Args:
        turns: At least two orientations.
        start: A rate near by, radians per second, or None when none is known.
        settings: How it is fitted.

    Returns:
        The rate, or None when too few orientations hang together.
    """
    given = start is not None
    rate = start if start is not None else _first_rate(turns, settings)
    pieces = _pieces(turns, rate, settings)
    if (pieces >= 0).sum() < settings.least:
        return None
    turns, pieces = _thinned(turns, pieces, rate, settings)
    fit = _Fit(turns, pieces, rate, settings)
    for _ in range(settings.steps if given else 2 * settings.steps + 1):
        if not fit.step():
            return None
    return fit.result()


def _first_rate(turns: Turns, settings: SpinSettings) -> Floats:
    """A first guess: the median over pairs some time apart."""
    t, r = turns.times, turns.orientations
    found = []
    for lag in (0.3, 0.8):
        later = np.searchsorted(t, t + lag)
        first = np.flatnonzero(later < len(t))
        if not len(first):
            continue
        later = later[first]
        turn = rotation_vectors(r[later] @ np.swapaxes(r[first], 1, 2))
        small = (turn**2).sum(axis=1) < np.radians(settings.jump_deg) ** 2
        if small.sum() >= 3:
            found.append(np.median((turn / (t[later] - t[first])[:, None])[small], axis=0))
    return np.asarray(found[-1]) if found else np.zeros(3)


def _pieces(turns: Turns, rate: Floats, settings: SpinSettings) -> NDArray[np.intp]:
    """Number of the piece to which each orientation belongs, or -1 when it is too short."""
    t, r = turns.times, turns.orientations
    ahead = turned(rate * np.diff(t)[:, None]) @ r[:-1]
    turn = rotation_vectors(r[1:] @ np.swapaxes(ahead, 1, 2))
    jumps = (turn**2).sum(axis=1) > np.radians(settings.jump_deg) ** 2
    piece = np.concatenate([[0], np.cumsum(jumps)])
    sizes = np.bincount(piece)
    longest = np.argsort(-sizes, kind="stable")[: settings.most_pieces]
    number = np.full(len(sizes), -1, np.intp)
    kept = longest[sizes[longest] >= 4]
    number[kept] = np.arange(len(kept))
    return number[piece]


def _thinned(
    turns: Turns, pieces: NDArray[np.intp], rate: Floats, settings: SpinSettings
) -> tuple[Turns, NDArray[np.intp]]:
    """No more than `most` of the orientations that belong to a piece, evenly spread."""
    used = np.flatnonzero(pieces >= 0)
    if len(used) > settings.most:
        used = used[np.linspace(0, len(used) - 1, settings.most).round().astype(np.intp)]
    return Turns(turns.times[used], turns.orientations[used]), pieces[used]


class _Fit:
    """The least squares of one window."""

    def __init__(
        self, turns: Turns, pieces: NDArray[np.intp], rate: Floats, settings: SpinSettings
    ) -> None:
        self._s, self._turns, self._pieces, self._rate = settings, turns, pieces, rate
        count = int(pieces.max()) + 1
        belongs = pieces[None] == np.arange(count)[:, None]
        middle = belongs @ turns.times / belongs.sum(axis=1)
        self._lever = turns.times - middle[pieces]
        nearest = [int(np.abs(np.where(b, self._lever, np.inf)).argmin()) for b in belongs]
        self._middle = turned(-rate * self._lever[nearest][:, None]) @ turns.orientations[nearest]
        spread = np.radians([settings.swing_deg, settings.swing_deg, settings.roll_deg])
        self._scale = (1 / spread)[:, None]

    def _equations(self) -> tuple[Floats, Floats, Floats]:
        """Residuals (N, 3) in standard deviations, their derivatives (N, 3, P), and weights (N,)."""
        turn = self._rate * self._lever[:, None]
        there = turned(turn)
        before = np.swapaxes(self._middle[self._pieces], 1, 2)
        off = rotation_vectors(np.swapaxes(there, 1, 2) @ self._turns.orientations @ before)
        white = self._scale * there
        residual = (white @ off[..., None])[..., 0]
        slopes = white @ (right_jacobian(turn) * self._lever[:, None, None])
        ends = np.zeros((len(turn), 3, len(self._middle), 3))
        ends[np.arange(len(turn)), :, self._pieces] = white
        derivatives = np.concatenate([slopes, ends.reshape(len(turn), 3, -1)], axis=2)
        square = (residual**2).sum(axis=1) / 3
        return residual, derivatives, 1 / (1 + square / self._s.robust**2) ** 2

    def _solved(self) -> tuple[Floats, Floats, Floats]:
        """The change (P,) that fits best, the scores (N, P), the inverse normal matrix."""
        residual, derivatives, weight = self._equations()
        scores = ((weight[:, None] * residual)[:, None] @ derivatives)[:, 0]
        flat = derivatives.reshape(-1, derivatives.shape[2])
        normal = (flat * np.repeat(weight, 3)[:, None]).T @ flat
        inverse = np.linalg.pinv(normal, hermitian=True)
        return inverse @ scores.sum(axis=0), scores, inverse

    def step(self) -> bool:
        """One step of Gauss-Newton; false when the rate runs away."""
        change, _, _ = self._solved()
        self._rate = self._rate + change[:3]
        self._middle = turned(change[3:].reshape(-1, 3)) @ self._middle
        return bool(np.linalg.norm(self._rate) < np.radians(self._s.fastest_deg_s))

    def result(self) -> Rate:
        """The rate with its covariance."""
        _, scores, inverse = self._solved()
        covariance = (inverse @ _long_run(scores) @ inverse)[:3, :3]
        t = self._turns.times
        window = float(t[-1] - t[0])
        # However still the views stand, the object may have turned a part of the way to the next.
        unseen = np.radians(self._s.view_deg) / max(window, 1e-6)
        scatter = float(np.trace(covariance))
        return Rate(
            self._rate,
            covariance + np.eye(3) * unseen**2,
            scatter / (scatter + 3 * unseen**2),
            window,
        )


def _long_run(scores: Floats) -> Floats:
    """Covariance of the sum of scores (N, P) that are correlated over time (Newey and West)."""
    count = len(scores)
    reach = max(1, count // 5)
    total = scores.T @ scores
    for lag in range(1, reach + 1):
        both = scores[lag:].T @ scores[:-lag]
        total += (1 - lag / (reach + 1)) * (both + both.T)
    return np.asarray(total) * count / max(1, count - scores.shape[1])


def _agree(a: Rate, b: Rate, settings: SpinSettings) -> bool:
    """Whether two rates are the same as far as is known."""
    apart = a.vector - b.vector
    both = a.covariance + b.covariance
    return bool(apart @ np.linalg.solve(both, apart) < 3 * settings.agree**2)
