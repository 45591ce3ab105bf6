"""Relative motion of two bodies near each other, from their outlines and from image motion.

Velocities reported by the segmenter are used where available; outlines always. Each outline is stored when
the two come near, and registered to every later one: points are moved along their normals until they are on
it (iterated closest points, Chen and Medioni 1992, translation only, robust). Hundreds of points carry more
information than the few extreme ones, errors of short stretches hardly count, and errors of the stored
outline are the same each time, so that they do not look like motion. Once both bodies are in one region, both
stored outlines are registered to the outline of that region.

Points at the image border, and those next to the other body, where an outline ends because the other begins,
are excluded.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from math import hypot, log

import numpy as np

from visup.agent import CameraMotion, Region
from visup.agent.model.fast_replace import replace
from visup.rules.coupling._relative_motion_jit import first_recent, fused_velocity
from visup.rules.geometry._outlines_jit import near_outline, register, run_boxes
from visup.rules.geometry.outlines import TEMPLATE_POINTS, prepared_outline
from visup.rules.geometry.regions import Floats
from visup.rules.geometry.rings import concatenated, even_rings

Vector = tuple[float, float]

ICP_REACH = 12.0
"""Greatest distance of a point to the target outline, pixels."""

NEAR_REACH = 1.5
"""Of a larger body only the part within this distance of the other one, in sizes of the other, is tracked: a
bending arm moves differently at its shoulder than at its hand."""

NEIGHBOUR_MARGIN = 6.0
"""Distance to the other body within which an outline is not trusted, pixels."""

MIN_SIGMA = 0.3
"""Least standard deviation of an image velocity, pixels per second."""

CORRELATION_S = 0.2
"""Correlation time of velocity errors, seconds."""

PART_VARIANCE = 4.0
"""Factor of variance when the motion of a whole body replaces that of a part."""

MIN_POINTS = 12  # fewest points of an outline template
MIN_SAMPLES = 5  # fewest positions from which a velocity is measured
_OUTLIER = 1.5  # distance beyond which a point is down-weighted, pixels


@dataclass(frozen=True, slots=True, eq=False)
class OutlineTemplate:
    """Points of an outline for tracking a body.

    Attributes:
        points: (N, 2) (x, y), frame pixels.
        normals: (N, 2) unit normals of the outline.
        shift: (x, y) by which the body has moved since the outline was stored, pixels.
        velocity: (vx, vy) at which it moved last, pixels per second.
        local: Whether the points cover only the part of the body near the other one.
    """

    points: Floats
    normals: Floats
    shift: Vector = (0.0, 0.0)
    velocity: Vector = (0.0, 0.0)
    local: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class RelativeTrack:
    """The relative track of two bodies near each other.

    Attributes:
        first: Outline of the first body.
        second: Outline of the second body.
        since: Time when the outlines were stored, seconds.
        before: (x, y) displacement accumulated with earlier outlines up to then, pixels.
        camera: (x, y) displacement of the second relative to the first by a camera that zooms, pixels.
        path: (time, x, y, vx, vy, variance): displacement of the second relative to the first except by the
            camera, pixels, and its velocity by image motion, pixels per second; NaN: unknown. Oldest first.
    """

    first: OutlineTemplate
    second: OutlineTemplate
    since: float
    before: Vector = (0.0, 0.0)
    camera: Vector = (0.0, 0.0)
    path: tuple[tuple[float, ...], ...] = ()

    @property
    def path_end(self) -> float:
        """Time of the last observation of both, seconds."""
        return self.path[-1][0] if self.path else self.since


def outline_template(
    region: Region,
    others: Sequence[Region],
    size: tuple[int, int],
    beside: Region | None = None,
) -> OutlineTemplate | None:
    """The trackable points of a region's outline, or None when there are too few.

    Args:
        region: The region.
        others: Bodies near it.
        size: (width, height) of the image, pixels.
        beside: The other body of the pair; if `region` is larger than that, only its part nearby is used.
    """
    parts = even_rings(prepared_outline(region).rings, TEMPLATE_POINTS)
    points = concatenated(parts)
    tangent = concatenated([np.roll(p, -1, axis=0) - np.roll(p, 1, axis=0) for p in parts])
    length = np.linalg.norm(tangent, axis=1)
    normals = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1) / np.maximum(length, 1e-9)[:, None]
    x, y = points.T
    free = (x > 3) & (y > 3) & (x < size[0] - 4) & (y < size[1] - 4) & (length > 0)
    for other in others:
        near = prepared_outline(other)
        free &= ~near_outline(points, near.points, near.boxes, NEIGHBOUR_MARGIN)
    if free.sum() < MIN_POINTS:
        return None
    if beside is not None and region.area > beside.area:
        reach = max(NEAR_REACH * float(np.hypot(*beside.bbox[2:])), 0.05 * float(np.hypot(*size)))
        close = free & (_distance_to_box(points, beside.bbox) <= reach)
        # If too little remains, or hardly anything is excluded, the whole body is tracked.
        if 2 * MIN_POINTS <= close.sum() < 0.8 * free.sum():
            return OutlineTemplate(points[close], normals[close], local=True)
    return OutlineTemplate(points[free], normals[free])


def _distance_to_box(points: Floats, box: tuple[int, int, int, int]) -> Floats:
    """(N,) distances of points from a box, pixels; 0 inside."""
    low, high = np.array(box[:2]), np.array(box[:2]) + np.array(box[2:])
    away = np.maximum(np.maximum(low - points, points - high), 0.0)
    return np.asarray(np.hypot(away[:, 0], away[:, 1]))


@dataclass(frozen=True, slots=True, eq=False)
class TargetOutline:
    """An outline to which stored ones are registered.

    Attributes:
        points: (M, 2) pixels, densely spaced.
        boxes: Boxes of their runs; see `_outlines_jit.py`.
    """

    points: Floats
    boxes: Floats

    @classmethod
    def of(cls, points: Floats) -> TargetOutline:
        """The target with these points."""
        return cls(points, run_boxes(points))


def target_of(region: Region) -> TargetOutline:
    """The outline of a region as a target; one region is the target of several pairs."""
    made = prepared_outline(region)
    return TargetOutline(made.even, made.even_boxes)


def register_outline(
    template: OutlineTemplate, target: TargetOutline, ahead: Iterable[Vector] = ()
) -> OutlineTemplate | None:
    """Register a stored outline to a later one.

    Iterated closest points converge only for shifts of a few pixels. For a body that moves farther between
    two frames, registration also starts from predicted shifts; the result that brings the most points onto
    the target is used.

    Args:
        template: The outline, with its shift so far.
        target: The later outline.
        ahead: (x, y) predicted shifts from there to start from as well, pixels; those of a pixel or so are
            skipped.

    Returns:
        The outline with the new shift; None if too few points match, or if all normals have nearly the same
        direction, so that the shift along the outline is undetermined.
    """
    x, y = template.shift
    starts = [template.shift, *((x + dx, y + dy) for dx, dy in ahead if hypot(dx, dy) > _OUTLIER)]
    found = [k for start in starts if (k := _register_from(start, template, target)) is not None]
    if len(found) < 2:
        return found[0] if found else None
    return max(found, key=lambda k: _points_on_outline(k, target))


def _register_from(
    start: Vector, kept: OutlineTemplate, target: TargetOutline
) -> OutlineTemplate | None:
    limits = ICP_REACH, max(float(MIN_POINTS), 0.5 * len(kept.points)), _OUTLIER
    found, x, y = register(kept.points, kept.normals, start, target.points, target.boxes, limits)
    return replace(kept, shift=(x, y)) if found else None


def _points_on_outline(kept: OutlineTemplate, target: TargetOutline) -> int:
    """Number of points that lie on the other outline."""
    near = near_outline(kept.points + np.array(kept.shift), target.points, target.boxes, _OUTLIER)
    return int(np.count_nonzero(near))


def update_relative_track(
    track: RelativeTrack | None,
    regions: tuple[Region, Region],
    now: float,
    size: tuple[int, int],
    ages_s: tuple[float, float],
    camera: CameraMotion | None = None,
) -> RelativeTrack | None:
    """Update the relative track of two bodies with an observation of both.

    Args:
        track: The track before; None if there was none.
        regions: Regions of the first and the second body; twice the same one when merged.
        now: Time of the observation, seconds.
        size: (width, height) of the image, pixels.
        ages_s: Length of the path, and age at which outlines are replaced, since bodies rotate; seconds.
        camera: Image motion of the static scene since the previous frame; None if unknown.

    Returns:
        The track with one more position; None when the two cannot be tracked.
    """
    (lasts_s, outline_age_s), apart = ages_s, regions[0] is not regions[1]
    if track is None:
        return begin_relative_track(regions, now, size) if apart else None
    dt = now - track.path_end
    first = _track_outline(track.first, regions[0], dt)
    second = _track_outline(track.second, regions[1], dt)
    if first is None or second is None:
        return (
            _restart_track(track, regions, now, size, lasts_s) if apart else replace(track, path=())
        )
    x, y = (b + s - f for b, s, f in zip(track.before, second.shift, first.shift, strict=True))
    dx, dy = _moved_by_camera(first, second, camera)
    cx, cy = track.camera[0] + dx, track.camera[1] + dy
    local = first.local or second.local
    vx, vy, variance = UNKNOWN_MOTION if local else _image_motion(regions)
    if dt > 0.0:
        vx, vy = vx - dx / dt, vy - dy / dt
    place = (now, x - cx, y - cy, vx, vy, variance)
    path = (*(p for p in track.path if p[0] > now - lasts_s), place)
    if apart and now - track.since > outline_age_s:
        fresh = begin_relative_track(regions, now, size)
        if fresh is not None:
            return replace(fresh, before=(x, y), camera=(cx, cy), path=path)
    return replace(track, first=first, second=second, camera=(cx, cy), path=path)


def _moved_by_camera(
    first: OutlineTemplate, second: OutlineTemplate, camera: CameraMotion | None
) -> Vector:
    """(x, y) by which the camera alone displaces the second of two outlines relative to the first, pixels.

    An approximation: the camera's motion in frames in which either was not seen is missing.
    """
    if camera is None:
        return 0.0, 0.0
    (ax, ay), (bx, by) = (
        camera.displacement(o.points.mean(axis=0) + o.shift) for o in (first, second)
    )
    return float(bx - ax), float(by - ay)


def _track_outline(kept: OutlineTemplate, region: Region, dt: float) -> OutlineTemplate | None:
    """A stored outline registered to the body's region `dt` seconds later; None if that fails."""
    known = region.velocity_sigma > 0.0
    velocities = (kept.velocity, region.velocity) if known else (kept.velocity,)
    ahead = [(vx * dt, vy * dt) for vx, vy in velocities]
    found = register_outline(kept, target_of(region), ahead)
    if found is None or dt <= 0.0:
        return found
    (x, y), (x0, y0) = found.shift, kept.shift
    return replace(found, velocity=((x - x0) / dt, (y - y0) / dt))


def _restart_track(
    track: RelativeTrack,
    regions: tuple[Region, Region],
    now: float,
    size: tuple[int, int],
    lasts_s: float,
) -> RelativeTrack | None:
    """Restart the track of two bodies whose outlines changed too much; image motion bridges the gap."""
    fresh, (vx, vy, variance) = begin_relative_track(regions, now, size), _image_motion(regions)
    if fresh is None or not track.path or np.isnan(variance):
        return fresh
    if fresh.first.local or fresh.second.local:
        variance *= PART_VARIANCE
    motion = vx, vy, variance
    then, x, y, *_ = track.path[-1]
    place = (now, x + motion[0] * (now - then), y + motion[1] * (now - then), *motion)
    path = (*(p for p in track.path if p[0] > now - lasts_s), place)
    cx, cy = track.camera
    return replace(fresh, before=(place[1] + cx, place[2] + cy), camera=track.camera, path=path)


def begin_relative_track(
    regions: tuple[Region, Region], now: float, size: tuple[int, int]
) -> RelativeTrack | None:
    """Start the relative track of two bodies; None if too little of their outlines is unobstructed."""
    first = outline_template(regions[0], regions[1:], size, regions[1])
    second = outline_template(regions[1], regions[:1], size, regions[0])
    if first is None or second is None:
        return None
    motion = UNKNOWN_MOTION if first.local or second.local else _image_motion(regions)
    return RelativeTrack(first, second, now, path=((now, 0.0, 0.0, *motion),))


UNKNOWN_MOTION = (np.nan, np.nan, np.nan)
"""Unknown image motion: that of a whole region is poor evidence for a part of a bending one."""


def _image_motion(regions: tuple[Region, Region]) -> tuple[float, float, float]:
    """Relative velocity (vx, vy) by image motion, pixels per second, and the variance of each component.

    All NaN if unknown.
    """
    a, b = regions
    if a is b or a.velocity_sigma <= 0.0 or b.velocity_sigma <= 0.0:
        return (np.nan, np.nan, np.nan)
    variance = max(a.velocity_sigma, MIN_SIGMA) ** 2 + max(b.velocity_sigma, MIN_SIGMA) ** 2
    return b.velocity[0] - a.velocity[0], b.velocity[1] - a.velocity[1], variance


@dataclass(frozen=True, slots=True, eq=False)
class RelativeVelocity:
    """A relative velocity.

    Attributes:
        velocity: (2,) of the second body relative to the first, pixels per second.
        covariance: (2, 2) covariance of the velocity.
        span: Time over which it was measured, seconds.
    """

    velocity: Floats
    covariance: Floats
    span: float

    @property
    def speed_sigma(self) -> float:
        """Standard deviation of the speed, pixels per second."""
        speed = float(np.hypot(*self.velocity))
        if speed <= 0.0:
            return float(np.sqrt(np.trace(self.covariance)))
        return float(np.sqrt(self.velocity @ self.covariance @ self.velocity)) / speed

    def rest_odds(self, still: float, moving: float) -> float:
        """Log odds of relative rest against motion, given this velocity.

        The ratio of two Gaussian densities of zero mean, one for rest and one for motion, each widened by the
        covariance. A direction in which the velocity is hardly known, such as that along a long arm,
        contributes nothing.

        Args:
            still: Relative speed that still counts as rest, pixels per second.
            moving: Typical relative speed of bodies that are not at rest, pixels per second.

        Returns:
            Log odds; bounded above by the ratio of the two speeds, unbounded below.
        """
        (xx, xy), (_, yy) = self.covariance.tolist()
        vx, vy = self.velocity.tolist()

        def gaussian_terms(variance: float) -> tuple[float, float]:
            """Determinant of the inflated covariance, and the Mahalanobis distance of the velocity."""
            a, c = xx + variance, yy + variance
            determinant = a * c - xy * xy
            return determinant, (c * vx * vx - 2.0 * xy * vx * vy + a * vy * vy) / determinant

        (rest, rests), (free, moves) = gaussian_terms(0.5 * still**2), gaussian_terms(moving**2)
        return 0.5 * (log(free / rest) - (rests - moves))


def relative_velocity(track: RelativeTrack, now: float, window_s: float) -> RelativeVelocity | None:
    """The relative velocity of two bodies.

    Args:
        track: Their relative track.
        now: Current time, seconds.
        window_s: Length of the window, seconds; longer where gaps leave too few positions in it.

    Returns:
        The current velocity; None while too little is known.
    """
    if len(track.path) <= MIN_SAMPLES:
        return None
    places = np.fromiter(chain.from_iterable(track.path), float, 6 * len(track.path)).reshape(-1, 6)
    begin = first_recent(places, now, window_s, MIN_SAMPLES)
    span = float(places[-1, 0] - places[begin, 0])
    if span < 0.6 * window_s - 1e-6:
        return None
    return RelativeVelocity(*fused_velocity(places, begin, CORRELATION_S), span)
