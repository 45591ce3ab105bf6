"""Compiled loops of `kinematics.py`: from fits to quantities of all objects and pairs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.rules.relations.rows import PairQuantity

Floats = NDArray[np.float64]


@compiled
def hull_gaps(
    seen: Floats, separation: Floats, before: Floats, near: float, hold: float
) -> tuple[Floats, NDArray[np.int64]]:
    """Gaps of all pairs from boxes and hulls, and the pairs that need their outlines.

    Args:
        seen: (M, 8) per body: seconds since it was seen; its image motion (x, y), pixels per second, and
            its standard deviation, NaN if not seen or unknown; its box, pixels.
        separation: (M, M) signed distances of the hulls, pixels; NaN unknown.
        before: (M, M) gaps of the previous step, pixels.
        near: Gap beyond which outlines are not used, pixels.
        hold: Time for which the last gap is held for bodies out of view, seconds.

    Returns:
        (P,) pixels, and numbers of pairs.
    """
    pairs = len(seen) * (len(seen) - 1) // 2
    gaps, asked = np.empty(pairs), np.empty(pairs, np.int64)
    number, count = -1, 0
    for i in range(len(seen)):
        for j in range(i + 1, len(seen)):
            number += 1
            longest = max(seen[i, 0], seen[j, 0])
            gaps[number] = np.nan
            if longest > 0.0:
                if longest <= hold:
                    gaps[number] = before[i, j]
                continue
            apart = separation[i, j]
            gaps[number] = np.nan if np.isnan(apart) else max(near, apart)
            dx = max(
                seen[j, 4] - seen[i, 4] - seen[i, 6], seen[i, 4] - seen[j, 4] - seen[j, 6], 0.0
            )
            dy = max(
                seen[j, 5] - seen[i, 5] - seen[i, 7], seen[i, 5] - seen[j, 5] - seen[j, 7], 0.0
            )
            if dx * dx + dy * dy <= near * near:
                asked[count] = number
                count += 1
    return gaps, asked[:count]


@compiled
def _least_overlap(support: Floats, i: int, j: int) -> int:
    """Number of the direction from body i to body j in which their hulls overlap least; -1 unknown."""
    half, least, at = support.shape[1] // 2, np.inf, -1
    for k in range(2 * half):
        reach = support[i, k] + support[j, (k + half) % (2 * half)]
        if reach < least:
            least, at = reach, k
    return at


@compiled
def steady_separation(
    separation: Floats, support: Floats, drift: Floats, directions: Floats
) -> Floats:
    """Distances of the hulls as they would have been if the camera had always been as it is now.

    A camera that zooms out brings all bodies nearer to each other. The drift is that of their centres; a gap
    between them changes in proportion. The change is taken out along the direction in which the hulls overlap
    least now. What overlaps, or is out of view, stays as it is.

    Args:
        separation: (T, M, M) signed distances of the hulls, pixels; NaN unknown.
        support: (M, K) support of the outlines at the last sample, pixels.
        drift: (T, M, 2) accumulated image motion of the static scene at each body, pixels.
        directions: (K, 2) unit vectors.

    Returns:
        (T, M, M) pixels.
    """
    samples, count = len(separation), separation.shape[1]
    found = separation.copy()
    for i in range(count):
        for j in range(i + 1, count):
            at = _least_overlap(support, i, j)
            if at < 0:
                continue
            opposite = (at + len(directions) // 2) % len(directions)
            gap = -support[i, at] - support[j, opposite]
            extents = support[i, at] + support[i, opposite] + support[j, at] + support[j, opposite]
            share = max(0.0, gap) / max(1e-9, max(0.0, gap) + 0.5 * extents)
            x, y = share * directions[at]
            for t in range(samples):
                dx = drift[-1, j, 0] - drift[t, j, 0] - drift[-1, i, 0] + drift[t, i, 0]
                dy = drift[-1, j, 1] - drift[t, j, 1] - drift[-1, i, 1] + drift[t, i, 1]
                found[t, i, j] += x * dx + y * dy
                found[t, j, i] += x * dx + y * dy
    return found


@compiled
def _separation_speed(support: Floats, seen: Floats, i: int, j: int, directions: Floats) -> float:
    """Speed at which body j moves away from body i, by their image motion, pixels per second."""
    at = max(0, _least_overlap(support, i, j))
    x, y = seen[j, 1] - seen[i, 1], seen[j, 2] - seen[i, 2]
    return float(x * directions[at, 0] + y * directions[at, 1])


@compiled
def separation_speeds(support: Floats, seen: Floats, directions: Floats) -> tuple[Floats, Floats]:
    """(M, M) speeds of separation by image motion, and their standard deviations; see `pair_tables`."""
    count = len(seen)
    speed, spread = np.empty((count, count)), np.empty((count, count))
    for i in range(count):
        for j in range(count):
            speed[i, j] = _separation_speed(support, seen, i, j, directions)
            spread[i, j] = np.hypot(seen[i, 3], seen[j, 3])
    return speed, spread


@compiled
def time_to_contact(gap: float, rate: float) -> float:
    """Seconds until a gap closes at a rate; see `Kinematics.time_to_contact`."""
    if np.isnan(gap) or np.isnan(rate):
        return np.nan
    if gap <= 0.0:
        return 0.0
    return gap / -rate if rate < 0.0 else np.inf


@compiled
def covered_pairs(
    separation: Floats, velocity: Floats, limits: tuple[float, float, float]
) -> NDArray[np.bool_]:
    """Pairs of slow bodies of which one is, or just was, beside a third body that moves relative to it.

    Args:
        separation: (T, M, M) signed distances of the hulls over the window, pixels; NaN unknown.
        velocity: (M, 2) pixels per second; NaN unknown.
        limits: Speed below which a body is slow, pixels per second; distance at which the third body may
            cover or shade it; least change of that distance over the window, if their relative velocity is
            slow, pixels.

    Returns:
        (P,) bool.
    """
    fast, near, change = limits
    samples, count = len(separation), separation.shape[1]
    slow, passed = np.zeros(count, np.bool_), np.zeros((count, count), np.bool_)
    for i in range(count):
        slow[i] = np.hypot(velocity[i, 0], velocity[i, 1]) < fast
        for k in range(count if slow[i] else 0):
            least, most = np.inf, -np.inf
            for t in range(samples):
                apart = separation[t, i, k]
                if i != k and not np.isnan(apart):
                    least, most = min(least, apart), max(most, apart)
            relative = np.hypot(velocity[i, 0] - velocity[k, 0], velocity[i, 1] - velocity[k, 1])
            passed[i, k] = least < near and (most - least > change or not relative < fast)
    found, number = np.zeros(count * (count - 1) // 2, np.bool_), -1
    for i in range(count):
        for j in range(i + 1, count):
            number += 1
            for k in range(count):
                third = slow[i] and slow[j] and k not in (i, j)
                found[number] |= third and (passed[i, k] or passed[j, k])
    return found


@compiled
def pair_tables(
    gaps: Floats,
    slope: Floats,
    sigma: Floats,
    velocity: Floats,
    support: Floats,
    seen: Floats,
    directions: Floats,
    limits: tuple[float, float, float, float],
) -> tuple[Floats, Floats]:
    """Quantities of all pairs.

    While one body is in front of another, the distance of their hulls carries little information: its
    noise is large, and no gap is visible yet. The image motion of each region is known much better. So for
    bodies near each other, a speed of separation far above its noise replaces the trend of their distance.
    Approach does not need this, since it is visible well before contact.

    Args:
        gaps: (P,) pixels.
        slope: (P,) trends of the distances, pixels per second.
        sigma: (P,) their standard deviations.
        velocity: (M, 2) pixels per second.
        support: (M, K) support of the outlines at the last sample, pixels; no rows if there is none.
        seen: (M, 8) per body; see `hull_gaps`.
        directions: (K, 2) unit vectors.
        limits: Gap up to which image motion is used, pixels; the least speed of separation, pixels per
            second, and in standard deviations; how long a trend outlasts the last sighting of a body,
            seconds.

    Returns:
        (5, M, M) tables and (M,) speeds.
    """
    contact, strong, sigmas, lasts = limits
    count, number = len(seen), -1
    found, speeds = np.full((5, count, count), np.nan), np.empty(count)
    for i in range(count):
        for j in range(i + 1, count):
            number += 1
            stale = max(seen[i, 0], seen[j, 0]) > lasts
            for a, b in ((i, j), (j, i)):
                rate, wide = slope[number], sigma[number]
                if gaps[number] <= contact and len(support):
                    speed = _separation_speed(support, seen, a, b, directions)
                    known = np.hypot(seen[a, 3], seen[b, 3])
                    if speed > strong and speed > sigmas * known and rate < speed:
                        rate, wide = speed, known
                found[PairQuantity.GAP, a, b] = gaps[number]
                found[PairQuantity.SIGMA, a, b] = wide
                found[PairQuantity.RATE, a, b] = np.nan if stale else rate
    for i in range(count):
        x, y = velocity[i, 0], velocity[i, 1]
        speeds[i] = np.sqrt(x * x + y * y)
        for j in range(count):
            x, y = velocity[i, 0] - velocity[j, 0], velocity[i, 1] - velocity[j, 1]
            found[PairQuantity.RELATIVE_SPEED, i, j] = np.sqrt(x * x + y * y)
            found[PairQuantity.TIME_TO_CONTACT, i, j] = time_to_contact(
                found[PairQuantity.GAP, i, j], found[PairQuantity.RATE, i, j]
            )
    return found, speeds
