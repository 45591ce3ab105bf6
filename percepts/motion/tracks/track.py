"""The state of a moving object between frames: identity, motion, shape, occlusion.

A mask is stored as one share per superpixel; the occluded part is stored as a pixel map, since it moves
with its own motion under an occluder that moves with another.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import dist, hypot
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers.affine import Affine, Doubles
from visup.percepts.motion.layers.affine_rate import AffineRate

Indices = NDArray[np.int64]
BRISK_S = 0.25  # longest baseline of an instantaneous velocity, seconds
SMOOTH_S = 0.2  # averaging time of frame-to-frame velocities, seconds


def _nothing() -> Mapping[int, float]:
    return MappingProxyType({})


def _no_rates() -> Mapping[int, AffineRate]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class PartMotion:
    """The motion of one rigid part, by baseline.

    Attributes:
        rates: By baseline in frames.
        support: Number of constraints it last rested on.
    """

    rates: Mapping[int, AffineRate] = field(default_factory=_no_rates)
    support: float = 0.0

    def predicted(self, lag: int, span_s: float, where: tuple[float, float]) -> Affine:
        """Its displacement over a baseline, from the best known rate."""
        rate = self.rates.get(lag)
        if rate is None or max(r.time for r in self.rates.values()) - rate.time >= 0.5:
            rate = self.best_rate(where)
        if rate is None:
            return Affine(np.zeros((2, 3)))
        return Affine(rate.matrix * span_s, rate.sigma * span_s)

    def best_rate(self, where: tuple[float, float]) -> AffineRate | None:
        """The most certain rate that agrees with those over shorter baselines at a position."""
        if not self.rates:
            return None
        newest = max(r.time for r in self.rates.values())
        fresh = [r for r in self.rates.values() if newest - r.time < 0.5 + 0.25 * r.span_s]
        fresh.sort(key=lambda r: r.span_s)
        best = fresh[0]
        for rate in fresh[1:]:
            if rate.gap(best, where) < 3 * (rate.sigma + best.sigma) and rate.sigma < best.sigma:
                best = rate
        return best

    def with_rate(self, lag: int, rate: AffineRate, support: float) -> PartMotion:
        """The same motion with one rate replaced."""
        return PartMotion(MappingProxyType({**self.rates, lag: rate}), support)


@dataclass(frozen=True, eq=False)  # without slots: a frame copies each several times
class Track:
    """One moving object.

    Attributes:
        key: Number within the segmenter, from 1, in order of initiation.
        id: Public number from 1, 0 until confirmed.
        initiated: Seconds.
        last_seen: Seconds when it was last visible.
        share: (count,) float32, probability of each superpixel.
        occluded: (h, w) bool, where others hide it; None when they do not.
        motions: The motions of its rigid parts; an arm has several.
        whole_rate: The single motion that fits all parts best.
        recent_share: (count,) float32, where it was recently: parts that appear there are its own.
        evidence: How much better its own motion explains it than the background's (log likelihood,
            running sum).
        frames: In how many frames it was visible.
        centre: (x, y) centroid when last visible, working pixels.
        mostly_occluded: Whether others hide at least a third of it.
        unoccluded_velocity: (vx, vy) when it was last in full view, pixels per second.
        pending_shift: (x, y) of motion not yet applied to `occluded`, pixels.
        predicted_share: (count,) float32, where it would be by its own motion alone.
        predicted_map: (h, w) bool, the same by pixels while others hide a part of it, or None.
        core: (count,) bool, where it prevails, even by less than half, and objects are more certain than the
            background; None before the first update.
        path: (time, x, y) of its displacement since initiation, over the longest baseline.
        separate_s: Seconds for which it was observed apart from other tracks, by key.
        merge_votes: Votes that it is one with another track, by key.
        displacement: (x, y) of its displacement since initiation against the background, pixels.
        path_length: Length of the path of that displacement, pixels.
        long_baseline_course: Displacement over a longer baseline as a share of the path length meanwhile, by
            octave of the baseline.
        background_fit: Share of its points that the background explains, by octave of the baseline.
        moving_area: Its area when the background last did not explain it, working pixels.
    """

    key: int
    id: int
    initiated: float
    last_seen: float
    share: Floats
    occluded: NDArray[np.bool_] | None = None
    motions: tuple[PartMotion, ...] = ()
    whole_rate: AffineRate | None = None
    recent_share: Floats | None = None
    evidence: float = 0.0
    frames: int = 0
    centre: tuple[float, float] = (0.0, 0.0)
    mostly_occluded: bool = False
    unoccluded_velocity: tuple[float, float] = (0.0, 0.0)
    pending_shift: tuple[float, float] = (0.0, 0.0)
    predicted_share: Floats | None = None
    predicted_map: NDArray[np.bool_] | None = None
    core: NDArray[np.bool_] | None = None
    path: tuple[tuple[float, float, float], ...] = ()
    separate_s: Mapping[int, float] = field(default_factory=_nothing)
    merge_votes: Mapping[int, float] = field(default_factory=_nothing)
    displacement: tuple[float, float] = (0.0, 0.0)
    path_length: float = 0.0
    long_baseline_course: Mapping[int, float] = field(default_factory=_nothing)
    background_fit: Mapping[int, float] = field(default_factory=_nothing)
    moving_area: float = 0.0

    def predicted(self, lag: int, span_s: float) -> tuple[Affine, ...]:
        """The displacement of each part over a baseline.

        The rate times the span overestimates an object that stopped or turned within the baseline: then
        its recorded path is used.
        """
        parts = [m.predicted(lag, span_s, self.centre) for m in self.motions]
        own = self.motions[0].rates.get(lag)
        measured_now = bool(self.path) and own is not None and own.time > self.path[-1][0] - 1e-6
        if len(self.path) > 1 and not measured_now:
            went = self._displacement_over(span_s)
            if dist(parts[0].shift(self.centre), went) > 1 + 0.1 * hypot(*went):
                matrix = np.zeros((2, 3))
                matrix[:, 2] = went
                parts[0] = Affine(matrix)
        return tuple(parts)

    def _displacement_over(self, span_s: float) -> tuple[float, float]:
        """Displacement over the last `span_s` seconds, (x, y) pixels; extrapolated before initiation."""
        now, sought = self.path[-1], self.path[-1][0] - span_s
        after = bisect_left(self.path, (sought,))
        around = self.path[max(after - 1, 0) : after + 1]
        then = min(around, key=lambda p: abs(sought - p[0]))
        rate = span_s / max(now[0] - then[0], 1e-6)
        return (now[1] - then[1]) * rate, (now[2] - then[2]) * rate

    def instant_velocity(self) -> Doubles:
        """Velocity over the shortest baselines, (vx, vy) pixels per second."""
        if not self.motions or not self.motions[0].rates:
            return np.zeros(2)
        newest = max(r.time for r in self.motions[0].rates.values())
        fresh = [r for r in self.motions[0].rates.values() if newest - r.time < 0.3]
        fresh.sort(key=lambda r: r.span_s)
        best = fresh[0]
        for rate in fresh[1:]:
            near = rate.gap(best, self.centre) < 3 * best.sigma
            if rate.span_s < BRISK_S and near and rate.sigma < best.sigma:
                best = rate
        return best.velocity(self.centre)

    def velocity(self, where: tuple[float, float]) -> Doubles:
        """(vx, vy) at a position, pixels per second.

        Frame-to-frame measurements are averaged over the last few.
        """
        rate = self.best_rate()
        if rate is None:
            return np.zeros(2)
        now = rate.velocity(where)
        if len(self.motions) > 1 or rate.span_s > SMOOTH_S or len(self.path) < 2:
            return now
        span = min(SMOOTH_S, self.path[-1][0] - self.path[0][0])
        return now - self.instant_velocity() + np.asarray(self._displacement_over(span)) / span

    def best_rate(self) -> AffineRate | None:
        """The rate of the whole track, or of its only part."""
        if not self.motions:
            return None
        if len(self.motions) > 1 and self.whole_rate is not None:
            return self.whole_rate
        main = max(self.motions, key=lambda m: m.support)
        return main.best_rate(self.centre)


Tracks = tuple[Track, ...]


def new_track(
    key: int,
    now: float,
    share: NDArray[Any],
    motion: PartMotion,
    centre: Doubles,
    evidence: float = 0.0,
) -> Track:
    """A candidate, initiated in this frame.

    Args:
        key: Its number within the segmenter.
        now: Seconds.
        share: (count,), probability of each superpixel.
        motion: The motion of its only part.
        centre: (2,) x, y, working pixels.
        evidence: Initial log likelihood.
    """
    middle = (float(centre[0]), float(centre[1]))
    cells = share.astype(np.float32)
    return Track(key, 0, now, now, cells, motions=(motion,), centre=middle, evidence=evidence)
