"""Salient motion: whether a track moves independently or belongs to its surroundings.

Leaves, water and the errors of a non-planar background move at every moment and get nowhere: over a longer
baseline the background explains them again, or the motion summed step by step does not show. Objects leave
their place and keep a course (Wixson, Detecting salient motion by accumulating directionally-consistent
flow, 2000). The ground near a moving camera departs from any single background model, but not from its own
surroundings: so a track is also compared with a motion fitted to the ring around it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers.affine import Affine, Doubles, distances, fit_affine
from visup.percepts.motion.layers.background_motion import background_slack
from visup.percepts.motion.layers.layer_discovery import median_motion
from visup.percepts.motion.tracks.measurements import BaselineMotion, FrameMeasurements
from visup.percepts.motion.tracks.track import Indices, Track

MIN_DISPLACEMENT = 1.0  # least displacement against the background, pixels: leaves reach less
YOUNG_DISPLACEMENT = 4.0  # pixels, the same for a track too young to have swung back
SWING_S = 0.4
STRAIGHT_SHARE = 0.7  # net displacement as a share of path length
EXPLAINED_SHARE = 0.35
"""Most share of points that fit the background, over the most telling baseline."""
EARLY_EXPLAINED_SHARE = 0.25  # the same for a track reported at once
LEFT_PLACE_SHARE = 0.25  # share of its size that a track has gone when its place is another
FIT_DISTANCE = 9.0  # squared Mahalanobis distance within which the background explains a point
NEWEST_WEIGHT = 0.3  # weight of the newest frame in running means
REST_SHARE = 0.7  # share of points that fit the background when a track rests
ABSORBED_GROWTH = 2.0
"""Growth since it last moved from which a resting object has absorbed background."""
FEWEST_POINTS = 4
EARLY_DISPLACEMENT = 3.0
"""Pixels, least displacement of a track reported at once: further than leaves swing."""
RING_STEPS = 5  # width of the surrounding ring, cells
FEWEST_AROUND = 8
MAX_BORDER = 0.2  # most share of the image border that an object may cover when first reported
LITTLE_BORDER = 0.04  # the same for one reported at once: parallax is greatest at the border
FOOT_SHARE = 0.15  # height of a region's foot, as a share of its own
MIN_OWN = 0.25  # least motion of its own, pixels per frame: twice the sampling error
GROUND_TOLERANCE = 0.15
"""Share of the ground's motion that counts as none: the foot is not located to a pixel."""
MAX_AHEAD = 0.4
"""How much faster than the background, in its direction, a near object at rest may move."""


def update_salience(
    tracks: Sequence[Track], scene: FrameMeasurements, winner: Indices
) -> tuple[Track, ...]:
    """Accumulate each track's displacement from its surroundings and how well they explain it.

    Args:
        tracks: K tracks, updated.
        scene: The frame.
        winner: (count,) label of each superpixel; label k is track k - 1.

    Returns:
        The updated tracks.
    """
    young = [k for k, t in enumerate(tracks, 1) if not t.id]
    members = winner[:, None] == np.asarray(young, dtype=winner.dtype)
    # Points of a track's own outline may lie in adjacent cells, which are therefore excluded.
    adjacent = scene.cells.dilated(members, 1)
    rings = scene.cells.dilated(adjacent, RING_STEPS - 1) & ~adjacent & (winner == 0)[:, None]
    ring_of = dict(zip(young, rings.T, strict=True))
    shares = [_shares_explained(m, scene, winner, len(tracks)) for m in scene.measured]
    return tuple(
        _confirmed_updated(t, k, scene, winner, [by_track[k] for by_track in shares])
        if t.id
        else _candidate_updated(t, k, scene, winner, ring_of[k])
        for k, t in enumerate(tracks, 1)
    )


def is_stationary(t: Track, scene: FrameMeasurements) -> bool:
    """Whether an object does not move against the background over the baselines of this frame.

    Then motion does not show where it ends. Slow objects show over the longer baselines; one that has
    stopped keeps its shape.
    """
    seen = [t.background_fit.get(_octave(m), 0.0) for m in scene.measured]
    return bool(t.id) and min(seen) > REST_SHARE


def stationary_cells(tracks: Sequence[Track], scene: FrameMeasurements) -> NDArray[np.bool_]:
    """(count,) bool: superpixels of objects that do not move against the background."""
    out = np.zeros(scene.cells.count, dtype=bool)
    for t in tracks:
        if is_stationary(t, scene):
            out |= t.share > 0.5
    return out


def has_absorbed_background(t: Track, scene: FrameMeasurements) -> bool:
    """Whether an object has grown over the background until that explains all of it.

    The background also explains an object that stopped, but that has not grown since it moved.
    """
    area = float(scene.cells.area[t.share > 0.5].sum())
    rests_always = bool(t.id) and min(t.background_fit.values(), default=0.0) > REST_SHARE
    return rests_always and area > ABSORBED_GROWTH * max(t.moving_area, 1.0)


def _shares_explained(
    m: BaselineMotion, scene: FrameMeasurements, winner: Indices, count: int
) -> list[float | None]:
    """Share of the constraints of each label that the background explains; None where they are few."""
    at = winner[scene.cell_of(m.constraints)]
    number = np.bincount(at, minlength=count + 2)
    fits = np.bincount(
        at[m.background.distances(m.constraints) < FIT_DISTANCE], minlength=count + 2
    )
    pairs = zip(fits.tolist(), number.tolist(), strict=True)
    return [fit / all_ if all_ >= FEWEST_POINTS else None for fit, all_ in pairs]


def _confirmed_updated(
    t: Track, k: int, scene: FrameMeasurements, winner: Indices, shares: Sequence[float | None]
) -> Track:
    """Record how well the background explains an object, over each baseline."""
    explained = dict(t.background_fit)
    for m, share in zip(scene.measured, shares, strict=True):
        if share is not None:
            _update_share(explained, m, share)
    area = t.moving_area
    if min(explained.values(), default=1.0) < EXPLAINED_SHARE:
        area = float(scene.cells.area[winner == k].sum())
    return replace(t, background_fit=MappingProxyType(explained), moving_area=area)


def _candidate_updated(
    t: Track, k: int, scene: FrameMeasurements, winner: Indices, ring: NDArray[np.bool_]
) -> Track:
    explained, courses = dict(t.background_fit), dict(t.long_baseline_course)
    foot = foot_point(winner == k, scene.cells)
    for m in scene.measured:
        at = scene.cell_of(m.constraints)
        mine, around = winner[at] == k, ring[at]
        local = tuple(
            model
            for model in (surrounding_motion(m, around), upright_motion(m, foot))
            if model is not None
        )
        if np.count_nonzero(mine) >= FEWEST_POINTS:
            misfit = _misfit(m, local, np.flatnonzero(mine))
            _update_share(explained, m, float(np.mean(misfit < FIT_DISTANCE)))
        if m is scene.measured[0]:
            t = _with_displacement(t, m, local, scene)
        _update_course(courses, t, m, local, scene)
    return replace(
        t,
        background_fit=MappingProxyType(explained),
        long_baseline_course=MappingProxyType(courses),
    )


def _with_displacement(
    t: Track, m: BaselineMotion, local: Sequence[Affine], scene: FrameMeasurements
) -> Track:
    """Add the displacement of a frame, if it was measured in it."""
    if not any(rate.time == scene.time for rate in t.motions[0].rates.values()):
        return t
    step = _displacement_from_background(t.instant_velocity() * scene.seconds, t, m, local)
    travelled = t.displacement[0] + float(step[0]), t.displacement[1] + float(step[1])
    return replace(t, displacement=travelled, path_length=t.path_length + float(np.hypot(*step)))


def _update_course(
    courses: dict[int, float],
    t: Track,
    m: BaselineMotion,
    local: Sequence[Affine],
    scene: FrameMeasurements,
) -> None:
    """Record how much of the path length shows over a baseline longer than a swing."""
    rate = t.motions[0].rates.get(m.constraints.lag)
    if m.constraints.span_s < SWING_S or rate is None or rate.time != scene.time:
        return
    age = scene.time - t.initiated + scene.seconds
    path = t.path_length * min(1.0, m.constraints.span_s / age)
    net = _displacement_from_background(rate.velocity(t.centre) * rate.span_s, t, m, local)
    courses[_octave(m)] = float(np.hypot(*net)) / max(path, 1e-6)


def _update_share(explained: dict[int, float], m: BaselineMotion, share: float) -> None:
    """Update the running share of explained points over a baseline."""
    before = explained.get(_octave(m), share)
    explained[_octave(m)] = before + NEWEST_WEIGHT * (share - before)


def _octave(m: BaselineMotion) -> int:
    """Octave of a baseline; baselines of similar length, as when a video starts, share one."""
    return round(float(np.log2(m.constraints.lag)))


def surrounding_motion(m: BaselineMotion, around: NDArray[np.bool_]) -> Affine | None:
    """The motion of a region's surroundings over one baseline; None with too few constraints.

    Args:
        m: Motion over the baseline.
        around: (N,) bool, which constraints lie around the region.

    Returns:
        An affine motion fitted to them.
    """
    index = np.flatnonzero(around)
    if len(index) < FEWEST_AROUND:
        return None
    c = m.constraints
    return fit_affine(
        c, around.astype(np.float32), median_motion(c, index), rigidity=1.0, slack=0.2
    )


def foot_point(mine: NDArray[np.bool_], cells: Superpixels) -> tuple[float, float] | None:
    """(x, y) of the lowest part of a region; None when it is empty or cut off by the image there.

    Args:
        mine: (count,) bool, its cells.
        cells: The superpixels.
    """
    if not mine.any():
        return None
    bottom = int(cells.corners[mine, 3].max())
    if bottom >= cells.labels.shape[0]:
        return None
    top = int(cells.corners[mine, 1].min())
    low = mine & (cells.corners[:, 3] > bottom - FOOT_SHARE * (bottom - top))
    return float(np.average(cells.centre[low, 0], weights=cells.area[low])), float(bottom)


def upright_motion(m: BaselineMotion, foot: tuple[float, float] | None) -> Affine | None:
    """The motion of an upright object at rest on the ground, seen by a moving camera.

    It is as far away as the ground at its foot, so all of it moves as the background does there: it has
    parallax against everything behind it, and none against that place.
    """
    if foot is None:
        return None
    matrix = np.zeros((2, 3))
    matrix[:, 2] = m.background.models[-1].shift(foot)
    return Affine(matrix)


def moves_like_standing(scene: FrameMeasurements, mine: NDArray[np.bool_]) -> bool:
    """Whether cells move, between two frames, as an upright object at rest there would.

    Args:
        scene: The frame.
        mine: (count,) bool, the cells.
    """
    rest = upright_motion(scene.measured[0], foot_point(mine, scene.cells))
    if rest is None:
        return False
    x, y = scene.cells.centre[mine].astype(np.int64).T
    moved = -np.median(scene.flow[y, x], axis=0)
    ground = rest.matrix[:, 2]
    return bool(np.hypot(*(moved - ground)) < MIN_OWN + GROUND_TOLERANCE * np.hypot(*ground))


def _misfit(m: BaselineMotion, local: Sequence[Affine], which: Indices) -> NDArray[np.float32]:
    """Squared distance of some constraints to the background or the surroundings, whichever fits best."""
    c = m.constraints
    out, some = m.background.distances(c)[which], c.take(which)
    for model in local:
        out = np.minimum(out, distances(model, some, background_slack(model, c)))
    return out


def is_salient(
    t: Track, scene: FrameMeasurements, *, at_once: bool = False, need: float = 1.0
) -> bool:
    """Whether a track has clearly left its place, on a course, over some baseline.

    What covers much of the image border is ground rather than surrounded by it: a near wall, rocks in
    front.

    Args:
        t: The track.
        scene: The frame.
        at_once: Whether to report it at once: then its motion must be clearer, and not one that an
            object at rest near a moving camera may show.
        need: Scale of the required displacement and of the allowed explained share; 1 is usual.

    Returns:
        Whether it certainly moves independently.
    """
    if border_share(t.share, scene.cells) > (LITTLE_BORDER if at_once else MAX_BORDER):
        return False
    travelled = float(np.hypot(*t.displacement))
    explained = min(t.background_fit.values(), default=0.0)
    straight, straight_over_long = (
        travelled >= STRAIGHT_SHARE * t.path_length,
        _is_straight_over_long_baseline(t),
    )
    if at_once:
        # Steps of slow objects are half noise: a longer baseline shows their course better.
        course = straight if straight_over_long is None else straight_over_long
        clear = explained < EARLY_EXPLAINED_SHARE / need and travelled >= need * EARLY_DISPLACEMENT
        return clear and course and not _outruns_background(t, scene)
    least = MIN_DISPLACEMENT if scene.time - t.initiated >= need * SWING_S else YOUNG_DISPLACEMENT
    # A track may be fed by leaf after leaf that happens to swing the same way.
    course = straight and straight_over_long is not False
    return explained < EXPLAINED_SHARE / need and travelled >= need * least and course


def has_left_its_place(t: Track, scene: FrameMeasurements) -> bool:
    """Whether a track has gone a good part of its own size: then nothing more is learnt by waiting."""
    area = float(scene.cells.area[t.share > 0.5].sum())
    return float(np.hypot(*t.displacement)) >= LEFT_PLACE_SHARE * math.sqrt(area)


def _is_straight_over_long_baseline(t: Track) -> bool | None:
    """Whether the longest baseline confirms the path length; None if none is long enough."""
    return (
        t.long_baseline_course[max(t.long_baseline_course)] >= STRAIGHT_SHARE
        if t.long_baseline_course
        else None
    )


def border_share(share: Floats, cells: Superpixels) -> float:
    """Share of the image border that a track (count,) covers, 0 to 1."""
    labels = cells.labels
    border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    return float(np.mean(share[border] > 0.5))


def _outruns_background(t: Track, scene: FrameMeasurements) -> bool:
    """Whether a track moves like the background, only faster, as near objects at rest do."""
    ground = np.asarray(scene.measured[0].background.models[-1].shift(t.centre))
    speed = float(np.hypot(*ground))
    if speed < 1.0:
        return False
    more = t.instant_velocity() * scene.seconds - ground
    along = float(more @ ground) / speed**2
    across = abs(float(more[0] * ground[1] - more[1] * ground[0])) / speed**2
    return along > 0 and across < along + MAX_AHEAD


def _displacement_from_background(
    moved: Doubles, t: Track, m: BaselineMotion, local: Sequence[Affine]
) -> Doubles:
    """(x, y) displacement of a track, pixels, against the background motion nearest to its own."""
    models = (*m.background.models, *local)
    displacements = [moved - np.asarray(b.shift(t.centre)) for b in models]
    return min(displacements, key=lambda way: float(np.hypot(*way)))
