"""Dumb twins of the relations: straight from the definitions, and plain NumPy without thresholds."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from visup.rules.geometry.regions import Floats

Box = tuple[int, ...]
Cells = set[tuple[int, int]]


def rcc8_by_definition(a: Box, b: Box) -> str:
    """RCC-8 from interiors and boundaries of closed boxes, point by point on a half-pixel grid.

    Args:
        a: (x, y, width, height), whole numbers.
        b: Another.

    Returns:
        What a is to b, one of the names of `RCC8`.
    """
    (whole_a, inner_a), (whole_b, inner_b) = _points(a), _points(b)
    if not whole_a & whole_b:
        return "disconnected"
    if not inner_a & inner_b:
        return "externally_connected"
    if whole_a == whole_b:
        return "equal"
    if whole_a <= whole_b:
        return ("non_" if whole_a <= inner_b else "") + "tangential_proper_part"
    if whole_b <= whole_a:
        return ("non_" if whole_b <= inner_a else "") + "tangential_proper_part_inverse"
    return "partially_overlapping"


def _points(box: Box) -> tuple[Cells, Cells]:
    x, y, w, h = (2 * v for v in box)
    whole = {(i, j) for i in range(x, x + w + 1) for j in range(y, y + h + 1)}
    return whole, {(i, j) for i, j in whole if x < i < x + w and y < j < y + h}


def qtc_by_definition(places: NDArray[np.int_], velocities: NDArray[np.int_]) -> str:
    """QTC-C of two points on straight lines, by comparing distances a moment before and after.

    Van de Weghe 2004: k moves towards l (-) when just before it was farther from where l is now,
    and just after it is nearer; away (+) the other way round; else 0. It moves to the left (-) or
    right (+) of the line from k to l by where it is just after.

    Args:
        places: (2, 2) whole numbers, y down; two points apart from each other.
        velocities: (2, 2) whole numbers.

    Returns:
        Four signs.
    """
    points = [[Fraction(int(v)) for v in p] for p in places]
    steps = [[Fraction(int(v), 10**6) for v in p] for p in velocities]
    towards, sides = "", ""
    for k, other in ((0, 1), (1, 0)):
        here, there = points[k], points[other]
        before = [p - s for p, s in zip(here, steps[k], strict=True)]
        after = [p + s for p, s in zip(here, steps[k], strict=True)]
        d0, d1, d2 = (_squared(p, there) for p in (before, here, after))
        towards += "-" if d0 > d1 > d2 else "+" if d0 < d1 < d2 else "0"
        x, y = there[0] - here[0], there[1] - here[1]
        turn = x * (after[1] - here[1]) - y * (after[0] - here[0])
        sides += "-" if turn < 0 else "+" if turn > 0 else "0"
    return towards + sides


def _squared(a: list[Fraction], b: list[Fraction]) -> Fraction:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2


def plain_relations(before: Floats, now: Floats, seconds: float) -> tuple[Floats, ...]:
    """RCC-8, QTC-B, distance and approach of all pairs of two frames, and nothing against noise.

    Args:
        before: (M, 4) x, y, width, height, pixels, one frame earlier.
        now: (M, 4) the same now.
        seconds: Between the two.

    Returns:
        (M, M) RCC-8 codes, (M, M) movement of each towards (-1) or away from (1) the other,
        (M, M) distance of the boxes, pixels, (M, M) its rate, pixels per second.
    """
    low, high = now[:, :2], now[:, :2] + now[:, 2:]
    over = (np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])).min(2)
    start, end = low[:, None] - low[None], high[None] - high[:, None]
    inside, strictly = (np.minimum(start, end) >= 0).all(2), (np.minimum(start, end) > 0).all(2)
    code = np.where(over > 0, 2.0, np.where(over == 0, 1.0, 0.0))
    code = np.where(inside, np.where(strictly, 5.0, 4.0), code)
    code = np.where(inside.T, np.where(strictly.T, 7.0, 6.0), code)
    code = np.where(inside & inside.T, 3.0, code)
    was, place = before[:, :2] + before[:, 2:] / 2, now[:, :2] + now[:, 2:] / 2
    line = place[None] - place[:, None]
    towards = -np.sign(((place - was)[:, None] * line).sum(2))
    distance = _distance(now)
    return code, towards, distance, (distance - _distance(before)) / seconds


def _distance(boxes: Floats) -> Floats:
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    apart = np.maximum(np.maximum(low[:, None] - high[None], low[None] - high[:, None]), 0.0)
    distance: Floats = np.sqrt((apart * apart).sum(2))
    return distance
