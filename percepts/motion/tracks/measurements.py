"""What one frame shows: points, superpixels, and motions measured over several baselines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.motion_constraints import Constraints, Points
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.layers.affine import Affine, distances, fit_affine, log_likelihood
from visup.percepts.motion.layers.affine_rate import AffineRate
from visup.percepts.motion.layers.background_motion import BackgroundMotion
from visup.percepts.motion.layers.layer_discovery import affine_rate, layer_slack, median_motion
from visup.percepts.motion.tracks.track import Indices, PartMotion, Track

REACH_STEPS = 2
ALIKE_PX_S = 12.0  # pixels per second within which a part moves like what is hidden
UNLIKE_PX_S = 8.0  # pixels per second by which a part may differ between baselines
SHORT_S = 0.1  # baselines up to which noise on a few edges passes for motion, seconds
PART_COST = 4.0  # squared distance that a further part of a track must save


@dataclass(frozen=True, slots=True, eq=False)
class BaselineMotion:
    """Motion over one baseline.

    Attributes:
        constraints: Where it was measured.
        background: The motions of the background.
    """

    constraints: Constraints
    background: BackgroundMotion


@dataclass(frozen=True, eq=False)
class FrameMeasurements:
    """One frame as measured.

    Attributes:
        image: The working image.
        points: Points with structure.
        cells: Superpixels.
        owner: (count,) label that each superpixel is expected to have; 0 is background.
        seconds: Since the frame before.
        measured: Motions, the shortest baseline first.
    """

    image: WorkImage
    points: Points
    cells: Superpixels
    owner: Indices
    seconds: float
    measured: tuple[BaselineMotion, ...]

    @property
    def time(self) -> float:
        """Seconds."""
        return self.image.time

    @cached_property
    def at(self) -> NDArray[np.int32]:
        """(N,) number of the superpixel at each point."""
        x, y = self.points.xy.astype(np.int64).T
        return np.asarray(self.cells.labels[y, x])

    def cell_of(self, c: Constraints) -> NDArray[np.int32]:
        """Number of the superpixel at each constraint."""
        return np.asarray(self.at[c.index])


def min_region_area(scene: FrameMeasurements, settings: MotionSettings) -> float:
    """Least area of a region, working pixels."""
    return settings.min_area * scene.image.grey.size


def background_weights(scene: FrameMeasurements) -> Floats:
    """(N,) float32: 1 for points away from all objects, 0 for those in or beside one."""
    owner = scene.owner > 0
    near = scene.cells.dilated(owner[:, None], 1)[:, 0] if owner.any() else owner
    return (~near[scene.at]).astype(np.float32)


def predicted_positions(
    scene: FrameMeasurements, tracks: tuple[Track, ...], camera: Affine, lag: int, span: float
) -> Floats:
    """Where each point is expected in an older image, (N, 2) float32."""
    at = scene.owner[scene.at]
    moved = camera.at(scene.points.xy)
    for k, t in enumerate(tracks, 1):
        mine = at == k
        if mine.any():
            main = max(range(len(t.motions)), key=lambda i: t.motions[i].support)
            moved[mine] = t.predicted(lag, span)[main].at(scene.points.xy[mine])
    return np.asarray(scene.points.xy - moved)


def fit_tracks(tracks: tuple[Track, ...], scene: FrameMeasurements) -> tuple[Track, ...]:
    """Renew each track's motion from the constraints inside its outline."""
    for m in scene.measured:
        c = m.constraints
        at = scene.owner[scene.cell_of(c)]
        tracks = tuple(_fitted(t, m, at == k, scene.time) for k, t in enumerate(tracks, 1))
    return tracks


def moves_like(motion: PartMotion, other: Track) -> bool:
    """Whether a part moves as a track did when it was last in full view."""
    rate = motion.best_rate(other.centre)
    if rate is None:
        return False
    gap = rate.velocity(other.centre) - np.asarray(other.unoccluded_velocity)
    return bool(np.hypot(*gap) < ALIKE_PX_S + 0.2 * np.hypot(*other.unoccluded_velocity))


def _fitted(t: Track, m: BaselineMotion, mine: NDArray[np.bool_], now: float) -> Track:
    """Each part takes the constraints that it explains best, and is fitted to them.

    A part that has come to move as the background does is given up while others remain, lest the
    background be swallowed.
    """
    c = m.constraints
    models = t.predicted(c.lag, c.span_s)
    if not mine.any():
        return t
    known, c = m.background.distances(c)[mine], c.take(np.flatnonzero(mine))
    off = np.stack([distances(m, c, layer_slack(m, t.centre)) for m in models])
    # The first part comes first: an edge along the motion fits any part, and must not feed them.
    off[1:] += PART_COST
    nearest = off.argmin(axis=0)
    clear = 0.6 if t.mostly_occluded else 0.0
    # What the background explains, and no part does, must not draw the track after it.
    # When that holds for most of it, it has stopped instead.
    own = (off.min(axis=0) < 9) | (known > 4)
    own = own if np.count_nonzero(own) > 0.5 * len(own) else np.ones_like(own)
    motions = []
    for i, (motion, start) in enumerate(zip(t.motions, models, strict=True)):
        weight = (own & (nearest == i)).astype(np.float32)
        fit = fit_affine(c, weight, start, slack=layer_slack(start, t.centre))
        if i == 0 and fit.support < 0.5 * weight.sum():
            # It may have stopped or turned: what most of its points do is tried as well.
            other = fit_affine(c, weight, median_motion(c, np.flatnonzero(weight)), slack=0.3)
            fit = other if other.support > fit.support else fit
        # A part that is nearly hidden tells little of its motion: what was known is kept.
        steady = i == 0 or _agrees_across_baselines(motion, affine_rate(fit, c, now), t.centre)
        if i > 0 and _is_momentary(motion, t.motions[0], now):
            continue
        if steady and fit.support >= max(5.0, clear * motion.support):
            support = max(fit.support, 0.99 * motion.support)
            motion = motion.with_rate(c.lag, affine_rate(fit, c, now), support)
            if i > 0 and c.span_s > 0.3 and m.background.moves_as(fit, _middle_of(c, weight)):
                continue
        elif i > 0 and (c.lag > 1 or not steady):
            motion = replace(motion, support=0.8 * motion.support)
            if motion.support < 4:
                continue
        motions.append(motion)
    motions = motions or [t.motions[0]]
    whole = t.whole_rate
    if len(motions) > 1:
        # One shift for all parts together: what the edges of one leave open, those of others close.
        fit = fit_affine(c, own.astype(np.float32), models[0], rigidity=1e4, slack=0.5)
        if fit.support >= 5:
            whole = affine_rate(fit, c, now)
    return replace(t, motions=tuple(motions), whole_rate=whole)


def _middle_of(c: Constraints, weight: Floats) -> tuple[float, float]:
    """Where a part lies: a motion fitted there says little of other places."""
    x, y = c.xy[weight > 0].mean(axis=0)
    return float(x), float(y)


def _is_momentary(part: PartMotion, first: PartMotion, now: float) -> bool:
    """Whether a part is seen from frame to frame only, while the first is seen over longer too."""
    longer = [r for r in first.rates.values() if r.span_s > SHORT_S and now - r.time < r.span_s]
    return bool(longer) and all(r.span_s < SHORT_S for r in part.rates.values())


def _agrees_across_baselines(
    motion: PartMotion, rate: AffineRate, where: tuple[float, float]
) -> bool:
    """Whether a part moves over one baseline about as it does over the others.

    A few edges fit any motion for a moment; a part that follows them explains whatever it meets.
    """
    rest = [r for r in motion.rates.values() if r.span_s != rate.span_s]
    fresh = [r for r in rest if rate.time - r.time < 0.5 + 0.25 * r.span_s]
    if not fresh:
        return True
    best = min(fresh, key=lambda r: r.sigma)
    speed = best.velocity(where)
    gap = float(np.hypot(*(rate.velocity(where) - speed)))
    return gap < 3 * (rate.sigma + best.sigma) + 0.5 * float(np.hypot(*speed)) + UNLIKE_PX_S


def claimable_cells(
    scene: FrameMeasurements, tracks: tuple[Track, ...], prior: Floats
) -> NDArray[np.bool_]:
    """Which cells each track may claim, (count, K) bool: its own, their neighbours, its hidden."""
    members = prior[:, 1:-1] > 0.3
    for k, t in enumerate(tracks):
        if t.occluded is not None:
            members[:, k] |= scene.cells.mean(t.occluded) > 0.3
    return scene.cells.dilated(members, REACH_STEPS)


def point_likelihoods(
    scene: FrameMeasurements,
    tracks: tuple[Track, ...],
    reach: NDArray[np.bool_],
    settings: MotionSettings,
) -> tuple[Floats, NDArray[np.bool_]]:
    """Log likelihood of every point under every label (the E step).

    Args:
        scene: The frame.
        tracks: K tracks.
        reach: (count, K) bool, which cells each track may claim.
        settings: Gives the distance at which a motion no longer explains.

    Returns:
        (N, K + 2) float32 for background, tracks and unknown motion; (N,) bool, which points say
        what is seen there: corners whose motion was measured. Edges help to fit layers; as
        evidence for labels they make silhouettes worse (docs/benchmarks.md).
    """
    n = len(scene.points)
    out = np.zeros((n, len(tracks) + 2), dtype=np.float32)
    has = np.zeros(n, dtype=bool)
    near = reach[scene.at]
    least = -0.5 * settings.outlier**2
    for m in scene.measured:
        c = m.constraints
        has[c.index] = True
        zero = m.background.log_likelihood(c)
        for k, t in enumerate(tracks, 1):
            parts = t.predicted(c.lag, c.span_s)
            within = np.flatnonzero(near[c.index, k - 1])
            some = c.take(within)
            each = [log_likelihood(p, some, layer_slack(p, t.centre)) for p in parts]
            fit = np.full(len(c), 3 * least, dtype=np.float32)
            fit[within] = np.maximum(np.max(each, axis=0), 3 * least)
            out[c.index, k] += fit
        out[c.index, 0] += np.maximum(zero, 3 * least)
        out[c.index, -1] += least
    return out, has & scene.points.corners()
