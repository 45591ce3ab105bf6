"""The M step: motions of tracks fitted to the constraints inside their outlines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import dist, hypot

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.motion_constraints import Constraints
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers.affine import Affine, fit_affine
from visup.percepts.motion.layers.affine_rate import AffineRate
from visup.percepts.motion.layers.background_motion import BackgroundMotion
from visup.percepts.motion.layers.layer_discovery import affine_rate, layer_slack, median_motion
from visup.percepts.motion.tracks._track_points_jit import assigned
from visup.percepts.motion.tracks.measurements import FrameMeasurements
from visup.percepts.motion.tracks.track import Indices, PartMotion, Track

ALIKE_PX_S = 12.0  # pixels per second within which a part moves like a hidden track
UNLIKE_PX_S = 8.0  # pixels per second by which a part may differ between baselines
SHORT_S = 0.1  # longest baseline at which noise on a few edges passes for motion, seconds
PART_COST = 4.0  # squared distance that a further part of a track must save


def fit_tracks(tracks: tuple[Track, ...], scene: FrameMeasurements) -> tuple[Track, ...]:
    """Refit each track's motion to the constraints inside its outline."""
    if not tracks:
        return tracks
    for m in scene.measured:
        owner = scene.owner[scene.cell_of(m.constraints)]
        order = np.argsort(owner, kind="stable")
        ends = np.searchsorted(owner[order], np.arange(1, len(tracks) + 2)).tolist()
        c, ground = m.constraints.take(order), m.background.distances(m.constraints)[order]
        tracks = tuple(
            _fitted(t, m.background, c.take(np.s_[a:b]), ground[a:b], scene.time)
            for t, a, b in zip(tracks, ends[:-1], ends[1:], strict=True)
        )
    return tracks


def moves_like(motion: PartMotion, other: Track) -> bool:
    """Whether a part moves as a track did when it was last in full view."""
    rate = motion.best_rate(other.centre)
    if rate is None:
        return False
    known = other.unoccluded_velocity
    return dist(rate.shift(other.centre), known) < ALIKE_PX_S + 0.2 * hypot(*known)


@dataclass(frozen=True, slots=True, eq=False)
class _PartFit:
    """A motion fitted to the constraints of one part.

    Attributes:
        model: The motion over the baseline of the constraints.
        rate: The same per second.
        constraints: The N constraints in the outline of the track.
        weight: (N,) float32, 1 for those of the part.
    """

    model: Affine
    rate: AffineRate
    constraints: Constraints
    weight: Floats

    def renewed(self, part: PartMotion, least_share: float) -> PartMotion | None:
        """The part with this rate; None when it rests on too few constraints."""
        if self.model.support < max(5.0, least_share * part.support):
            return None
        support = max(self.model.support, 0.99 * part.support)
        return part.with_rate(self.constraints.lag, self.rate, support)


def _fitted(
    t: Track, background: BackgroundMotion, c: Constraints, to_background: Floats, now: float
) -> Track:
    """A track with each part fitted to the constraints it explains best.

    Args:
        t: The track.
        background: Of the baseline.
        c: The N constraints in its outline.
        to_background: (N,) float32, their squared distances to the background.
        now: Seconds.
    """
    if not len(c):
        return t
    models = t.predicted(c.lag, c.span_s)
    own, nearest = _assigned(t, models, c, to_background)
    # A mostly occluded part has few constraints: its known rate is retained.
    least_share = 0.6 if t.mostly_occluded else 0.0
    parts: list[PartMotion] = []
    for i, (part, start) in enumerate(zip(t.motions, models, strict=True)):
        weight = (own & (nearest == i)).astype(np.float32)
        fit = _fit_part(c, weight, start, t.centre, now, first=i == 0)
        if i == 0:
            parts.append(fit.renewed(part, least_share) or part)
        elif (renewed := _further_part(t, part, fit, background, least_share)) is not None:
            parts.append(renewed)
    whole = t.whole_rate if len(parts) < 2 else _whole_rate(c, own, models[0], now) or t.whole_rate
    return replace(t, motions=tuple(parts), whole_rate=whole)


def _assigned(
    t: Track, models: Sequence[Affine], c: Constraints, to_background: Floats
) -> tuple[NDArray[np.bool_], Indices]:
    """Which of N constraints a track may be fitted to, (N,) bool; the nearest part of each, (N,)."""
    matrices = np.array([model.matrix for model in models])
    slacks = np.array([layer_slack(model, t.centre) for model in models])
    return assigned((c.xy, c.moved, c.information), to_background, matrices, slacks, PART_COST)


def _fit_part(
    c: Constraints,
    weight: Floats,
    start: Affine,
    centre: tuple[float, float],
    now: float,
    *,
    first: bool,
) -> _PartFit:
    fit = fit_affine(c, weight, start, slack=layer_slack(start, centre))
    if first and fit.support < 0.5 * weight.sum():
        # It may have stopped or turned: the median motion of its points is tried as well.
        other = fit_affine(c, weight, median_motion(c, np.flatnonzero(weight)), slack=0.3)
        fit = other if other.support > fit.support else fit
    return _PartFit(fit, affine_rate(fit, c, now), c, weight)


def _further_part(
    t: Track, part: PartMotion, fit: _PartFit, background: BackgroundMotion, least_share: float
) -> PartMotion | None:
    """A part besides the first, refitted or faded; None when it is dropped.

    A part that has come to move like the background is dropped, lest it absorb the background.
    """
    if _is_momentary(part, t.motions[0], fit.rate.time):
        return None
    c = fit.constraints
    steady = _agrees_across_baselines(part, fit.rate, t.centre)
    renewed = fit.renewed(part, least_share) if steady else None
    if renewed is not None:
        swallows = c.span_s > 0.3 and background.moves_as(fit.model, _middle_of(c, fit.weight))
        return None if swallows else renewed
    if steady and c.lag == 1:
        return part
    faded = replace(part, support=0.8 * part.support)
    return faded if faded.support >= 4 else None


def _whole_rate(
    c: Constraints, own: NDArray[np.bool_], start: Affine, now: float
) -> AffineRate | None:
    """One shift for all parts together: edges of one constrain what those of another leave open."""
    fit = fit_affine(c, own.astype(np.float32), start, rigidity=1e4, slack=0.5)
    return affine_rate(fit, c, now) if fit.support >= 5 else None


def _middle_of(c: Constraints, weight: Floats) -> tuple[float, float]:
    """Centre of a part; a motion fitted there extrapolates poorly."""
    x, y = c.xy[weight > 0].mean(axis=0)
    return float(x), float(y)


def _is_momentary(part: PartMotion, first: PartMotion, now: float) -> bool:
    """Whether a part is measured between frames only, the first over longer baselines too."""
    longer = [r for r in first.rates.values() if r.span_s > SHORT_S and now - r.time < r.span_s]
    return bool(longer) and all(r.span_s < SHORT_S for r in part.rates.values())


def _agrees_across_baselines(
    motion: PartMotion, rate: AffineRate, where: tuple[float, float]
) -> bool:
    """Whether a part moves over one baseline about as it does over the others.

    A few edges fit any motion for a moment; a part that follows them would explain whatever it meets.
    """
    rest = [r for r in motion.rates.values() if r.span_s != rate.span_s]
    fresh = [r for r in rest if rate.time - r.time < 0.5 + 0.25 * r.span_s]
    if not fresh:
        return True
    best = min(fresh, key=lambda r: r.sigma)
    speed = hypot(*best.shift(where))
    return rate.gap(best, where) < 3 * (rate.sigma + best.sigma) + 0.5 * speed + UNLIKE_PX_S
