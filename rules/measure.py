"""Quantities of all objects and pairs: gaps, trends, velocities, measured in one vectorised pass."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief
from visup.rules.distance import signed_gap
from visup.rules.fit import binned, common_motion, slope_noise, slopes_of_spans, theil_sen
from visup.rules.geometry import Floats
from visup.rules.history import History, covered
from visup.rules.judge import JudgeSettings
from visup.rules.outlines import NEAR, outline_gap
from visup.rules.pairs import pairs, square
from visup.rules.parting import parting_speed
from visup.rules.rcc8 import edge_differences


@dataclass(frozen=True, slots=True)
class RelationSettings:
    """Thresholds of the relations.

    Attributes:
        window_s: Length of the window over which lines are fitted.
        samples: Most samples kept in the window.
        bins: Most means of neighbouring samples to which lines are fitted.
        quick_window_s: Length of a shorter window in which a trend must be strong to count; by it
            a turn is seen sooner.
        quick_sigmas: How many standard deviations of its slope that is, and twice `rate_enter`.
        parting_gap: Gap up to which the motion of two bodies tells that they part, image diagonals.
        motion_window_s: Length of the window over which velocities are fitted.
        rate_enter: Trend that must be exceeded to converge or diverge, image diagonals per second.
        rate_exit: Trend below which they end, image diagonals per second.
        sigmas: How many standard deviations of the slope a trend must exceed to enter.
        pending_sigmas: The same while a trend waits to be believed.
        trend_minimum_s: Least duration of a trend before it is believed.
        hold_s: How long the last gap stands for bodies that flicker out of sight.
        depth_rate: Relative depth change that counts, share of the depth per second.
        touch_enter: Outline gap at which bodies touch, image diagonals.
        touch_exit: Outline gap at which they no longer do.
        touch_minimum_s: Least duration of a touch.
        still_speed: Relative speed over the window below which two bodies are at rest to each
            other, image diagonals per second.
        still_half: The same in each half of the window, where the noise is greater.
        misfit: How unevenly an outline may move and still have a velocity, image diagonals/s.
        apart_depth: Share of depth by which touching outlines belong to bodies apart in depth.
        image_only_confidence: Most that a relation judged without depth is believed.
        apart_exit: Share of depth below which touching outlines are no longer apart in depth.
        together_exit: By how much relative motion may exceed its limit before two that move
            together no longer do.
        moving_exit: Share of the speed that moving together asks for at which it still goes on.
        judge: Thresholds of RCC-8, QTC, direction and distance class.
    """

    window_s: float = 1.5
    samples: int = 64
    bins: int = 16
    quick_window_s: float = 0.7
    quick_sigmas: float = 4.0
    parting_gap: float = 0.02
    motion_window_s: float = 1.25
    rate_enter: float = 0.002
    rate_exit: float = 0.001
    sigmas: float = 3.0
    pending_sigmas: float = 2.0
    trend_minimum_s: float = 0.3
    hold_s: float = 0.3
    depth_rate: float = 0.02
    touch_enter: float = 0.0035
    touch_exit: float = 0.006
    touch_minimum_s: float = 0.2
    still_speed: float = 0.0025
    still_half: float = 0.0045
    misfit: float = 0.0075
    apart_depth: float = 0.25
    image_only_confidence: float = 0.8
    apart_exit: float = 0.2
    together_exit: float = 1.5
    moving_exit: float = 0.7
    judge: JudgeSettings = field(
        default_factory=lambda: JudgeSettings(speed_enter=0.002, speed_exit=0.001)
    )


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Quantities of the last step; what rules compare. NaN is unknown.

    Attributes:
        ids: (M,) object ids, increasing.
        gap: (M, M) distance of the outlines, pixels.
        rate: (M, M) trend of the distance, pixels per second, negative when closing.
        rate_sigma: (M, M) its standard deviation.
        relative_speed: (M, M) pixels per second.
        speed: (M,) pixels per second in the image.
        early: (M, 2) velocity in the first half of the window, pixels per second.
        late: (M, 2) velocity in the second half.
        depth: (M,) in the objects' units.
        velocity: (M, 2) pixels per second in the image.
        velocity_sigma: (M,) standard deviation of a component that noise of the outlines makes.
        time_to_contact: (M, M) seconds until the outlines meet if they go on so; 0 where they meet,
            infinite where they do not close in.
        noise_px: Standard deviation of an outline, pixels.
    """

    ids: tuple[int, ...] = ()
    gap: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    rate: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    rate_sigma: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    relative_speed: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    speed: Floats = field(default_factory=lambda: np.zeros(0))
    early: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    late: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    depth: Floats = field(default_factory=lambda: np.zeros(0))
    velocity: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    velocity_sigma: Floats = field(default_factory=lambda: np.zeros(0))
    time_to_contact: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    noise_px: float = 0.0

    def pair(self, quantity: str, a: int, b: int) -> float:
        """One quantity of one pair ('gap', 'rate', 'time_to_contact', ...), NaN when unknown."""
        if a not in self.ids or b not in self.ids:
            return float("nan")
        table: Floats = getattr(self, quantity)
        return float(table[self.ids.index(a), self.ids.index(b)])

    def one(self, quantity: str, a: int) -> float:
        """One quantity of one object ('speed', 'depth'), NaN when unknown."""
        if a not in self.ids:
            return float("nan")
        return float(getattr(self, quantity)[self.ids.index(a)])

    def interval(self, quantity: str, a: int, b: int, sigmas: float = 2.0) -> tuple[float, float]:
        """Where one quantity of one pair lies in view of its noise.

        Args:
            quantity: 'gap', 'rate', 'relative_speed' or 'time_to_contact'.
            a: An object.
            b: Another.
            sigmas: How many standard deviations to either side.

        Returns:
            (low, high) in the quantity's unit; both NaN when unknown. A time to contact lies
            between those of the highest and the lowest closing speed.
        """
        value = self.pair(quantity, a, b)
        if quantity == "time_to_contact":
            gap, rate = self.interval("gap", a, b, sigmas), self.interval("rate", a, b, sigmas)
            if value == 0.0 or np.isnan(value):
                return value, value
            return tuple(sorted(contact_time(np.array(gap), np.array(rate)).tolist()))
        wide = sigmas * self._sigma(quantity, a, b)
        low = value - wide
        return (low if quantity == "rate" else max(0.0, low)) if low == low else low, value + wide

    def _sigma(self, quantity: str, a: int, b: int) -> float:
        if quantity == "rate":
            return self.pair("rate_sigma", a, b)
        if quantity == "relative_speed":
            return float(np.hypot(self.one("velocity_sigma", a), self.one("velocity_sigma", b)))
        return self.noise_px * float(np.sqrt(2.0))


def contact_time(gap: Floats, rate: Floats) -> Floats:
    """Seconds until gaps are closed at these rates; see `Measured.time_to_contact`."""
    closing = np.full(gap.shape, np.inf)
    np.divide(gap, -rate, out=closing, where=rate < 0.0)
    closing[gap <= 0.0] = 0.0
    closing[(gap != gap) | (rate != rate)] = np.nan  # NaN is not equal to itself
    return closing


def scale(frame_size: tuple[int, int]) -> float:
    """Image diagonal, pixels; what thresholds are relative to."""
    return hypot(*frame_size)


@dataclass(frozen=True, slots=True)
class Measuring:
    """Turns samples into quantities."""

    settings: RelationSettings

    def __call__(
        self, h: History, objects: tuple[ObjectBelief, ...], mind: Mind, before: Measured
    ) -> Measured:
        """Measure one step.

        Args:
            h: Samples up to now.
            objects: The objects of the samples.
            mind: The mind.
            before: What was measured in the step before.

        Returns:
            All quantities; NaN where unknown.
        """
        m = len(objects)
        slope, sigma = np.full((m, m), np.nan), np.full((m, m), np.nan)
        i, j = pairs(m)
        if covered(h, self.settings.window_s) and len(i):
            slope[i, j], sigma[i, j] = self._trend(h.times, h.separation[:, i, j], mind)
            slope[j, i], sigma[j, i] = slope[i, j], sigma[i, j]
        gaps = self._gaps(objects, h, mind, before)
        if len(i):
            slope, sigma = self._parting(slope, sigma, gaps, objects, h, mind)
        stale = np.array([mind.time - b.last_seen > 0.5 * self.settings.window_s for b in objects])
        if stale.any():
            slope[stale, :] = slope[:, stale] = np.nan
        whole, early, late = self._velocities(h, mind)
        spread = self._velocity_noise(h, mind)
        apart = distances(whole)
        depth = np.array([np.nan if b.depth is None else b.depth for b in objects])
        return Measured(
            h.ids,
            gaps,
            slope,
            sigma,
            apart,
            np.sqrt(whole[:, 0] * whole[:, 0] + whole[:, 1] * whole[:, 1]),
            early,
            late,
            depth,
            whole,
            np.full(m, spread),
            contact_time(gaps, slope),
            self.settings.judge.noise_px,
        )

    def _trend(self, times: Floats, distance: Floats, mind: Mind) -> tuple[Floats, Floats]:
        """Slope over the window, or over its last part where that is strong and of another sign."""
        s = self.settings
        slope, sigma = theil_sen(*binned(times, distance, s.bins))
        noise = np.sqrt(2.0) * s.judge.noise_px
        sigma = np.maximum(sigma, slope_noise(times, noise))
        recent = int(times.searchsorted(times[-1] - s.quick_window_s, side="right"))
        times, distance = times[recent:], distance[recent:]
        quick, spread = theil_sen(*binned(times, distance, s.bins))
        spread = np.maximum(spread, slope_noise(times, noise))
        least = 2.0 * s.rate_enter * scale(mind.frame_size)
        turned = np.abs(quick) > np.maximum(least, s.quick_sigmas * spread)
        if not turned.any():
            return slope, sigma
        turned &= np.sign(quick) != np.sign(slope)
        return np.where(turned, quick, slope), np.where(turned, spread, sigma)

    def _parting(
        self,
        slope: Floats,
        sigma: Floats,
        gaps: Floats,
        objects: tuple[ObjectBelief, ...],
        h: History,
        mind: Mind,
    ) -> tuple[Floats, Floats]:
        """The trend, or the speed at which bodies in contact surely part."""
        s, diagonal = self.settings, scale(mind.frame_size)
        if not len(h.times):
            return slope, sigma  # nobody has looked for longer than the window
        if not (gaps <= s.parting_gap * diagonal).any():
            return slope, sigma
        speed, spread = parting_speed(objects, h.support[-1], mind.time)
        with np.errstate(invalid="ignore"):
            sure = speed > np.maximum(2.0 * s.rate_enter * diagonal, s.quick_sigmas * spread)
            sure &= (gaps <= s.parting_gap * diagonal) & (slope < speed)
        return np.where(sure, speed, slope), np.where(sure, spread, sigma)

    def _velocity_noise(self, h: History, mind: Mind) -> float:
        recent = _recent(h, mind, self.settings.motion_window_s)
        return slope_noise(h.times[recent:], self.settings.judge.noise_px)

    def _velocities(self, h: History, mind: Mind) -> tuple[Floats, Floats, Floats]:
        """Over the window of motion, and over its two halves."""
        m, misfit = len(h.ids), self.settings.misfit * scale(mind.frame_size)
        unknown = np.full((m, 2), np.nan)
        if m == 0 or not covered(h, self.settings.window_s):
            return unknown, unknown, unknown
        recent = _recent(h, mind, self.settings.motion_window_s)
        times, support, free = h.times[recent:], h.support[recent:], h.free[recent:]
        half = len(times) // 2
        spans = (slice(None), slice(None, half), slice(half, None))
        found = common_motion(*slopes_of_spans(times, support, free, spans), misfit)
        return found[:m], found[m : 2 * m], found[2 * m :]

    def _gaps(
        self, objects: tuple[ObjectBelief, ...], h: History, mind: Mind, before: Measured
    ) -> Floats:
        """Outline gaps: exact where near, the hulls' distance elsewhere; NaN when out of sight."""
        m, near = len(objects), NEAR * scale(mind.frame_size)
        i, j = pairs(m)
        unseen = np.array([mind.time - b.last_seen for b in objects])
        longest = np.maximum(unseen[i], unseen[j]) if m else np.zeros(0)
        boxes = np.array([b.region.bbox for b in objects], dtype=float).reshape(-1, 4)
        apart = h.separation[-1][i, j] if len(h.times) else np.full(len(i), np.nan)
        found = np.where(longest == 0.0, np.maximum(near, apart), np.nan)
        for k in np.flatnonzero((longest == 0.0) & (signed_gap(edge_differences(boxes)) <= near)):
            gap = outline_gap(objects[i[k]].region, objects[j[k]].region, near)
            found[k] = found[k] if gap is None else gap
        for k in np.flatnonzero((longest > 0.0) & (longest <= self.settings.hold_s)):
            found[k] = before.pair("gap", objects[i[k]].id, objects[j[k]].id)
        return square(found, m)


def _recent(h: History, mind: Mind, window_s: float) -> int:
    """Number of the first sample of a window that ends now."""
    return int(h.times.searchsorted(mind.time - window_s, side="right"))


def at_rest(now: Measured, settings: RelationSettings, *diagonals: float) -> NDArray[np.bool_]:
    """Whether bodies are at rest to each other: over the window, and in both of its halves.

    The halves are looked at so that a body that bounces off, whose mean relative velocity is zero
    for a moment, is not taken for one that rests.

    Args:
        now: Velocities.
        settings: Thresholds.
        diagonals: Image diagonals, or times as much, pixels; each widens the limits.

    Returns:
        (K, M, M) bool, for each of them; false where a velocity is unknown.
    """
    halves = np.maximum(distances(now.early), distances(now.late))
    wide = np.array(diagonals)[:, None, None]
    rest: NDArray[np.bool_] = halves < settings.still_half * wide
    rest &= now.relative_speed < settings.still_speed * wide
    return rest


def distances(vectors: Floats) -> Floats:
    """(M, M) lengths of the differences of all pairs of (M, 2) vectors."""
    x, y = (vectors[:, None] - vectors[None]).transpose(2, 0, 1)
    apart: Floats = np.sqrt(x * x + y * y)
    return apart
