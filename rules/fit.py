"""Robust linear fits over time, for many quantities at once."""

from __future__ import annotations

from functools import lru_cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from visup.rules.geometry import DIRECTIONS
from visup.rules.pairs import pairs

Floats = NDArray[np.float64]


def theil_sen(times: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Slope of a line through samples, by the median of the slopes of all pairs of samples.

    Up to 29 % of the samples may be wild without moving it far (Theil 1950, Sen 1968).

    Args:
        times: (T,) seconds, increasing.
        values: (T, N) any unit; NaN where there is no sample.

    Returns:
        Slope and its standard deviation, both (N,), in units per second; NaN where fewer than four
        samples stand. The deviation comes from the spread of the residuals (their median absolute
        deviation) as if they were independent, so that it is too small for slow wobbles.
    """
    valid = np.isfinite(values)
    if len(times) >= 4 and valid.all():
        off = times - times.sum() / len(times)
        return _line(times, values, len(times), sqrt((off * off).sum()))
    count = valid.sum(axis=0)
    enough = count >= 4
    slope = np.full(values.shape[1], np.nan)
    sigma = np.full(values.shape[1], np.nan)
    if not enough.any():
        return slope, sigma
    count, valid = count[enough], valid[:, enough]
    middle = (valid * times[:, None]).sum(axis=0) / count
    lever = np.sqrt((valid * (times[:, None] - middle) ** 2).sum(axis=0))
    slope[enough], sigma[enough] = _line(times, values[:, enough], count, lever)
    return slope, sigma


def _line(
    times: Floats, values: Floats, count: int | NDArray[np.intp], lever: float | Floats
) -> tuple[Floats, Floats]:
    first, second = pairs(len(times))
    rows = np.ascontiguousarray(values.T)
    rises = rows.take(second, axis=1)
    rises -= rows.take(first, axis=1)
    rises /= times[second] - times[first]
    slope = _medians(rises)
    rows -= slope[:, None] * times
    rows -= _medians(rows)[:, None]
    spread = 1.4826 * _medians(np.abs(rows)) * np.sqrt(count / (count - 2))
    # Medians need pi/2 times as many samples as means for the same variance of their result.
    return slope, np.sqrt(np.pi / 2) * spread / np.maximum(lever, 1e-9)


def slope_noise(times: Floats, noise: float) -> float:
    """Standard deviation of the slope of a line through samples of that noise at these times.

    Args:
        times: (T,) seconds.
        noise: Standard deviation of a sample, any unit.

    Returns:
        In units per second; NaN for fewer than two samples.
    """
    if len(times) < 2:
        return float("nan")
    lever = times - times.sum() / len(times)
    return noise / sqrt((lever * lever).sum())


def binned(times: Floats, values: Floats, bins: int) -> tuple[Floats, Floats]:
    """Means of neighbouring samples, so that a fit over all pairs of them stays cheap.

    Args:
        times: (T,) seconds, increasing.
        values: (T, N) any unit; NaN where there is no sample.
        bins: Most samples wanted.

    Returns:
        Times and values of at most `bins` means of equally many neighbours; the newest bin is full,
        the oldest may not be. NaN where a whole bin has no sample.
    """
    size = -(-len(times) // bins)
    if size <= 1:
        return times, values
    edges, sizes = _bins(len(times), size)
    known = np.isfinite(values)
    if known.all():
        means = np.add.reduceat(values, edges, axis=0) / sizes[:, None]
        return np.add.reduceat(times, edges) / sizes, means
    count = np.add.reduceat(known, edges, axis=0, dtype=float)
    total = np.add.reduceat(np.where(known, values, 0.0), edges, axis=0)
    means = np.where(count > 0, total / np.maximum(count, 1.0), np.nan)
    return np.add.reduceat(times, edges) / sizes, means


@lru_cache(maxsize=256)
def _bins(count: int, size: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First sample and size of each bin; the oldest may not be full."""
    edges = np.arange(count % size if count % size else size, count, size)
    edges = np.concatenate([[0], edges])
    return edges, np.diff(np.append(edges, count))


def nanmedian(values: Floats) -> Floats:
    """Median along the first axis with NaN left out; much quicker than NumPy's, and without noise.

    Args:
        values: (T, N) float.

    Returns:
        (N,) float; NaN for columns without a value.
    """
    return _medians(np.ascontiguousarray(values.T))


def _medians(rows: Floats) -> Floats:
    """Median of each row of (N, T), in memory row by row, since those are sorted soonest."""
    ordered = np.sort(rows, axis=1)  # NaN goes last
    most = rows.shape[1]
    last = ordered[:, -1] if most else ordered
    if most and not (last != last).any():  # NaN is not equal to itself
        middle: Floats = ordered[:, (most - 1) // 2] + ordered[:, most // 2]
        middle *= 0.5
        return middle
    count = np.isfinite(ordered).sum(axis=1)
    row = np.arange(len(rows))
    low = ordered[row, np.maximum((count - 1) // 2, 0)]
    high = ordered[row, np.minimum(count // 2, most - 1)]
    return np.where(count > 0, 0.5 * (low + high), np.nan)


def velocity(
    times: Floats, support: Floats, free: NDArray[np.bool_], misfit: float = np.inf
) -> Floats:
    """Velocity of bodies from how their outlines' reach changes.

    A body that moves by v changes its reach in direction n by v . n; a line is fitted over time in
    each direction and v over the directions, robustly (iteratively reweighted least squares, one
    norm), so that a hidden side or a turning corner has little say. Directions in which the
    outline ends at the image border take no part.

    Args:
        times: (T,) seconds.
        support: (T, M, 16) pixels, NaN where a body is not seen.
        free: (T, M, 16) bool, clear of the border.
        misfit: Mean deviation of the directions from a common motion, pixels per second, up to
            which the outline is believed to move as one; a third of the speed is allowed anyway.

    Returns:
        (M, 2) pixels per second; NaN where fewer than four samples or three directions serve, or
        where the outline does not move as one, as when one body passes before another.
    """
    slopes, usable = reach_slopes(times, support, free)
    return common_motion(slopes, usable, misfit)


def reach_slopes(
    times: Floats, support: Floats, free: NDArray[np.bool_]
) -> tuple[Floats, NDArray[np.bool_]]:
    """How fast outlines' reach changes: (M, 16) pixels per second, and where that is known.

    Args:
        times: (T,) seconds.
        support: (T, M, 16) pixels, NaN where a body is not seen.
        free: (T, M, 16) bool, clear of the border.
    """
    return slopes_of_spans(times, support, free, (slice(None),))


def slopes_of_spans(
    times: Floats, support: Floats, free: NDArray[np.bool_], spans: tuple[slice, ...]
) -> tuple[Floats, NDArray[np.bool_]]:
    """The same as `reach_slopes` of several spans of samples, one after another: (K M, 16) each."""
    good = np.isfinite(support) & free
    if not good.all():
        return _slopes(times, np.where(good, support, 0.0), good, spans)
    fits = [_full_slopes(times[p], support[p]) for p in spans]
    if len(fits) == 1:
        return fits[0]
    return np.concatenate([s for s, _ in fits]), np.concatenate([u for _, u in fits])


def _full_slopes(times: Floats, support: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Of samples none of which is missing."""
    shape = support.shape[1:]
    if len(times) < 4:
        return np.zeros(shape), np.zeros(shape, dtype=bool)
    centred = times - times.mean()
    weights = centred / max(float((centred**2).sum()), 1e-12)
    slopes = weights @ support.reshape(len(times), -1)
    return slopes.reshape(shape), np.ones(shape, dtype=bool)


def _slopes(
    times: Floats, values: Floats, good: NDArray[np.bool_], spans: tuple[slice, ...]
) -> tuple[Floats, NDArray[np.bool_]]:
    """All spans in one pass: the samples outside of a span count as missing in it."""
    inside = np.zeros((len(spans), len(times), 1, 1), dtype=bool)
    for k, span in enumerate(spans):
        inside[k, span] = True
    good, moments = good & inside, times[:, None, None]
    count = good.sum(axis=1)
    usable = count >= np.maximum(4.0, 0.5 * inside.sum(axis=1))
    middle = (good * moments).sum(axis=1) / np.maximum(count, 1)
    offset = moments - middle[:, None]
    offset *= good
    slopes = (offset * values).sum(axis=1)
    offset *= offset
    slopes /= np.maximum(offset.sum(axis=1), 1e-12)
    shape = (-1, values.shape[2])
    return slopes.reshape(shape), usable.reshape(shape)


_X, _Y = DIRECTIONS.T
_SQUARES = np.stack([_X * _X, _X * _Y, _Y * _Y], axis=1)
_RIDGE = np.array([1e-9, 0.0, 1e-9])
_ACROSS = np.ascontiguousarray(DIRECTIONS.T)


def common_motion(slopes: Floats, usable: NDArray[np.bool_], misfit: float = np.inf) -> Floats:
    """The velocity that explains best how the reach of outlines changes; see `velocity`.

    Args:
        slopes: (M, 16) pixels per second.
        usable: (M, 16) bool.
        misfit: As of `velocity`.

    Returns:
        (M, 2) pixels per second; NaN where nothing explains it.
    """
    used = usable.astype(float)
    weight = used
    count = usable.sum(axis=1)
    for _ in range(5):
        # Normal equations of two unknowns, solved by hand for all bodies at once.
        xx, xy, yy = (weight @ _SQUARES + _RIDGE).T
        sides = ((weight * slopes) @ DIRECTIONS).T
        found = np.array((yy, xx)) * sides
        found -= xy * sides[::-1]
        found /= xx * yy - xy * xy
        off = np.abs(slopes - found.T @ _ACROSS)
        weight = used / np.maximum(off, 0.3)
    mean_off = (off * used).sum(axis=1) / np.maximum(count, 1)
    as_one = mean_off <= np.maximum(misfit, np.hypot(*found) / 3.0)
    return np.where((count >= 3) & as_one, found, np.nan).T
