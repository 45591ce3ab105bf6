"""Compiled robust fits over time: trends of distances, velocities of outlines.

A dozen objects are some fifty pairs with thirty samples each: little work for loops, but hundreds of array
calls. NaN marks missing or unknown values, and every comparison with it fails.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.rules.geometry._covered_motion_jit import (
    COVERED_SIGMAS,
    image_velocity,
    uncovered_motion,
)

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Samples = tuple[Floats, Flags, Floats]


@compiled
def _below(part: Floats, pivot: float, other: float) -> int:
    """Partition by `< pivot or == other`, branch-free; returns the number of elements moved first."""
    count = 0
    for k in range(len(part)):
        value = part[k]
        part[k] = part[count]
        part[count] = value
        count += (value < pivot) | (value == other)
    return count


@compiled
def median(values: Floats, count: int) -> float:
    """Median of the first `count` values, which are reordered; NaN for none."""
    if count == 0:
        return np.nan
    at, low, high = count // 2, 0, count
    while high - low > 32:  # quickselect (Hoare 1961)
        pivot = values[(low + high) // 2]
        end = low + _below(values[low:high], pivot, np.nan)
        if at < end:
            high = end
            continue
        low = end + _below(values[end:high], pivot, pivot)
        if at < low:
            low, high = at, at + 1
    few, middle = values[low:high], values[low]
    for i in range(len(few)):  # for a few, counting is quicker
        less = most = 0
        for k in range(len(few)):
            less += few[k] < few[i]
            most += few[k] <= few[i]
        if less <= at - low < most:
            middle = few[i]
    if count % 2:
        return float(middle)
    fewer, below = 0, -np.inf
    for k in range(count):
        fewer += values[k] < middle
        below = max(below, values[k] if values[k] < middle else -np.inf)
    return float(0.5 * ((below if fewer == at else middle) + middle))


@compiled
def theil_sen(times: Floats, values: Floats, count: int, rises: Floats) -> tuple[float, float]:
    """Slope of a line through samples, by the median of the slopes of all pairs of samples.

    Robust to up to 29 % of outliers (Theil 1950, Sen 1968).

    Args:
        times: Seconds, increasing; overwritten.
        values: Any unit; NaN where there is no sample; overwritten.
        count: Number of samples.
        rises: Scratch, one number per pair of samples.

    Returns:
        Slope and its standard deviation, in units per second; NaN with fewer than four samples.
        The deviation is from the median absolute deviation of the residuals as if they were
        independent, so it is too small for slow wobbles.
    """
    n = 0
    for k in range(count):
        if np.isfinite(values[k]):
            times[n], values[n] = times[k], values[k]
            n += 1
    if n < 4:
        return np.nan, np.nan
    pairs, middle, lever = 0, 0.0, 0.0
    for i in range(n):
        middle += times[i]
        for j in range(i + 1, n):
            rises[pairs] = (values[j] - values[i]) / (times[j] - times[i])
            pairs += 1
    slope, middle = median(rises, pairs), middle / n
    for k in range(n):
        rises[k] = values[k] = values[k] - slope * times[k]
        lever += (times[k] - middle) ** 2
    offset = median(rises, n)
    for k in range(n):
        values[k] = abs(values[k] - offset)
    spread = 1.4826 * median(values, n) * np.sqrt(n / (n - 2))
    # A median needs pi/2 times as many samples as a mean for the same variance.
    return slope, np.sqrt(np.pi / 2) * spread / max(np.sqrt(lever), 1e-9)


@compiled
def binned(times: Floats, values: Floats, bins: int, moments: Floats, means: Floats) -> int:
    """Means of neighbouring samples, so that a fit over all pairs stays cheap.

    Args:
        times: (T,) seconds, increasing.
        values: (T,) any unit; NaN where there is no sample.
        bins: Most bins.
        moments: (bins,) output: mean times of equal numbers of neighbours; the newest bin is full.
        means: (bins,) output: mean values, NaN where a whole bin has no sample.

    Returns:
        The number of means.
    """
    size = max(1, (len(times) + bins - 1) // bins)
    count, begin, end = 0, 0, len(times) % size
    if end == 0:
        end = size
    while begin < len(times):
        moment = total = 0.0
        known = 0
        for k in range(begin, end):
            moment += times[k]
            if np.isfinite(values[k]):
                total += values[k]
                known += 1
        moments[count] = moment / (end - begin)
        means[count] = total / known if known else np.nan
        count += 1
        begin, end = end, end + size
    return count


@compiled
def binned_trends(times: Floats, values: Floats, bins: int) -> tuple[Floats, Floats]:
    """Slopes of lines through binned samples (T, N) and their deviations, (N,) each; see `theil_sen`."""
    count = values.shape[1]
    slope, sigma, series = np.empty(count), np.empty(count), np.empty(len(times))
    moments, means, rises = np.empty(bins), np.empty(bins), np.empty(bins * bins)
    for k in range(count):
        for t in range(len(times)):
            series[t] = values[t, k]
        found = binned(times, series, bins, moments, means)
        slope[k], sigma[k] = theil_sen(moments, means, found, rises)
    return slope, sigma


@compiled
def slope_noise(times: Floats, noise: float) -> float:
    """Standard deviation of a slope from samples (T,) of this noise; NaN for fewer than two."""
    count = len(times)
    if count < 2:
        return np.nan
    middle = lever = 0.0
    for k in range(count):
        middle += times[k]
    middle /= count
    for k in range(count):
        lever += (times[k] - middle) ** 2
    return float(noise / np.sqrt(lever))


@compiled
def _reach_slope(
    times: Floats, support: Floats, free: Flags, span: tuple[int, int], at: tuple[int, int]
) -> tuple[float, bool]:
    """Slope of one body's support in one direction over a span of samples, and whether it is known."""
    begin, end = span
    i, k = at
    middle, count = 0.0, 0
    for t in range(begin, end):
        if free[t, i, k] and np.isfinite(support[t, i, k]):
            middle += times[t]
            count += 1
    if count < max(4.0, 0.5 * (end - begin)):
        return 0.0, False
    middle /= count
    rise = lever = 0.0
    for t in range(begin, end):
        if free[t, i, k] and np.isfinite(support[t, i, k]):
            off = times[t] - middle
            rise += off * support[t, i, k]
            lever += off * off
    return rise / max(lever, 1e-12), True


@compiled
def common_motion(
    slopes: Floats, usable: Flags, directions: Floats, misfit: float
) -> tuple[float, float]:
    """The velocity that best explains the changes of an outline's support.

    A body moving by v changes its support in direction n by v . n; v is fitted over the directions by
    iteratively reweighted least squares (L1 norm), so that a hidden side or a rotating corner has
    little influence.

    Args:
        slopes: (K,) pixels per second.
        usable: (K,) whether each is known.
        directions: (K, 2) unit vectors.
        misfit: Tolerated mean deviation of the directions from a common motion, pixels per second; a
            third of the speed is tolerated in any case.

    Returns:
        (x, y) pixels per second; NaN with fewer than three usable directions, or where the outline does
        not move as one, as when one body passes in front of another.
    """
    count = 0
    for k in range(len(slopes)):
        count += usable[k]
    if count < 3:
        return np.nan, np.nan
    weight, vx, vy, wrong = np.ones(len(slopes)), 0.0, 0.0, 0.0
    for _ in range(5):
        xx = yy = 1e-9
        xy = bx = by = wrong = 0.0
        for k in range(len(slopes)):
            if usable[k]:
                nx, ny = directions[k, 0], directions[k, 1]
                wx, wy = weight[k] * nx, weight[k] * ny
                xx, xy, yy = xx + wx * nx, xy + wx * ny, yy + wy * ny
                bx, by = bx + wx * slopes[k], by + wy * slopes[k]
        determinant = xx * yy - xy * xy
        vx, vy = (yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant
        for k in range(len(slopes)):
            if usable[k]:
                off = abs(slopes[k] - (vx * directions[k, 0] + vy * directions[k, 1]))
                weight[k] = 1.0 / max(off, 0.3)
                wrong += off
    if wrong / count <= max(misfit, np.hypot(vx, vy) / 3.0):
        return vx, vy
    return np.nan, np.nan


@compiled
def velocities(
    times: Floats,
    samples: Samples,
    spans: NDArray[np.int64],
    directions: Floats,
    limits: tuple[float, float, float],
) -> Floats:
    """Velocities of all bodies over spans of samples.

    Args:
        times: (T,) seconds.
        samples: Support (T, M, K), pixels; whether it is free (T, M, K); and the image motion of each
            region, pixels per second, and its deviation (T, M, 3); NaN unknown.
        spans: (S, 2) first sample and last + 1.
        directions: (K, 2) unit vectors.
        limits: Misfit, see `common_motion`; noise of an outline, pixels; least difference of two
            velocities, pixels per second.

    Returns:
        (S, M, 2) pixels per second; NaN unknown.
    """
    misfit, noise, least = limits
    support, free, image = samples
    count = support.shape[1]
    found = np.empty((len(spans), count, 2))
    slopes = np.empty(len(directions))
    usable = np.empty(len(directions), np.bool_)
    for s in range(len(spans)):
        span = spans[s, 0], spans[s, 1]
        for i in range(count):
            for k in range(len(directions)):
                slopes[k], usable[k] = _reach_slope(times, support, free, span, (i, k))
            outline = common_motion(slopes, usable, directions, misfit)
            seen = image_velocity(times, image, span, i)
            near = max(least, COVERED_SIGMAS * slope_noise(times[span[0] : span[1]], noise))
            found[s, i] = uncovered_motion(slopes, usable, directions, (outline, seen), near)
    return found
