"""How two bodies that meet move relative to each other, from the whole of both outlines.

Each outline is kept as it was when the two came near, and laid upon every later one: points are
moved along their normals until they lie on it (iterated closest points, Chen and Medioni 1992,
translation alone, robust). Hundreds of points say more than the few by which a body reaches
furthest, errors of single stretches hardly count, and what is wrong with the kept outline is wrong
in the same way each time, so that it does not look like motion. Once both are seen as one region,
both kept outlines are laid upon that.

Points at the image border, and those beside the other body, where the outline ends because the
other begins, have no say.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from visup.agent import Region
from visup.rules.geometry import Floats, outline

POINTS = 96
"""Points of a kept outline."""

REACH = 12.0
"""How far a point may be from the outline on which it is laid, pixels."""

BESIDE = 6.0
"""How near the other body an outline is not trusted, pixels."""

LEAST_POINTS = 12
_WILD = 1.5  # pixels beyond which a point counts less


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """Points of an outline that say how a body moves.

    Attributes:
        points: (N, 2) pixels.
        normals: (N, 2) unit vectors across the outline.
        shift: (x, y) by which the body has moved since, pixels.
    """

    points: Floats
    normals: Floats
    shift: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """What is remembered of two bodies that are near each other.

    Attributes:
        first: Outline of the one, and
        second: of the other.
        since: Seconds when they were kept.
        before: Relative shift up to then, pixels.
        path: (time, x, y): how far the second had moved relative to the first; pixels, oldest first.
    """

    first: Kept
    second: Kept
    since: float
    before: tuple[float, float] = (0.0, 0.0)
    path: tuple[tuple[float, float, float], ...] = ()

    @property
    def path_end(self) -> float:
        """Seconds of the last sight of both."""
        return self.path[-1][0] if self.path else self.since


def kept_outline(region: Region, other: Region, size: tuple[int, int]) -> Kept | None:
    """The points of a region's outline that can be followed, or None when there are too few.

    Args:
        region: The region.
        other: The body near it.
        size: (width, height) of the image, pixels.
    """
    points = evenly(outline(region), POINTS)
    tangent = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    length = np.linalg.norm(tangent, axis=1)
    normals = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1) / np.maximum(length, 1e-9)[:, None]
    x, y = points.T
    free = (x > 3) & (y > 3) & (x < size[0] - 4) & (y < size[1] - 4) & (length > 0)
    beside = cKDTree(outline(other)).query(points, distance_upper_bound=BESIDE)[0]
    free &= ~np.isfinite(beside)
    return Kept(points[free], normals[free]) if free.sum() >= LEAST_POINTS else None


def evenly(points: Floats, count: int) -> Floats:
    """A closed outline (N, 2) as `count` points evenly spaced along it."""
    closed = np.concatenate([points, points[:1]])
    steps = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, along[-1], count, endpoint=False)
    return np.stack([np.interp(at, along, closed[:, k]) for k in (0, 1)], axis=1)


def laid_upon(kept: Kept, target: Floats) -> Kept | None:
    """A kept outline moved onto a later one.

    Args:
        kept: The outline, with its shift so far.
        target: (M, 2) the later outline, pixels; points no further apart than a few pixels.

    Returns:
        The same with the new shift; None when too little of it finds its place.
    """
    tree = cKDTree(target)
    shift = np.array(kept.shift)
    for _ in range(4):
        at = kept.points + shift
        far, nearest = tree.query(at, distance_upper_bound=REACH)
        found = np.isfinite(far)
        if found.sum() < max(LEAST_POINTS, 0.5 * len(at)):
            return None
        normals = kept.normals[found]
        across = ((target[nearest[found]] - at[found]) * normals).sum(axis=1)
        weight = 1.0 / np.maximum(np.abs(across), _WILD)
        square = (normals * weight[:, None]).T @ normals
        # An outline with but one direction says nothing of motion along it.
        if np.linalg.cond(square) > 50.0:
            return None
        step = np.linalg.solve(square, (normals * (weight * across)[:, None]).sum(axis=0))
        shift = shift + step
        if np.abs(step).max() < 0.02:
            break
    return replace(kept, shift=(float(shift[0]), float(shift[1])))


def follow(
    joint: Joint | None,
    regions: tuple[Region, Region],
    now: float,
    size: tuple[int, int],
    *,
    lasts_s: float,
    anew_s: float,
) -> Joint | None:
    """What is known of two bodies after another sight of them.

    Args:
        joint: What was known.
        regions: Of the first and the second; twice the same when they are one region.
        now: Seconds.
        size: (width, height) of the image, pixels.
        lasts_s: How far back the path is kept.
        anew_s: Outlines older than this are kept anew, as bodies turn.

    Returns:
        The same with a further place on its path; None when the two cannot be followed.
    """
    apart = regions[0] is not regions[1]
    if joint is None:
        return _begun(regions, now, size) if apart else None
    targets = [evenly(outline(r), max(POINTS, len(outline(r)))) for r in regions]
    first, second = laid_upon(joint.first, targets[0]), laid_upon(joint.second, targets[1])
    if first is None or second is None:
        return _begun(regions, now, size) if apart else replace(joint, path=())
    x, y = (
        b + s - f for b, s, f in zip(joint.before, second.shift, first.shift, strict=True)
    )
    path = (*(p for p in joint.path if p[0] > now - lasts_s), (now, x, y))
    if apart and now - joint.since > anew_s:
        fresh = _begun(regions, now, size)
        if fresh is not None:
            return replace(fresh, before=(x, y), path=path)
    return replace(joint, first=first, second=second, path=path)


def _begun(regions: tuple[Region, Region], now: float, size: tuple[int, int]) -> Joint | None:
    first = kept_outline(regions[0], regions[1], size)
    second = kept_outline(regions[1], regions[0], size)
    if first is None or second is None:
        return None
    return Joint(first, second, now, path=((now, 0.0, 0.0),))


def speeds(joint: Joint, now: float, window_s: float) -> tuple[float, float, float] | None:
    """How fast two bodies move relative to each other.

    Args:
        joint: What is known of them.
        now: Seconds.
        window_s: Over how long.

    Returns:
        Pixels per second over the window and over its two halves; None while too little is known.
    """
    recent = np.array([p for p in joint.path if p[0] > now - window_s - 1e-6])
    if len(recent) < 5 or recent[-1, 0] - recent[0, 0] < 0.7 * window_s:
        return None
    middle = len(recent) // 2
    return _speed(recent), _speed(recent[: middle + 1]), _speed(recent[middle:])


def _speed(path: Floats) -> float:
    t = path[:, 0] - path[:, 0].mean()
    slope = t @ path[:, 1:] / max(float(t @ t), 1e-9)
    return float(np.hypot(*slope))
