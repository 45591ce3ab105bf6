"""How things move now: lines over the longest window in which samples go on as they do now, compiled.

What has gone on for long is known best from a long window, and what has just changed only from a short one.
The window is chosen for each quantity by itself (Lepski 1990): it is the longest whose estimate agrees with
those of all shorter ones, within their noise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.rules.geometry._fit_jit import Flags, Floats, binned, slope_noise, theil_sen, velocities


@compiled
def jitter(values: Floats) -> float:
    """Deviation of the noise of samples (T,) from one to the next, however they go on in the long run.

    By the mean of their second differences; NaN where fewer than three in a row are known. Noise that
    lasts for several samples is not seen by it.
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

    What goes on as it did is so known from a long window, and what has just changed from a short one.

    Args:
        found: (W, D) estimates from longer and longer windows; NaN unknown.
        sigmas: (W,) deviations of each component.
        limits: In deviations, and in the unit of the estimates, by how much two must differ to disagree.

    Returns:
        The number of the window; that of the first that is known where no longer one is.
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
    """Slope over the longest window in which samples go on as they do now.

    Args:
        times: (T,) seconds.
        values: (T,) pixels.
        begins: (W,) first samples of longer and longer windows.
        limits: Noise of a sample, pixels; see `longest_that_agrees`.
        room: (bins + 2, bins) for the means to which lines are fitted, and the slopes of their pairs.

    Returns:
        Pixels per second, and its deviation.
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
    support: Floats,
    free: Flags,
    begins: NDArray[np.int64],
    directions: Floats,
    limits: tuple[float, float, float, float],
) -> tuple[Floats, Floats]:
    """Velocities over the longest windows in which bodies go on as they do now.

    Args:
        times: (T,) seconds.
        support: (T, M, K) pixels.
        free: (T, M, K).
        begins: (W,) first samples of longer and longer windows.
        directions: (K, 2) unit vectors.
        limits: Least noise of an outline, pixels; misfit, see `common_motion`; and see
            `longest_that_agrees`.

    Returns:
        (M, 2) and (M,) the deviation of a component that noise makes.
    """
    noise, misfit, far, least = limits
    count, samples = support.shape[1], len(times)
    spans = np.empty((len(begins), 2), np.int64)
    spans[:, 0], spans[:, 1] = begins, samples
    found = velocities(times, support, free, spans, directions, misfit)
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


LEAST_SAMPLES = 6
LEAST_SHARE = 0.3
"""Lines are fitted once so much of the window is filled."""


@compiled
def fit_motion(
    times: Floats,
    support: Floats,
    free: Flags,
    separation: Floats,
    directions: Floats,
    limits: tuple[float, float, float, float, float, float],
    bins: int,
) -> tuple[Floats, Floats, Floats, Floats]:
    """All lines of one step.

    Args:
        times: (T,) seconds.
        support: (T, M, K) pixels; see `SampleWindow`.
        free: (T, M, K).
        separation: (T, M, M) pixels.
        directions: (K, 2) unit vectors.
        limits: The windows of trends and of motion, seconds; noise of an outline, pixels; by how much
            what was must differ from what is, pixels per second, and in deviations, to count no longer;
            misfit, pixels per second.
        bins: Most means to which lines are fitted.

    Returns:
        (P,) trends of the distances and (P,) their deviations; (3, M, 2) velocities now and in the halves
        of the window of motion; (M,) deviations that noise makes of a component of a velocity.
    """
    window, moving, noise, strong, sigmas, misfit = limits
    samples, count = len(times), support.shape[1]
    pairs = count * (count - 1) // 2
    slope, sigma = np.full(pairs, np.nan), np.full(pairs, np.nan)
    motion, spread = np.full((3, count, 2), np.nan), np.full(count, np.nan)
    if samples < LEAST_SAMPLES or times[samples - 1] - times[0] < LEAST_SHARE * window:
        return slope, sigma, motion, spread
    begins = _windows(times, moving)
    half = begins[-1] + (samples - begins[-1]) // 2
    spans = np.array([[begins[-1], half], [half, samples]])
    motion[1:] = velocities(times, support, free, spans, directions, misfit)
    for_velocities = noise, misfit, sigmas, strong
    motion[0], spread = steady_velocities(times, support, free, begins, directions, for_velocities)
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
