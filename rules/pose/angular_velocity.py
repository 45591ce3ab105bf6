"""Angular velocity of an object, from the orientations of its views.

Within a window the object rotates at one rate: R(t) = turned(w * (t - m)) R(m). Rate w and orientation R(m)
are fitted together by least squares (Gauss-Newton on rotations, `angular_velocity_fit.py`). Where the
orientations jump (to that of a symmetric object's twin), both sides have their own R(m) and share w, which is
the same for twins.
 The rate may change by an impact. The alternative to one rate is two, before and after a change at a fitted
time, with continuous orientation, so that earlier measurements constrain later ones. The change is accepted
when the two rates differ by more than their uncertainty, and older data are then dropped.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from visup.agent import Spin
from visup.rules.pose.angular_velocity_fit import (
    FitSettings,
    OrientationSeries,
    SpinFit,
    first_rate,
    long_pieces,
    thinned,
)
from visup.rules.pose.rotations import Floats


@dataclass(frozen=True, slots=True)
class SpinSettings(FitSettings):
    """Settings of the spin measurement; the rest as in `FitSettings`.

    Attributes:
        window_s: Longest window over which a rate is fitted.
        recent_s: Window for a first guess of the current rate.
        changes_s: A change of rate is searched for about this many seconds ago.
        change: A change is accepted from this squared difference of rates, in variances, ...
        gain: ... if each further parameter saves the cost of this many residuals.
        unchanged: It is dropped below this squared difference.
        doubt: A rate is uncertain if the rate of the last seconds differs by this, squared, in variances.
        kept_s: Length of the window retained before a change.
        least: Fewest orientations in a window.
        known_deg_s: A rate is reported when its standard deviation is below this ...
        known_share: ... or below this share of the rate.
    """

    window_s: float = 40.0
    recent_s: float = 4.0
    changes_s: tuple[float, ...] = (3.0, 6.0, 10.0, 15.0, 22.0)
    change: float = 8.0
    unchanged: float = 2.0
    gain: float = 4.0
    doubt: float = 12.0
    kept_s: float = 5.0
    least: int = 8
    known_deg_s: float = 1.0
    known_share: float = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class AngularVelocity:
    """A fitted rate.

    Attributes:
        vector: (3,) rotation vector per second, camera frame, radians.
        covariance: (3, 3) covariance of `vector`.
        scatter: Share of its trace that is due to scatter, which lengthens `vector`.
        since: Seconds since when the object rotates at this rate, as far as known.
        before: (3,) the rate before a change at `since`, or None without one.
    """

    vector: Floats
    covariance: Floats
    scatter: float
    since: float
    before: Floats | None = None

    @property
    def sigma(self) -> float:
        """Standard deviation of a component of `vector`, the mean of the three."""
        return float(np.sqrt(np.trace(self.covariance) / 3))


def estimate_angular_velocity(
    turns: OrientationSeries, now: float, before: AngularVelocity | None, settings: SpinSettings
) -> AngularVelocity | None:
    """The current rate of rotation of an object.

    Args:
        turns: Its orientations up to now.
        now: Seconds.
        before: The last measured rate, or None.
        settings: Settings.

    Returns:
        The rate, or None while there are too few orientations.
    """
    begin = now - settings.window_s
    if before is not None:
        begin = max(begin, before.since - settings.kept_s)
    turns = turns.since(begin - 1e-6)
    recent = _steady_fit(turns.since(now - settings.recent_s), None, settings)
    recent = recent or _steady_fit(turns, None, settings)
    if recent is None:
        return None
    known = _refitted_change(turns, before, settings) if before is not None else None
    even = turns if known is None else turns.since(known.since)
    steady = _steady_fit(even, recent.rates[0] if before is None else before.vector, settings)
    if steady is None:
        return _angular_velocity_of(known or recent, settings)
    changed = _change_fit(steady, even, now, recent.rates[0], settings)
    return _inflated(_angular_velocity_of(changed or known or steady, settings), recent, settings)


def _inflated(rate: AngularVelocity, recent: SpinFit, settings: SpinSettings) -> AngularVelocity:
    """The rate with its covariance inflated if the last seconds alone disagree: it may be changing."""
    recent_rate = _angular_velocity_of(recent, settings)
    apart = recent_rate.vector - rate.vector
    both = recent_rate.covariance + rate.covariance
    if apart @ np.linalg.solve(both, apart) < settings.doubt:
        return rate
    return replace(rate, covariance=rate.covariance + np.outer(apart, apart) / 4)


def _refitted_change(
    turns: OrientationSeries, before: AngularVelocity, settings: SpinSettings
) -> SpinFit | None:
    """A refit with the previously found change, or None when there is none any more."""
    if before.before is None or len(turns.times) < 2 * settings.least:
        return None
    if not turns.times[0] + 0.5 < before.since < turns.times[-1] - 0.5:
        return None
    pieces = long_pieces(turns, before.vector, settings)
    if (pieces >= 0).sum() < 2 * settings.least:
        return None
    rates = np.stack([before.before, before.vector])
    fit = SpinFit(*thinned(turns, pieces, settings), rates, before.since, settings)
    return fit if fit.run(settings.steps) and fit.contrast() > settings.unchanged else None


def spin_of(rate: AngularVelocity, settings: SpinSettings) -> Spin | None:
    """A rate as a record of the mind, or None if it is too uncertain to report."""
    length = float(np.linalg.norm(rate.vector))
    axis = rate.vector / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])
    # Scatter biases the length of the vector upwards.
    excess = rate.scatter * float(np.trace(rate.covariance))
    degrees = float(np.degrees(np.sqrt(max(0.0, length**2 - excess))))
    along = float(axis @ rate.covariance @ axis)
    sigma = float(np.degrees(np.sqrt(max(along, rate.sigma**2 if length**2 < excess else along))))
    if sigma > max(settings.known_deg_s, settings.known_share * degrees):
        return None
    x, y, z = axis.tolist()
    return Spin(degrees, sigma, (x, y, z))


def _steady_fit(
    turns: OrientationSeries, start: Floats | None, settings: SpinSettings
) -> SpinFit | None:
    """One rate for the whole window, or None when too few orientations are consistent."""
    if len(turns.times) < settings.least:
        return None
    guess = start if start is not None else first_rate(turns, settings)
    pieces = long_pieces(turns, guess, settings)
    if (pieces >= 0).sum() < settings.least:
        return None
    fit = SpinFit(*thinned(turns, pieces, settings), np.stack([guess]), None, settings)
    steps = settings.steps if start is not None else 2 * settings.steps + 1
    return fit if fit.run(steps) else None


def _change_fit(
    steady: SpinFit, turns: OrientationSeries, now: float, after: Floats, settings: SpinSettings
) -> SpinFit | None:
    """The best fit of two rates with a change between them, or None without a credible one."""
    before = steady.rates[0]
    pieces = long_pieces(turns, before, settings)
    if (pieces >= 0).sum() < 2 * settings.least:
        return None
    turns, pieces = thinned(turns, pieces, settings)
    times = [now - ago for ago in settings.changes_s]
    inside = [t for t in times if turns.times[0] + 1.0 < t < turns.times[-1] - 1.0]
    # One step is taken from each candidate: the predicted gain of a step alone is often wrong.
    tried = [SpinFit(turns, pieces, np.stack([before, before]), t, settings) for t in inside]
    tried = [fit for fit in tried if fit.run(1)]
    if not tried or min(fit.cost for fit in tried) > steady.cost:
        return None
    change = min(tried, key=lambda fit: fit.cost).since
    fit = SpinFit(turns, pieces, np.stack([before, after]), change, settings)
    believed = fit.run(2 * settings.steps) and fit.contrast() > settings.change
    return fit if believed and _gain(steady, fit) > settings.gain else None


def _gain(steady: SpinFit, changed: SpinFit) -> float:
    """Gain of two rates over one: cost saved per further parameter, in costs of a residual."""
    return (steady.cost - changed.cost) / 4 / max(changed.cost / changed.residuals, 1e-12)


def _angular_velocity_of(fit: SpinFit, settings: SpinSettings) -> AngularVelocity:
    covariance, span = fit.covariance(-1), max(fit.span, 1e-6)
    # Even while the view is unchanged, the object may have rotated part of the way to the next.
    unseen = (np.radians(settings.view_deg) / span) ** 2
    stuck = settings.view_share * float(np.linalg.norm(fit.rates[-1]))
    unseen += min(stuck, np.radians(settings.view_most_deg) / span) ** 2
    scatter = float(np.trace(covariance))
    share = scatter / (scatter + 3 * unseen)
    before = fit.rates[0] if fit.change is not None else None
    return AngularVelocity(fit.rates[-1], covariance + np.eye(3) * unseen, share, fit.since, before)
