"""Compiled loops: qualitative states of all pairs from measurements, pair by pair.

The calculi are explained in `rcc8.py`, `direction.py`, `distance.py`, `qtc.py` and `trend.py`, the thresholds
in `thresholds.py`. There is one function of one pair per question; NaN is unknown, and every comparison with
it fails.
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

    A sign begins beyond `enter` and ends within `leave`. An unknown one is decided at the mean of the
    two, so that noise must cross half of the band to change it, wherever in the band the quantity is.
    A quantity inside the band that had the other sign has crossed zero and has no sign.

    Args:
        values: (R, P); NaN unknown.
        before: (R, P) previous signs, `BELOW`, `WITHIN`, `ABOVE` or `UNKNOWN`.
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
    """The same for a speed: an unknown one is at rest until it exceeds `enter`."""
    return sign_with_hysteresis(speed, WITHIN if before == UNKNOWN else before, enter, leave)


@compiled
def beyond(value: float, least: float, share: float) -> float:
    """The greater of a bound and a number of standard deviations; NaN when unknown."""
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
    """One of the eight differences of `edge_differences`."""
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
    """Differences of the edges of all pairs of boxes.

    Args:
        boxes: (M, 4) float: x, y, width, height, pixels.

    Returns:
        (8, P) pixels, for each pair (a, b) and each axis x, y: start of a minus start of b; end of b
        minus end of a; end of b minus start of a; end of a minus start of b.
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
    """Distances between all pairs of boxes; negative for overlap.

    Args:
        boxes: (M, 4) x, y, width, height, pixels.

    Returns:
        (P,) pixels: between the nearest points of separate boxes; for overlapping ones, minus the least
        translation along an axis that separates them.
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
    """Direction of one position from another, by cones.

    Args:
        dx: Offset to the right, pixels; NaN unknown.
        dy: Offset down, pixels.
        before: Previous code.
        place: Distances below which two coincide, and above which they no longer do, pixels.
        slack: Tolerance beyond the edge of the cone of a direction, radians.
        noise: Standard deviation of a coordinate, pixels; four of them are tolerated, too.

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
    """The class of a distance.

    Args:
        gap: Pixels; NaN unknown.
        size: Size of the two, pixels.
        before: Previous code.
        slack: Tolerance beyond the end of the current class, as a share of the limit.
        noise: Standard deviation of an edge, pixels; four are tolerated, too.

    Returns:
        Code into `CLASS_NAMES`.
    """
    if np.isnan(gap):
        return UNKNOWN
    code = 0
    for k in range(len(LIMITS)):
        limit = LIMITS[k] * size
        band = 0.0 if before == UNKNOWN else max(slack * limit, 4.0 * noise)
        # The band extends into the other class: the lower one lasts up to limit + band.
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
    """Velocity components of each of two points away from the other, and to its right.

    Args:
        places: (M, 2) points, pixels, y down.
        velocities: (M, 2) pixels per second.
        i: The first.
        j: The second.

    Returns:
        Pixels per second: of the first and the second away from the other (negative: towards it), then
        of the first and the second to the right of the line from itself to the other (negative: to the
        left); 0 for coinciding points, NaN for unknown. And the length of the line, pixels.
    """
    x, y = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
    length = np.sqrt(x * x + y * y)
    scale = 1.0 / max(length, 1e-12)
    x, y = x * scale, y * scale
    ux, uy = velocities[i, 0], velocities[i, 1]
    vx, vy = velocities[j, 0], velocities[j, 1]
    # With y down, a positive cross product is to the right; for the second, the line runs the other
    # way.
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
    """Classify order of edges, direction, distance and movements of all pairs of boxes.

    Args:
        before: (R, P) previous codes, of which those of `thresholds.py` come first.
        boxes: (M, 4) x, y, width, height, pixels; NaN for bodies out of view.
        velocities: (M, 2) of their centres, pixels per second; NaN unknown.
        spread: (M,) standard deviation of a component.
        limits: See `thresholds.limits`.
        codes: (R, P) output: codes of the current measurement, the rows of `thresholds.py`.
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
            # The line between the centres is noisy too, the more so the shorter it is.
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
