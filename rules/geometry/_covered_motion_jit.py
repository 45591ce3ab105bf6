"""Compiled loops: the motion of a body that another one covers in part, from its outline and its image.

Where a body is covered its outline ends because another one begins, and that edge moves as the other one
does. Of a resting box that is covered from one side as many directions move as rest. So the outline alone is
trusted when nearly all of it moves as one. Otherwise there are several explanations, each that of one half of
the outline: the one that most of it moves along with is the body's, where the image motion inside it counts
as some more directions; two that are about as good leave it unknown. Of a body that the image border cuts too
few directions are left for halves; its outline is believed unless its image contradicts it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

COVERED_SIGMAS = 3.0
"""A direction moves along with a motion within so many standard deviations of its slope."""
AS_ONE = 0.8
"""Share of the directions that must move alike for an outline to be trusted alone."""
IMAGE_COUNTS = 3
"""Directions for which the image motion counts."""
SOME = 4
"""Directions that must move along with the image motion."""
CLEARLY = 2
"""Directions by which an explanation must be better than any other one."""
UNEVEN = 0.15
"""Tolerated difference of a direction, as a share of the speed: bodies turn and come nearer."""
IMAGE_LASTS_S = 0.2
"""Correlation time of errors of image velocities, seconds."""


@compiled
def image_velocity(
    times: Floats, image: Floats, span: tuple[int, int], i: int
) -> tuple[float, float, float]:
    """Mean image motion of a body over a span of samples, and its deviation; NaN if mostly unknown."""
    begin, end = span
    x = y = variance = 0.0
    known = 0
    for t in range(begin, end):
        if np.isfinite(image[t, i, 2]):
            x, y = x + image[t, i, 0], y + image[t, i, 1]
            variance += image[t, i, 2] ** 2
            known += 1
    if 2 * known <= end - begin:
        return np.nan, np.nan, np.nan
    parts = max(1.0, (times[end - 1] - times[begin]) / IMAGE_LASTS_S)
    return x / known, y / known, np.sqrt(variance / known / parts)


@compiled
def moving_along(
    slopes: Floats, usable: Flags, directions: Floats, motion: tuple[float, float], near: float
) -> int:
    """Number of directions in which an outline moves as a motion demands."""
    x, y = motion
    off, count = max(near, UNEVEN * np.hypot(x, y)), 0
    for k in range(len(slopes)):
        if usable[k]:
            count += abs(slopes[k] - (x * directions[k, 0] + y * directions[k, 1])) <= off
    return count


@compiled
def half_motion(
    slopes: Floats, usable: Flags, directions: Floats, first: int
) -> tuple[float, float]:
    """Least-squares motion of half an outline, from a direction on; NaN with fewer than `SOME` known."""
    count = len(slopes)
    xx = yy = 1e-9
    xy = bx = by = 0.0
    known = 0
    for step in range(count // 2 + 1):
        k = (first + step) % count
        if usable[k]:
            nx, ny = directions[k, 0], directions[k, 1]
            xx, xy, yy = xx + nx * nx, xy + nx * ny, yy + ny * ny
            bx, by = bx + nx * slopes[k], by + ny * slopes[k]
            known += 1
    if known < SOME:
        return np.nan, np.nan
    determinant = xx * yy - xy * xy
    return (yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant


@compiled
def _explanations(
    slopes: Floats,
    usable: Flags,
    directions: Floats,
    motions: tuple[tuple[float, float], tuple[float, float, float]],
    near: float,
) -> Floats:
    """(E, 3) possible motions of a body (x, y), and the directions that speak for each."""
    count = len(slopes)
    (x, y), (u, v, sigma) = motions
    found = np.full((count + 2, 3), np.nan)
    found[0, 0], found[0, 1] = x, y
    found[1, 0], found[1, 1] = u, v
    for first in range(count):
        found[first + 2, 0], found[first + 2, 1] = half_motion(slopes, usable, directions, first)
    for e in range(len(found)):
        motion = found[e, 0], found[e, 1]
        if np.isfinite(motion[0]):
            alike = moving_along(slopes, usable, directions, motion, near)
            beside = np.hypot(motion[0] - u, motion[1] - v)
            seen = alike >= SOME and beside <= max(near + sigma, UNEVEN * np.hypot(u, v))
            found[e, 2] = alike + IMAGE_COUNTS if seen else alike
    return found


@compiled
def _contradicted(
    slopes: Floats,
    usable: Flags,
    directions: Floats,
    motions: tuple[tuple[float, float], tuple[float, float, float]],
    near: float,
) -> bool:
    """Whether the image of a body moves otherwise than its outline, and explains about as many directions."""
    (x, y), (u, v, sigma) = motions
    if not np.isfinite(x) or not np.isfinite(u):
        return False
    alike = moving_along(slopes, usable, directions, (x, y), near)
    seen = moving_along(slopes, usable, directions, (u, v), near)
    apart = 2.0 * max(near + sigma, UNEVEN * np.hypot(x, y))
    as_good = seen >= SOME and seen + IMAGE_COUNTS > alike - CLEARLY
    return bool(as_good and np.hypot(u - x, v - y) > apart)


@compiled
def uncovered_motion(
    slopes: Floats,
    usable: Flags,
    directions: Floats,
    motions: tuple[tuple[float, float], tuple[float, float, float]],
    near: float,
) -> tuple[float, float]:
    """The velocity of a body that may be covered in part.

    Args:
        slopes: (K,) of the support of its outline, pixels per second.
        usable: (K,) whether each is known.
        directions: (K, 2) unit vectors, evenly round the circle.
        motions: Velocity of its outline, see `common_motion`, and of its image with its deviation; NaN
            where unknown.
        near: Tolerated difference of a slope, pixels per second.

    Returns:
        (x, y) pixels per second; NaN where unknown.
    """
    x, y = motions[0]
    known = 0
    for k in range(len(slopes)):
        known += usable[k]
    alike = moving_along(slopes, usable, directions, (x, y), near) if np.isfinite(x) else 0
    if alike >= AS_ONE * known:
        return x, y
    if known < len(slopes):  # the image border cuts it
        doubted = _contradicted(slopes, usable, directions, motions, near)
        return (np.nan, np.nan) if doubted else (x, y)
    found = _explanations(slopes, usable, directions, motions, near)
    best = -1
    for e in range(len(found)):
        if np.isfinite(found[e, 2]) and (best < 0 or found[e, 2] > found[best, 2]):
            best = e
    if best < 0 or 2 * found[best, 2] < known:
        return x, y
    u, v = found[best, 0], found[best, 1]
    same = 2.0 * max(near, UNEVEN * np.hypot(u, v))
    for e in range(len(found)):
        if (
            found[e, 2] > found[best, 2] - CLEARLY
            and np.hypot(found[e, 0] - u, found[e, 1] - v) > same
        ):
            return np.nan, np.nan
    return u, v
