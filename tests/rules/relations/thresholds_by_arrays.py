"""Dumb twins of the compiled judgements: all pairs at once, in plain NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.rules.geometry.pairs import pairs
from visup.rules.relations.direction import AT_PLACE
from visup.rules.relations.distance import LIMITS
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.rcc8 import CONVERSE, DC, EC, EQ, NTPP, NTPPI, PO, TPP, TPPI
from visup.rules.relations.thresholds import Limits
from visup.rules.relations.trend import CONVERGING, DIVERGING, KEEPING
from visup.rules.smoothing.hysteresis import ABOVE, BELOW, UNKNOWN, WITHIN

Array = NDArray[np.generic]
Floats = NDArray[np.float64]


def signs(values: Floats, before: Array, enter: Array | float, leave: Array | float) -> Array:
    """Signs with hysteresis."""
    code, size = np.where(values > 0, ABOVE, BELOW), np.abs(values)
    middle = 0.5 * (np.asarray(enter, float) + np.asarray(leave, float))
    held = np.where(before == UNKNOWN, size > middle, before == code)
    code = np.where((held & (size > leave)) | (size > enter), code, WITHIN)
    return np.where(np.isnan(values), UNKNOWN, code)


def differences(boxes: Floats) -> Floats:
    """(8, P) of the edges of boxes."""
    i, j = pairs(len(boxes))
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    parts = (low[i] - low[j], high[j] - high[i], high[j] - low[i], high[i] - low[j])
    return np.concatenate([p.T for p in parts])


def gaps(apart: Floats) -> Floats:
    """(P,) signed distances of boxes from their `differences`."""
    along = -np.minimum(apart[4:6], apart[6:8])
    most = along.max(axis=0)
    far = np.hypot(*np.maximum(along, 0.0))
    return np.asarray(np.where(most <= 0.0, most, far))


def directions(
    places: Floats, before: Array, place: tuple[float, float], slack: float, noise: float
) -> Array:
    """(P,) cones."""
    i, j = pairs(len(places))
    dx, dy = (places[i] - places[j]).T
    length, angle, cone = np.hypot(dx, dy), np.arctan2(dy, dx), np.pi / 4
    off = np.abs((angle - before.astype(float) * cone + np.pi) % (2 * np.pi) - np.pi)
    directed = (before.astype(int) >= 0) & (before.astype(int) < AT_PLACE)
    wide = 0.5 * cone + np.maximum(slack, 4 * np.sqrt(2) * noise / np.maximum(length, 1e-9))
    code = np.where(directed & (off <= wide), before, np.rint(angle / cone) % 8)
    near, far = place
    limit = np.where(before == AT_PLACE, far, np.where(directed, near, 0.5 * (near + far)))
    code = np.where(length <= limit, AT_PLACE, code)
    return np.where(np.isnan(length), UNKNOWN, code)


def classes(gap: Floats, boxes: Floats, before: Array, slack: float, noise: float) -> Array:
    """(P,) classes of distance."""
    i, j = pairs(len(boxes))
    root = np.maximum(boxes[:, 2] * boxes[:, 3], 1.0) ** 0.25
    limit = np.array(LIMITS)[:, None] * root[i] * root[j]
    band = np.maximum(slack * limit, 4 * noise) * (before != UNKNOWN)
    number = np.arange(len(LIMITS))[:, None]
    code = (gap > limit + np.where(before.astype(int) > number, -band, band)).sum(axis=0)
    return np.where(np.isnan(gap), UNKNOWN, code)


def movements(
    places: Floats, velocities: Floats, spread: Floats, noise: float
) -> tuple[Floats, Floats]:
    """(4, P) speeds away and across, and their deviations."""
    i, j = pairs(len(places))
    x, y = (places[j] - places[i]).T
    length = np.hypot(x, y)
    x, y = x / np.maximum(length, 1e-12), y / np.maximum(length, 1e-12)
    (ux, uy), (vx, vy) = velocities[i].T, velocities[j].T
    speeds = np.array((-(ux * x + uy * y), vx * x + vy * y, x * uy - y * ux, y * vx - x * vy))
    turn = 2 * noise**2 / np.maximum(length * length, 1.0)
    pace, both = (velocities**2).sum(axis=1), np.array([i, j, i, j])
    return speeds, np.sqrt(spread[both] ** 2 + pace[both] * turn)


def judged(
    before: Array, boxes: Floats, velocities: Floats, spread: Floats, limits: Limits
) -> Array:
    """(14, P) as of `classify_boxes`."""
    level, level_out, near, far, cone, noise, slack, enter, leave, sure, still = limits
    apart, places = differences(boxes), boxes[:, :2] + 0.5 * boxes[:, 2:]
    speeds, sigma = movements(places, velocities, spread, noise)
    at_rest = np.where(before[10:14] == UNKNOWN, WITHIN, before[10:14])
    rows = (
        signs(apart, before[:8], level, level_out),
        directions(places, before[8], (near, far), cone, noise)[None],
        classes(gaps(apart), boxes, before[9], slack, noise)[None],
        signs(speeds, at_rest, np.maximum(enter, sure * sigma), np.maximum(leave, still * sigma)),
    )
    return np.concatenate(rows)


def trends(
    rate: Floats, sigma: Floats, sway: Floats, before: Array, pending: Array, depth: Array
) -> Array:
    """(P,) trends by rates of 1.6 and 0.8, or of what sways, by 3 and 2 deviations, joined with depth's."""
    sign = np.where(rate < 0, CONVERGING, DIVERGING)
    enter, leave = np.fmax(1.6, sway), np.fmax(np.fmax(0.8, sway), sigma)
    strong = np.abs(rate) > np.fmax(enter, np.where(pending == sign, 2.0, 3.0) * sigma)
    strong &= np.isfinite(sigma)
    goes_on = ((before == CONVERGING) & (rate <= 0)) | ((before == DIVERGING) & (rate >= 0))
    image = np.where(goes_on & (np.abs(rate) >= leave), before, KEEPING)
    image = np.where(strong, sign, image)
    image = np.where(np.isfinite(rate), image, UNKNOWN)
    against = (image == CONVERGING) & (depth == DIVERGING)
    against |= (image == DIVERGING) & (depth == CONVERGING)
    joined = np.where((image == KEEPING) & (depth != UNKNOWN), depth, image)
    return np.where(against & (depth != UNKNOWN), UNKNOWN, joined)


def limit(before: Array, enter: float, leave: float) -> Floats:
    """By which value a state is begun or kept."""
    middle = np.where(before == UNKNOWN, 0.5 * (enter + leave), enter)
    return np.asarray(np.where(before == 1, leave, middle))


def touches(gap: Floats, depth: Floats, before: Array) -> Array:
    """(P,) by gaps of 3 and 5 px, and not where depths are apart by a fifth, or a quarter."""
    i, j = pairs(len(depth))
    apart = np.abs(depth[i] - depth[j]) / np.minimum(depth[i], depth[j])
    code = np.where(gap <= limit(before, 3.0, 5.0), 1, 0)
    code = np.where(apart > limit(before, 0.2, 0.25), 0, code)
    return np.where(np.isnan(gap), UNKNOWN, code)


SWAY = 0.12


def together(now: Kinematics, before: Array) -> Array:
    """(P,) by relative speeds of 2 px/s, 4 in halves, half as much more and 0.7 while it goes on.

    Of what moves fast (8 px/s of late) the last half alone counts, and a share of the speed is rest.
    """
    i, j = pairs(len(now.speed))
    held = before == 1
    moves = np.minimum(now.speed[i], now.speed[j]) > 2 * 2.0 * np.where(held, 0.7, 1.0)
    wide = np.where(held, 1.5, 1.0)
    early, late = (np.hypot(*(v[i] - v[j]).T) for v in now.motion[1:])
    relative = now.relative_speed[i, j]
    rest = (np.maximum(early, late) < 4.0 * wide) & (relative < 2.0 * wide)
    slow = np.where(np.isnan(relative), UNKNOWN, rest & moves)
    latest = np.hypot(*now.motion[2].T)
    lately = np.minimum(latest[i], latest[j])
    fast = (lately > 4.0 * 2.0) & (late < np.maximum(4.0, SWAY * wide * lately))
    return np.where(fast, 1, slow)


def rcc8_of(order: Array) -> Array:
    """(P,) RCC-8 from the signs (8, P) of edges, case by case from the weakest to the strongest."""
    nested, overlap = order[:4].astype(int), order[4:].astype(int).min(axis=0)
    least, most = nested.min(axis=0), nested.max(axis=0)
    code = np.full(len(least), PO)
    code[least >= WITHIN] = TPP
    code[least == ABOVE] = NTPP
    code[most <= WITHIN] = TPPI
    code[most == BELOW] = NTPPI
    code[(least == WITHIN) & (most == WITHIN)] = EQ
    code[(overlap == WITHIN) & (code != EQ)] = EC
    code[overlap == BELOW] = DC
    code[np.minimum(overlap, least) == UNKNOWN] = UNKNOWN
    return code


def outlines_rcc8_of(order: Array) -> Array:
    """(P,) RCC-8 from the signs (3, P) of outlines, case by case from the weakest to the strongest."""
    apart, a_out, b_out = order.astype(int)
    code = np.full(len(apart), PO)
    code[apart == WITHIN] = EC
    code[b_out == WITHIN] = TPPI
    code[a_out == WITHIN] = TPP
    code[b_out == BELOW] = NTPPI
    code[a_out == BELOW] = NTPP
    code[(a_out <= WITHIN) & (b_out <= WITHIN)] = EQ
    code[apart == ABOVE] = DC
    code[order.astype(int).min(axis=0) == UNKNOWN] = UNKNOWN
    return code


def converse_of(code: Array) -> Array:
    """(P,) RCC-8 of the second to the first."""
    return np.asarray(CONVERSE[code.astype(int)])
