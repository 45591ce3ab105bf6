"""Compiled loops of `relative_motion.py`: velocity along a path of positions."""

from __future__ import annotations

import numpy as np

from visup.compiled import compiled
from visup.rules.smoothing.hysteresis import Floats


@compiled
def first_recent(path: Floats, now: float, window: float, least: int) -> int:
    """Index of the first position of a path within the current window.

    Args:
        path: (N, 6); see `fused_velocity`.
        now: Current time, seconds.
        window: Length of the window, seconds; longer where gaps leave too few positions in it.
        least: Fewest positions.
    """
    count = len(path)
    inside = long = 0
    for n in range(count):
        inside += path[n, 0] > now - window - 1e-6
        long += path[n, 0] > path[count - 1, 0] - 0.6 * window + 1e-6
    return max(0, count - max(inside, long + 1, least))


@compiled
def _noise(path: Floats) -> tuple[float, float, float]:
    """Covariance (xx, xy, yy) of the noise of positions, squared pixels.

    Steps between neighbouring positions differ from those at the mean velocity by noise; its correlated part
    is assumed equally large.
    """
    count = len(path)
    steps = max(count - 1, 1)
    xx = xy = yy = 0.0
    lasted = max(path[count - 1, 0] - path[0, 0], 1e-9)
    mean_x = (path[count - 1, 1] - path[0, 1]) / lasted
    mean_y = (path[count - 1, 2] - path[0, 2]) / lasted
    for n in range(count - 1):
        dt = path[n + 1, 0] - path[n, 0]
        dx = path[n + 1, 1] - path[n, 1] - mean_x * dt
        dy = path[n + 1, 2] - path[n, 2] - mean_y * dt
        xx, xy, yy = xx + dx * dx, xy + dx * dy, yy + dy * dy
    return xx / steps + 1e-4, xy / steps, yy / steps + 1e-4


@compiled
def fused_velocity(path: Floats, begin: int, lasts: float) -> tuple[Floats, Floats]:
    """The velocity by linear regression of positions, fused with the mean of velocities by precision.

    Args:
        path: (N, 6) of time, position (x, y), velocity (x, y) and its variance; see `RelativeTrack.path`.
        begin: The first position that counts; earlier ones only serve to estimate noise.
        lasts: Correlation time of velocity errors, seconds.

    Returns:
        (2,) velocity, pixels per second, and (2, 2) its covariance.
    """
    count = len(path)
    xx, xy, yy = _noise(path)
    middle = 0.0
    for n in range(begin, count):
        middle += path[n, 0]
    middle /= count - begin
    lever = sx = sy = 0.0
    for n in range(begin, count):
        t = path[n, 0] - middle
        lever, sx, sy = lever + t * t, sx + t * path[n, 1], sy + t * path[n, 2]
    lever = max(lever, 1e-9)
    sx, sy, xx, xy, yy = sx / lever, sy / lever, xx / lever, xy / lever, yy / lever
    vx = vy = variance = 0.0
    known = 0
    for n in range(begin, count):
        if np.isfinite(path[n, 5]):
            vx, vy, variance = vx + path[n, 3], vy + path[n, 4], variance + path[n, 5]
            known += 1
    if not known:
        return np.array((sx, sy)), np.array(((xx, xy), (xy, yy)))
    vx, vy, variance = vx / known, vy / known, variance / known
    sure = max(1.0, (path[count - 1, 0] - path[begin, 0]) / lasts) / variance
    determinant = xx * yy - xy * xy
    px, pxy, py = yy / determinant, -xy / determinant, xx / determinant
    bx, by = px * sx + pxy * sy + sure * vx, pxy * sx + py * sy + sure * vy
    px, py = px + sure, py + sure
    determinant = px * py - pxy * pxy
    xx, xy, yy = py / determinant, -pxy / determinant, px / determinant
    return np.array((xx * bx + xy * by, xy * bx + yy * by)), np.array(((xx, xy), (xy, yy)))
