"""Quantities of all objects and pairs: gaps, trends, velocities, measured in one vectorised pass."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from visup.agent import Mind, ObjectBelief
from visup.rules.geometry._recent_motion_jit import fit_motion
from visup.rules.geometry.outlines import NEAR_SHARE, outline_gap
from visup.rules.geometry.pairs import pairs, reindexing
from visup.rules.geometry.regions import DIRECTIONS, FAN, Floats, image_diagonal
from visup.rules.relations._kinematics_jit import (
    covered_pairs,
    hull_gaps,
    pair_tables,
    time_to_contact,
)
from visup.rules.relations.rows import PairQuantity
from visup.rules.relations.samples import SampleWindow
from visup.rules.relations.thresholds import ThresholdSettings


@dataclass(frozen=True, slots=True)
class RelationSettings:
    """Settings and thresholds of the relations.

    Attributes:
        window_s: Length of the window over which lines are fitted.
        samples: Most samples in the window.
        bins: Most bins of neighbouring samples to which lines are fitted.
        change_sigmas: Standard deviations, besides twice `rate_enter`, by which a line over a shorter
            window must differ from that over a longer one for the longer one to be outdated.
        parting_gap: Gap up to which image motion indicates separation, image diagonals.
        motion_window_s: Length of the window over which velocities are fitted.
        rate_enter: Trend that must be exceeded to converge or diverge, image diagonals per second.
        rate_exit: Trend below which they end, image diagonals per second.
        sigmas: Standard deviations of the slope that a trend must exceed to enter.
        pending_sigmas: The same while a trend is pending.
        trend_minimum_s: Least duration of a trend before it is accepted.
        hold_s: Time for which the last gap is held for bodies that flicker out of view.
        depth_rate: Least relative rate of depth, share of the depth per second.
        touch_enter: Outline gap at which bodies touch, image diagonals.
        touch_exit: Outline gap at which they no longer do.
        touch_minimum_s: Least duration of a touch.
        covering_gap: Distance at which a third body may cover or shade one of a pair, image diagonals.
        passing: Least change of that distance over the window for it to pass by, image diagonals.
        slow_speed: Speed below which a change of a pair's distance may be due to that, image diagonals per
            second.
        covered_sigma: Standard deviation of the trend of such a pair, image diagonals per second: its
            outlines shift.
        still_speed: Relative speed over the window below which two bodies are at rest relative to each
            other, image diagonals per second.
        still_half: The same in each half of the window, where the noise is greater.
        misfit: Tolerated unevenness of an outline's motion, image diagonals per second.
        apart_depth: Relative depth difference from which touching outlines are apart in depth.
        image_only_confidence: Greatest confidence of a relation without depth.
        apart_exit: Relative depth difference below which they are no longer apart in depth.
        together_exit: Factor of the limits of relative motion before moving together ends.
        moving_exit: Share of the speed required for moving together at which it still continues.
        thresholds: Thresholds of RCC-8, QTC, direction and distance class.
    """

    window_s: float = 1.5
    samples: int = 64
    bins: int = 16
    change_sigmas: float = 4.0
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
    covering_gap: float = 0.05
    passing: float = 0.0125
    slow_speed: float = 0.0125
    covered_sigma: float = 0.004
    still_speed: float = 0.0025
    still_half: float = 0.0045
    misfit: float = 0.0075
    apart_depth: float = 0.25
    image_only_confidence: float = 0.8
    apart_exit: float = 0.2
    together_exit: float = 1.5
    moving_exit: float = 0.7
    thresholds: ThresholdSettings = field(
        default_factory=lambda: ThresholdSettings(speed_enter=0.002, speed_exit=0.001)
    )


@dataclass(frozen=True, slots=True, eq=False)
class Kinematics:
    """Quantities of the last step, as compared by rules. NaN is unknown.

    Attributes:
        ids: (M,) object ids, ascending.
        tables: (5, M, M) `gap`, `rate`, `rate_sigma`, `relative_speed`, `time_to_contact`.
        motion: (3, M, 2) velocities over the motion window, in its first and in its second half, pixels
            per second in the image, minus the camera's motion where it is perceived.
        speed: (M,) speeds, pixels per second.
        depth: (M,) in the objects' units.
        velocity_sigma: (M,) standard deviation of a velocity component due to noise of the outlines,
            pixels per second.
        noise_px: Standard deviation of an outline, pixels.
    """

    ids: tuple[int, ...] = ()
    tables: Floats = field(default_factory=lambda: np.zeros((5, 0, 0)))
    motion: Floats = field(default_factory=lambda: np.zeros((3, 0, 2)))
    speed: Floats = field(default_factory=lambda: np.zeros(0))
    depth: Floats = field(default_factory=lambda: np.zeros(0))
    velocity_sigma: Floats = field(default_factory=lambda: np.zeros(0))
    noise_px: float = 0.0

    @property
    def gap(self) -> Floats:
        """(M, M) distance of the outlines, pixels."""
        return self._table(PairQuantity.GAP)

    @property
    def rate(self) -> Floats:
        """(M, M) trend of the distance, pixels per second, negative when closing."""
        return self._table(PairQuantity.RATE)

    @property
    def rate_sigma(self) -> Floats:
        """(M, M) its standard deviation."""
        return self._table(PairQuantity.SIGMA)

    @property
    def relative_speed(self) -> Floats:
        """(M, M) pixels per second."""
        return self._table(PairQuantity.RELATIVE_SPEED)

    @property
    def time_to_contact(self) -> Floats:
        """(M, M) seconds until the outlines meet at the present rate.

        0 where they meet, infinite where they do not approach.
        """
        return self._table(PairQuantity.TIME_TO_CONTACT)

    def _table(self, number: PairQuantity) -> Floats:
        found: Floats = self.tables[number]
        return found

    @property
    def velocity(self) -> Floats:
        """(M, 2) pixels per second in the image."""
        found: Floats = self.motion[0]
        return found

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
        """The confidence interval of one quantity of one pair.

        Args:
            quantity: 'gap', 'rate', 'relative_speed' or 'time_to_contact'.
            a: An object.
            b: Another object.
            sigmas: Standard deviations on either side.

        Returns:
            (low, high) in the quantity's unit; both NaN when unknown. A time to contact is between those
            of the highest and the lowest closing speed.
        """
        value = self.pair(quantity, a, b)
        if quantity == "time_to_contact":
            gap, rate = self.interval("gap", a, b, sigmas), self.interval("rate", a, b, sigmas)
            if value == 0.0 or np.isnan(value):
                return value, value
            soon, late = sorted(map(time_to_contact, gap, rate))
            return soon, late
        wide = sigmas * self._sigma(quantity, a, b)
        low = value - wide
        return (low if quantity == "rate" else max(0.0, low)) if low == low else low, value + wide

    def _sigma(self, quantity: str, a: int, b: int) -> float:
        if quantity == "rate":
            return self.pair("rate_sigma", a, b)
        if quantity == "relative_speed":
            return float(np.hypot(self.one("velocity_sigma", a), self.one("velocity_sigma", b)))
        return self.noise_px * sqrt(2.0)


@dataclass(frozen=True, slots=True)
class KinematicsEstimator:
    """Computes quantities from samples."""

    settings: RelationSettings

    def __call__(
        self,
        h: SampleWindow,
        objects: tuple[ObjectBelief, ...],
        seen: Floats,
        mind: Mind,
        before: Kinematics,
    ) -> Kinematics:
        """Measure one step.

        Args:
            h: Samples up to now.
            objects: The objects of the samples.
            seen: (M, 8) their sightings; see `sightings`.
            mind: The mind.
            before: The quantities of the previous step.

        Returns:
            All quantities; NaN where unknown.
        """
        s, diagonal = self.settings, image_diagonal(mind.frame_size)
        noise, strong = s.thresholds.noise_px, 2.0 * s.rate_enter * diagonal
        gaps = self._gaps(objects, seen, h, mind, before)
        windows, apart = (s.window_s, s.motion_window_s), h.steady_separation
        slope, sigma, motion, spread = fit_motion(
            h.times,
            (h.steady_support, h.free, h.image),
            apart,
            DIRECTIONS,
            (*windows, noise, strong, s.change_sigmas, s.misfit * diagonal),
            s.bins,
        )
        passing = s.slow_speed * diagonal, s.covering_gap * diagonal, s.passing * diagonal
        covered = covered_pairs(apart, motion[0], passing)
        sigma = np.where(covered, np.hypot(sigma, s.covered_sigma * diagonal), sigma)
        found, speed = pair_tables(
            gaps,
            slope,
            sigma,
            motion[0],
            h.support[-1] if len(h.times) else NOWHERE,
            seen,
            DIRECTIONS,
            (s.parting_gap * diagonal, strong, s.change_sigmas, 0.5 * s.window_s),
        )
        depth = np.array([np.nan if b.depth is None else b.depth for b in objects])
        return Kinematics(h.ids, found, motion, speed, depth, spread, noise)

    def _gaps(
        self,
        objects: tuple[ObjectBelief, ...],
        seen: Floats,
        h: SampleWindow,
        mind: Mind,
        before: Kinematics,
    ) -> Floats:
        """Outline gaps: exact when near, else the hulls' distance; NaN when out of view."""
        m, near = len(objects), NEAR_SHARE * image_diagonal(mind.frame_size)
        apart = h.separation[-1] if len(h.times) else np.full((m, m), np.nan)
        last = before.gap if before.ids == h.ids else _moved(before.gap, before.ids, h.ids)
        found, asked = hull_gaps(seen, apart, last, near, self.settings.hold_s)
        i, j = pairs(m)
        for k in asked.tolist():
            gap = outline_gap(objects[i[k]].region, objects[j[k]].region, near)
            found[k] = found[k] if gap is None else gap
        return found


NOWHERE = np.empty((0, FAN))


def _moved(table: Floats, old: tuple[int, ...], new: tuple[int, ...]) -> Floats:
    """A table re-indexed for other objects; NaN for pairs with a new one."""
    rows, _ = reindexing(old, new)
    wide = np.pad(table, (0, 1), constant_values=np.nan)
    return np.ascontiguousarray(wide[np.ix_(rows, rows)])


def sightings(objects: tuple[ObjectBelief, ...], now: float) -> Floats:
    """(M, 8) sightings of bodies; see `hull_gaps`."""
    rows = []
    for b in objects:
        r = b.region
        measured = b.last_seen == now and r.velocity_sigma > 0.0
        x, y, sigma = (*r.velocity, r.velocity_sigma) if measured else UNMEASURED
        rows.append((now - b.last_seen, x, y, sigma, *r.bbox))
    return np.array(rows, dtype=float).reshape(-1, 8)


UNMEASURED = (float("nan"),) * 3
