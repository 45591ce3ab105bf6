"""Qualitative states of all pairs from what is measured, compiled: one pair after another.

The calculi are explained in `rcc8.py`, `direction.py`, `distance.py`, `qtc.py` and `trend.py`, the
thresholds in `thresholds.py`. Every question has one function of one pair; NaN is unknown, and every
comparison with it fails.
"""

from __future__ import annotations

import numpy as np

from visup.compiled import compiled
from visup.rules.relations.direction import AT_PLACE
from visup.rules.relations.distance import LIMITS
from visup.rules.smoothing.hysteresis import ABOVE, BELOW, UNKNOWN, WITHIN, Codes, Floats


@compiled
def sign_with_hysteresis(value: float, before: int, enter: float, leave: float) -> int:
    """The sign of one quantity, with hysteresis; see `signs_with_hysteresis`."""
    if np.isnan(value):
        return UNKNOWN
    code, size = ABOVE if value > 0.0 else BELOW, abs(value)
    held = size > 0.5 * (enter + leave) if before == UNKNOWN else code == before
    return code if (held and size > leave) or size > enter else WITHIN


@compiled
def signs_with_hysteresis(values: Floats, before: Codes, enter: float, leave: float) -> Codes:
    """The signs of quantities, with hysteresis (a Schmitt trigger on either side of zero).

    A sign begins beyond `enter` and ends within `leave`. One that is not known yet is judged by the
    middle of the two, so that noise must cross half of the band to change it, wherever in the band
    the quantity may lie. What is in the band but was on the other side of zero has crossed it: no sign.

    Args:
        values: (R, P); NaN unknown.
        before: (R, P) signs so far, `BELOW`, `WITHIN`, `ABOVE` or `UNKNOWN`.
        enter: Magnitude beyond which a quantity has a sign.
        leave: Magnitude within which it has none; at most `enter`.

    Returns:
        (R, P) signs; `UNKNOWN` for NaN.
    """
    codes = np.empty(values.shape, np.int8)
    for row in range(len(values)):
        for k in range(values.shape[1]):
            codes[row, k] = sign_with_hysteresis(values[row, k], before[row, k], enter, leave)
    return codes


@compiled
def moving_sign(speed: float, before: int, enter: float, leave: float) -> int:
    """The same of a speed: what is not known yet is at rest until the speed exceeds `enter`."""
    return sign_with_hysteresis(speed, WITHIN if before == UNKNOWN else before, enter, leave)


@compiled
def beyond(value: float, least: float, share: float) -> float:
    """The greater of a bound and of so many deviations; NaN when these are not known."""
    return least if share * value <= least else share * value


@compiled
def moving_signs(
    speeds: Floats, sigma: Floats, before: Codes, limits: tuple[float, float, float, float]
) -> Codes:
    """(P,) signs of speeds; limits as the last four of `thresholds.limits`."""
    enter, leave, sure, still = limits
    codes = np.empty(len(speeds), np.int8)
    for k in range(len(speeds)):
        codes[k] = moving_sign(
            speeds[k], before[k], beyond(sigma[k], enter, sure), beyond(sigma[k], leave, still)
        )
    return codes


@compiled
def difference(boxes: Floats, i: int, j: int, row: int) -> float:
    """One of the eight of `edge_differences`."""
    axis = row % 2
    a, b = boxes[i, axis], boxes[j, axis]
    if row < 2:
        return float(a - b)
    if row < 4:
        return float((b + boxes[j, 2 + axis]) - (a + boxes[i, 2 + axis]))
    if row < 6:
        return float((b + boxes[j, 2 + axis]) - a)
    return float((a + boxes[i, 2 + axis]) - b)


@compiled
def edge_differences(boxes: Floats) -> Floats:
    """How the edges of all pairs of boxes stand to each other.

    Args:
        boxes: (M, 4) float: x, y, width, height, pixels.

    Returns:
        (8, P) pixels, for each pair (a, b) and each axis x, y: start of a after that of b; end of b
        after that of a; end of b after the start of a; end of a after the start of b.
    """
    count, number = len(boxes), 0
    apart = np.empty((8, count * (count - 1) // 2))
    for i in range(count):
        for j in range(i + 1, count):
            for row in range(8):
                apart[row, number] = difference(boxes, i, j, row)
            number += 1
    return apart


@compiled
def box_gap(boxes: Floats, i: int, j: int) -> float:
    """Distance between two boxes, pixels; see `box_gaps`."""
    x, y, left, top = boxes[i, 0], boxes[i, 1], boxes[j, 0], boxes[j, 1]
    dx = max(x - (left + boxes[j, 2]), left - (x + boxes[i, 2]))
    dy = max(y - (top + boxes[j, 3]), top - (y + boxes[i, 3]))
    if np.isnan(dx + dy):
        return np.nan
    if dx <= 0.0 and dy <= 0.0:
        return float(max(dx, dy))
    dx, dy = max(dx, 0.0), max(dy, 0.0)
    return float(np.sqrt(dx * dx + dy * dy))


@compiled
def box_gaps(boxes: Floats) -> Floats:
    """Distances between all pairs of boxes, negative the depth of their overlap.

    Args:
        boxes: (M, 4) x, y, width, height, pixels.

    Returns:
        (P,) pixels: between the nearest points where boxes are apart; where they overlap, minus
        how far one must be moved along an axis to part them.
    """
    count, number = len(boxes), 0
    gaps = np.empty(count * (count - 1) // 2)
    for i in range(count):
        for j in range(i + 1, count):
            gaps[number] = box_gap(boxes, i, j)
            number += 1
    return gaps


@compiled
def direction(
    dx: float, dy: float, before: int, place: tuple[float, float], slack: float, noise: float
) -> int:
    """Direction of one place as seen from another, by cones.

    Args:
        dx: How far to the right the one lies, pixels; NaN unknown.
        dy: How far down.
        before: Code so far.
        place: Distances within which two come to one place, and beyond which they leave it, pixels.
        slack: How far beyond the edge of its cone a direction is kept, radians.
        noise: Standard deviation of a coordinate, pixels; four of them are allowed, too.

    Returns:
        Code into `DIRECTION_NAMES`.
    """
    length = np.sqrt(dx * dx + dy * dy)
    if np.isnan(length):
        return UNKNOWN
    near, far = place
    directed = before >= 0 and before < AT_PLACE
    limit = near if directed else far if before == AT_PLACE else 0.5 * (near + far)
    if length <= limit:
        return AT_PLACE
    angle, cone = np.arctan2(dy, dx), np.pi / 4.0
    if directed:
        off = abs((angle - before * cone + np.pi) % (2.0 * np.pi) - np.pi)
        if off <= 0.5 * cone + max(slack, 4.0 * np.sqrt(2.0) * noise / max(length, 1e-9)):
            return before
    return int(np.rint(angle / cone) % 8.0)


@compiled
def distance_class(gap: float, size: float, before: int, slack: float, noise: float) -> int:
    """Class of one distance.

    Args:
        gap: Pixels; NaN unknown.
        size: Of the two, pixels.
        before: Code so far.
        slack: How far beyond the end of its class a distance keeps it, share of the limit.
        noise: Standard deviation of an edge, pixels; four are allowed, too.

    Returns:
        Code into `CLASS_NAMES`.
    """
    if np.isnan(gap):
        return UNKNOWN
    code = 0
    for k in range(len(LIMITS)):
        limit = LIMITS[k] * size
        band = 0.0 if before == UNKNOWN else max(slack * limit, 4.0 * noise)
        # The band lies towards the other class: what is below is held up to limit + band.
        code += gap > limit + (-band if before > k else band)
    return code


@compiled
def size_of(boxes: Floats, i: int, j: int) -> float:
    """Size of two boxes: the geometric mean of the roots of their areas, pixels, at least one."""
    one, other = max(boxes[i, 2] * boxes[i, 3], 1.0), max(boxes[j, 2] * boxes[j, 3], 1.0)
    return float(one**0.25 * other**0.25)


@compiled
def components(
    places: Floats, velocities: Floats, i: int, j: int
) -> tuple[float, float, float, float, float]:
    """How fast each of two moves away from the other's place, and across to its right.

    Args:
        places: (M, 2) points, pixels, y down.
        velocities: (M, 2) pixels per second.
        i: The first.
        j: The second.

    Returns:
        Pixels per second: of the first and of the second away from the other (negative: towards it),
        then of the first and of the second to the right of the line from itself to the other (negative:
        to the left); 0 where two points coincide, NaN where unknown. And the length of the line, pixels.
    """
    x, y = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
    length = np.sqrt(x * x + y * y)
    scale = 1.0 / max(length, 1e-12)
    x, y = x * scale, y * scale
    ux, uy = velocities[i, 0], velocities[i, 1]
    vx, vy = velocities[j, 0], velocities[j, 1]
    # With y down, a positive cross product turns to the right; seen from the second, the line
    # runs the other way.
    return -(ux * x + uy * y), vx * x + vy * y, x * uy - y * ux, y * vx - x * vy, length


@compiled
def classify_boxes(
    before: Codes,
    boxes: Floats,
    velocities: Floats,
    spread: Floats,
    limits: tuple[float, float, float, float, float, float, float, float, float, float, float],
    codes: Codes,
) -> None:
    """Order of edges, direction, class of distance and movements of all pairs of boxes.

    Args:
        before: (R, P) codes so far, of which those of `thresholds.py` come first.
        boxes: (M, 4) x, y, width, height, pixels; NaN for what is not seen.
        velocities: (M, 2) of their centres, pixels per second; NaN unknown.
        spread: (M,) standard deviation of a component.
        limits: See `thresholds.limits`.
        codes: (R, P) written: what is wanted now, the rows of `thresholds.py`.
    """
    level, level_out, near, far, cone, noise, slack, enter, leave, sure, still = limits
    count, number = len(boxes), -1
    places = boxes[:, :2] + 0.5 * boxes[:, 2:]
    for i in range(count):
        for j in range(i + 1, count):
            number += 1
            for row in range(8):
                apart = difference(boxes, i, j, row)
                codes[row, number] = sign_with_hysteresis(
                    apart, before[row, number], level, level_out
                )
            dx, dy = places[i, 0] - places[j, 0], places[i, 1] - places[j, 1]
            codes[8, number] = direction(dx, dy, before[8, number], (near, far), cone, noise)
            gap, size = box_gap(boxes, i, j), size_of(boxes, i, j)
            codes[9, number] = distance_class(gap, size, before[9, number], slack, noise)
            speeds = components(places, velocities, i, j)
            # The line between the places is noisy too, the more so the shorter it is.
            turn = 2.0 * noise**2 / max(speeds[4] * speeds[4], 1.0)
            for k in range(4):
                one = j if k % 2 else i
                pace = velocities[one, 0] ** 2 + velocities[one, 1] ** 2
                sigma = np.sqrt(spread[one] ** 2 + pace * turn)
                codes[10 + k, number] = moving_sign(
                    speeds[k],
                    before[10 + k, number],
                    beyond(sigma, enter, sure),
                    beyond(sigma, leave, still),
                )
