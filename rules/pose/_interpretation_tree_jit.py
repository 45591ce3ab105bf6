"""One level more of an interpretation tree, compiled; `interpretation_tree.py` says what it is for."""

from __future__ import annotations

from math import acos, atan2, hypot, isnan, nan, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
NONE = -1
"""In a path: no hypothesis is chosen at this level; as a view: none was chosen yet."""
_SMALL = 1e-12


@compiled
def rotate(rate: Floats, seconds: float, matrix: Floats, out: Floats) -> None:
    """What a (3, 3) matrix becomes after a turn at a rate (3,), radians per second (Rodrigues)."""
    x, y, z = rate[0] * seconds, rate[1] * seconds, rate[2] * seconds
    angle = sqrt(x * x + y * y + z * z)
    first = sin(angle) / angle if angle > _SMALL else 1.0
    half = sin(angle / 2) / (angle / 2) if angle > _SMALL else 1.0
    second = 0.5 * half * half
    for k in range(3):
        a, b, c = matrix[0, k], matrix[1, k], matrix[2, k]
        # The cross product with the vector, once and twice.
        p, q, r = y * c - z * b, z * a - x * c, x * b - y * a
        out[0, k] = a + first * p + second * (y * r - z * q)
        out[1, k] = b + first * q + second * (z * p - x * r)
        out[2, k] = c + first * r + second * (x * q - y * p)


@compiled
def rotation_cost(
    one: Floats, other: Floats, roll_counts: bool, swing_is: float, roll_is: float
) -> float:
    """Half the squares of swing and roll between two orientations; NaN where one is not known.

    Args:
        one: (3, 3) model to camera.
        other: The same.
        roll_counts: Whether the roll is known.
        swing_is: Radians that count as one standard deviation.
        roll_is: The same of the roll.
    """
    m22 = m10 = m01 = m00 = m11 = 0.0
    for k in range(3):
        m22 += other[2, k] * one[2, k]
        m10 += other[1, k] * one[0, k]
        m01 += other[0, k] * one[1, k]
        m00 += other[0, k] * one[0, k]
        m11 += other[1, k] * one[1, k]
    if isnan(m22 + m10 + m01 + m00 + m11):
        return nan
    swing = acos(min(1.0, max(-1.0, m22))) / swing_is
    roll = atan2(m10 - m01, m00 + m11) / roll_is if roll_counts else 0.0
    return 0.5 * (swing * swing + roll * roll)


@compiled
def turn_costs(
    numbers: Floats,
    chosen: Floats,
    view: Ints,
    orientation: Floats,
    rolled: Bools,
    level_view: Ints,
    level_orientation: Floats,
    level_rolled: Bools,
    rate: Floats,
) -> Floats:
    """Costs (S, H) of choosing each hypothesis of a level after what each path chose last.

    Args:
        numbers: As of `extend_paths`.
        chosen: (S,) of the tree, as are the following up to `rolled`.
        view: (S,).
        orientation: (S, 3, 3).
        rolled: (S,).
        level_view: (H,) of the level, as are the following.
        level_orientation: (H, 3, 3).
        level_rolled: (H,).
        rate: (3,) radians per second.
    """
    time, jump, other_view = numbers[0], numbers[3], numbers[4]
    cost = np.zeros((len(chosen), len(level_view)))
    before = np.empty((3, 3))
    for i in range(len(chosen)):
        if view[i] == NONE:
            continue
        seconds = time - chosen[i]
        swing_is = hypot(numbers[5], numbers[7] * seconds)
        roll_is = hypot(numbers[6], numbers[7] * seconds)
        rotate(rate, seconds, orientation[i], before)
        for k in range(len(level_view)):
            both = rolled[i] and level_rolled[k]
            apart = rotation_cost(before, level_orientation[k], both, swing_is, roll_is)
            if isnan(apart):
                cost[i, k] = 0.0 if view[i] == level_view[k] else other_view
            else:
                cost[i, k] = min(apart, jump)
    return cost


@compiled
def extend_paths(
    numbers: Floats,
    cost: Floats,
    view: Ints,
    chosen: Floats,
    since: Floats,
    orientation: Floats,
    rolled: Bools,
    path: NDArray[np.int8],
    level_view: Ints,
    level_orientation: Floats,
    level_rolled: Bools,
    level_cost: Floats,
    rate: Floats,
) -> tuple[Floats, Ints, Floats, Floats, Floats, Bools, NDArray[np.int8], float]:
    """The paths after one level more, cheapest first, without those that cannot become cheapest.

    Args:
        numbers: (9,) time, weight of the level, cost of calling all wrong, greatest cost of a turn,
            cost of another view, radians of swing and of roll, standard deviation of the rate
            (radians per second), most paths.
        cost: (S,) of the tree, as are the following up to `path`.
        view: (S,).
        chosen: (S,).
        since: (S,).
        orientation: (S, 3, 3).
        rolled: (S,).
        path: (S, L).
        level_view: (H,) of the level, as are the following; H is 0 where nothing was hypothesised.
        level_orientation: (H, 3, 3).
        level_rolled: (H,).
        level_cost: (H,).
        rate: (3,) radians per second.

    Returns:
        `cost` to `path` of the new tree, and what its cheapest path costs more than that before.
    """
    time, weight, wrong, jump = numbers[0], numbers[1], numbers[2], numbers[3]
    paths, fresh = len(cost), len(level_view)
    between_them = turn_costs(
        numbers,
        chosen,
        view,
        orientation,
        rolled,
        level_view,
        level_orientation,
        level_rolled,
        rate,
    )
    parent = np.zeros(fresh + paths, np.int64)
    every = np.empty(fresh + paths)
    for k in range(fresh):
        least = cost[0] + between_them[0, k]
        for i in range(1, paths):
            through = cost[i] + between_them[i, k]
            if through < least:
                least, parent[k] = through, i
        every[k] = least + weight * level_cost[k]
    for i in range(paths):
        parent[fresh + i], every[fresh + i] = i, cost[i] + weight * wrong
    order = np.argsort(every, kind="mergesort")
    cheapest = every[order[0]]
    count = 0
    while count < min(len(order), int(numbers[8])) and every[order[count]] <= cheapest + jump:
        count += 1
    new_cost, new_view = np.empty(count), np.empty(count, np.int64)
    new_chosen, new_since = np.empty(count), np.empty(count)
    new_orientation, new_rolled = np.empty((count, 3, 3)), np.empty(count, np.bool_)
    lag = path.shape[1]
    new_path = np.empty((count, lag), np.int8)
    for n in range(count):
        k = order[n]
        i = parent[k]
        new_cost[n] = every[k] - cheapest
        new_path[n, : lag - 1] = path[i, 1:]
        if k < fresh:
            new_view[n], new_chosen[n], new_rolled[n] = level_view[k], time, level_rolled[k]
            new_since[n] = since[i] if view[i] == level_view[k] else time
            new_orientation[n] = level_orientation[k]
            new_path[n, lag - 1] = k
        else:
            new_view[n], new_chosen[n], new_rolled[n] = view[i], chosen[i], rolled[i]
            new_since[n], new_orientation[n] = since[i], orientation[i]
            new_path[n, lag - 1] = NONE
    return (
        new_cost,
        new_view,
        new_chosen,
        new_since,
        new_orientation,
        new_rolled,
        new_path,
        cheapest,
    )
