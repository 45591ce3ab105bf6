"""Compiled fits of current motion, over the longest window consistent with it.

Steady motion is best estimated over a long window, a recent change only over a short one. The window is
chosen for each quantity separately (Lepski 1990): the longest whose estimate agrees with those of all shorter
ones, within their noise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.rules.geometry._fit_jit import (
    Floats,
    Samples,
    binned,
    slope_noise,
    theil_sen,
    velocities,
)


@compiled
def jitter(values: Floats) -> float:
    """Standard deviation of sample-to-sample noise (T,), whatever the trend.

    From the mean of second differences; NaN where fewer than three in a row are known. Noise that is
    correlated over several samples is not captured.
    """
    total, count = 0.0, 0
    for t in range(2, len(values)):
        bend = abs(values[t] - 2.0 * values[t - 1] + values[t - 2])
        if np.isfinite(bend):
            total += bend
            count += 1
    return total / count * np.sqrt(np.pi / 12.0) if count else np.nan


@compiled
def longest_that_agrees(found: Floats, sigmas: Floats, limits: tuple[float, float]) -> int:
    """The longest window whose estimate agrees with those of all shorter ones (Lepski 1990).

    Steady motion is thus estimated over a long window, and a recent change over a short one.

    Args:
        found: (W, D) estimates from longer and longer windows; NaN for unknown.
        sigmas: (W,) standard deviations of each component.
        limits: Least difference to disagree, in standard deviations and in the unit of the estimates.

    Returns:
        The number of the window; 0 when none is known.
    """
    far, least = limits
    best = -1
    for w in range(len(found)):
        if np.isnan(found[w, 0]):
            continue
        for u in range(w):
            off = 0.0
            for d in range(found.shape[1]):
                off += (found[w, d] - found[u, d]) ** 2
            if np.sqrt(off) > max(least, far * np.hypot(sigmas[w], sigmas[u])):
                return best
        best = w
    return max(best, 0)


@compiled
def steady_trend(
    times: Floats,
    values: Floats,
    begins: NDArray[np.int64],
    limits: tuple[float, float, float],
    room: Floats,
) -> tuple[float, float]:
    """Slope over the longest window consistent with the current trend.

    Args:
        times: (T,) seconds.
        values: (T,) pixels.
        begins: (W,) first samples of longer and longer windows.
        limits: Noise of a sample, pixels; then as in `longest_that_agrees`.
        room: (bins + 2, bins) scratch for binned samples and the slopes of their pairs.

    Returns:
        Pixels per second, and its standard deviation.
    """
    noise, far, least = limits
    bins, count = room.shape[1], len(begins)
    moments, means, rises = room[0], room[1], room[2:].reshape(-1)
    slopes, floors, spreads = np.empty((count, 1)), np.empty(count), np.empty(count)
    for w in range(count):
        begin = begins[w]
        found = binned(times[begin:], values[begin:], bins, moments, means)
        slopes[w, 0], spreads[w] = theil_sen(moments, means, found, rises)
        floors[w] = slope_noise(times[begin:], noise)
    w = longest_that_agrees(slopes, floors, (far, least))
    return slopes[w, 0], max(spreads[w], floors[w])


@compiled
def steady_velocities(
    times: Floats,
    samples: Samples,
    begins: NDArray[np.int64],
    directions: Floats,
    limits: tuple[float, float, float, float],
) -> tuple[Floats, Floats]:
    """Velocities over the longest windows consistent with the current motion.

    Args:
        times: (T,) seconds.
        samples: Of outlines and their image motion; see `velocities`.
        begins: (W,) first samples of longer and longer windows.
        directions: (K, 2) unit vectors.
        limits: Least noise of an outline, pixels; misfit, see `common_motion`; then as in
            `longest_that_agrees`.

    Returns:
        (M, 2) and (M,) the standard deviation of a component due to noise.
    """
    noise, misfit, far, least = limits
    support, last = samples[0], len(times)
    count = support.shape[1]
    spans = np.empty((len(begins), 2), np.int64)
    spans[:, 0], spans[:, 1] = begins, last
    trusted = misfit, noise, least
    found = velocities(times, samples, spans, directions, trusted)
    sigmas, chosen, spread = np.empty(len(begins)), np.empty((count, 2)), np.empty(count)
    for i in range(count):
        shaky, known = 0.0, 0
        for k in range(len(directions)):
            one = jitter(support[begins[-1] :, i, k])
            if np.isfinite(one):
                shaky, known = shaky + one, known + 1
        rough = max(noise, shaky / known) if known else noise
        for w in range(len(begins)):
            sigmas[w] = slope_noise(times[begins[w] :], rough)
        w = longest_that_agrees(found[:, i], sigmas, (far, least))
        chosen[i], spread[i] = found[w, i], sigmas[w]
    return chosen, spread


@compiled
def _windows(times: Floats, longest: float) -> NDArray[np.int64]:
    """First samples of three windows, each twice as long as the one before."""
    begins = np.empty(3, np.int64)
    for w in range(3):
        begins[w] = np.searchsorted(times, times[-1] - longest * 0.5 ** (2 - w) - 1e-6)
    return begins


MIN_SAMPLES = 6
MIN_SHARE = 0.3
"""Filled share of the window from which lines are fitted."""


@compiled
def fit_motion(
    times: Floats,
    outlines: Samples,
    separation: Floats,
    directions: Floats,
    limits: tuple[float, float, float, float, float, float],
    bins: int,
) -> tuple[Floats, Floats, Floats, Floats]:
    """All fits of one step.

    Args:
        times: (T,) seconds.
        outlines: Of outlines and their image motion relative to the static scene; see `velocities` and
            `SampleWindow`.
        separation: (T, M, M) pixels.
        directions: (K, 2) unit vectors.
        limits: The windows of trends and of motion, seconds; noise of an outline, pixels; difference
            beyond which earlier samples are dropped, pixels per second and in standard deviations;
            misfit, pixels per second.
        bins: Most bins to fit lines to.

    Returns:
        (P,) trends of the distances and (P,) their standard deviations; (3, M, 2) velocities now and in
        the halves of the motion window; (M,) standard deviations of a velocity component due to noise.
    """
    window, moving, noise, strong, sigmas, misfit = limits
    samples, count = len(times), outlines[0].shape[1]
    pairs = count * (count - 1) // 2
    slope, sigma = np.full(pairs, np.nan), np.full(pairs, np.nan)
    motion, spread = np.full((3, count, 2), np.nan), np.full(count, np.nan)
    if samples < MIN_SAMPLES or times[samples - 1] - times[0] < MIN_SHARE * window:
        return slope, sigma, motion, spread
    begins = _windows(times, moving)
    half = begins[-1] + (samples - begins[-1]) // 2
    spans = np.array([[begins[-1], half], [half, samples]])
    trusted = misfit, noise, strong
    motion[1:] = velocities(times, outlines, spans, directions, trusted)
    motion[0], spread = steady_velocities(
        times, outlines, begins, directions, (noise, misfit, sigmas, strong)
    )
    begins = _windows(times, window)
    series, room, number = np.empty(samples), np.empty((bins + 2, bins)), 0
    for i in range(count):
        for j in range(i + 1, count):
            for t in range(samples):
                series[t] = separation[t, i, j]
            rough = max(np.sqrt(2.0) * noise, jitter(series))
            for_trend = rough, sigmas, strong
            slope[number], sigma[number] = steady_trend(times, series, begins, for_trend, room)
            number += 1
    return slope, sigma, motion, spread
