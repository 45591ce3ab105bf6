"""Compiled loops of `interpretation_tree.py`: extending paths by one level."""

from __future__ import annotations

from math import acos, atan2, hypot, isnan, nan, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
NONE = -1
"""In a path: no hypothesis chosen at this level; as a view: none chosen yet."""
_SMALL = 1e-12


@compiled
def rotate(rate: Floats, seconds: float, matrix: Floats, out: Floats) -> None:
    """Rotate a (3, 3) matrix at a rate (3,), radians per second (Rodrigues)."""
    x, y, z = rate[0] * seconds, rate[1] * seconds, rate[2] * seconds
    angle = sqrt(x * x + y * y + z * z)
    first = sin(angle) / angle if angle > _SMALL else 1.0
    half = sin(angle / 2) / (angle / 2) if angle > _SMALL else 1.0
    second = 0.5 * half * half
    for k in range(3):
        a, b, c = matrix[0, k], matrix[1, k], matrix[2, k]
        # The cross product with the rotation vector, applied once and twice.
        p, q, r = y * c - z * b, z * a - x * c, x * b - y * a
        out[0, k] = a + first * p + second * (y * r - z * q)
        out[1, k] = b + first * q + second * (z * p - x * r)
        out[2, k] = c + first * r + second * (x * q - y * p)


@compiled
def rotation_cost(
    one: Floats, other: Floats, roll_counts: bool, swing_is: float, roll_is: float
) -> float:
    """Half the squares of swing and roll between two orientations; NaN when one is unknown.

    Args:
        one: (3, 3) model to camera.
        other: The same.
        roll_counts: Whether the roll is known.
        swing_is: Standard deviation of the swing, radians.
        roll_is: Standard deviation of the roll, radians.
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


class TreeCosts(NamedTuple):
    """The costs of choices at one level.

    Attributes:
        time: Seconds.
        weight: Weight of the level.
        wrong: Cost of calling all hypotheses wrong.
        jump: Greatest cost of a rotation.
        other_view: Cost of another view where directions are unknown.
        swing: Standard deviation of the swing of an object at rest, radians.
        roll: The same in the plane.
        rate_sigma: Standard deviation of the rate, radians per second.
        most_paths: Most paths retained.
    """

    time: float
    weight: float
    wrong: float
    jump: float
    other_view: float
    swing: float
    roll: float
    rate_sigma: float
    most_paths: int


class Paths(NamedTuple):
    """The paths of a tree, each by its current end; see `InterpretationTree`."""

    cost: Floats
    views: Ints
    chosen: Floats
    since: Floats
    orientation: Floats
    rolled: Bools
    path: NDArray[np.int8]


class Choices(NamedTuple):
    """The hypotheses of a level, possibly none; see `TreeLevel`."""

    views: Ints
    orientation: Floats
    rolled: Bools
    cost: Floats


@compiled
def turn_costs(costs: TreeCosts, paths: Paths, level: Choices, rate: Floats) -> Floats:
    """Costs (S, H) of choosing each hypothesis of a level after each path's last choice.

    Args:
        costs: Costs of the level.
        paths: The paths before it.
        level: Its hypotheses.
        rate: (3,) radians per second.
    """
    cost = np.zeros((len(paths.chosen), len(level.views)))
    before = np.empty((3, 3))
    for i in range(len(paths.chosen)):
        if paths.views[i] == NONE:
            continue
        seconds = costs.time - paths.chosen[i]
        swing_is = hypot(costs.swing, costs.rate_sigma * seconds)
        roll_is = hypot(costs.roll, costs.rate_sigma * seconds)
        rotate(rate, seconds, paths.orientation[i], before)
        for k in range(len(level.views)):
            both = paths.rolled[i] and level.rolled[k]
            apart = rotation_cost(before, level.orientation[k], both, swing_is, roll_is)
            if isnan(apart):
                cost[i, k] = 0.0 if paths.views[i] == level.views[k] else costs.other_view
            else:
                cost[i, k] = min(apart, costs.jump)
    return cost


@compiled
def _cheapest_parents(
    costs: TreeCosts, paths: Paths, level: Choices, rate: Floats
) -> tuple[Ints, Floats]:
    """(H + S,) the parent of each new path, and the new path's cost.

    The first H choose a hypothesis, the others none.
    """
    turns = turn_costs(costs, paths, level, rate)
    fresh, old = len(level.views), len(paths.cost)
    parent, every = np.zeros(fresh + old, np.int64), np.empty(fresh + old)
    for k in range(fresh):
        least = paths.cost[0] + turns[0, k]
        for i in range(1, old):
            through = paths.cost[i] + turns[i, k]
            if through < least:
                least, parent[k] = through, i
        every[k] = least + costs.weight * level.cost[k]
    for i in range(old):
        parent[fresh + i], every[fresh + i] = i, paths.cost[i] + costs.weight * costs.wrong
    return parent, every


@compiled
def extend_paths(
    costs: TreeCosts, paths: Paths, level: Choices, rate: Floats
) -> tuple[Paths, float]:
    """Extend the paths by one level; cheapest first, without those that cannot become cheapest.

    Args:
        costs: Costs of the level.
        paths: The paths before it.
        level: Its hypotheses.
        rate: (3,) radians per second.

    Returns:
        The new paths, and the increase of the cheapest cost.
    """
    parent, every = _cheapest_parents(costs, paths, level, rate)
    order = np.argsort(every, kind="mergesort")
    cheapest, fresh, count = every[order[0]], len(level.views), 0
    most = min(len(order), costs.most_paths)
    while count < most and every[order[count]] <= cheapest + costs.jump:
        count += 1
    chosen = order[:count]
    parents = parent[chosen]
    new = Paths(
        every[chosen] - cheapest,
        paths.views[parents],
        paths.chosen[parents],
        paths.since[parents],
        paths.orientation[parents],
        paths.rolled[parents],
        np.full((count, paths.path.shape[1]), NONE, np.int8),
    )
    for n in range(count):
        k = chosen[n]
        new.path[n, :-1] = paths.path[parents[n], 1:]
        if k < fresh:
            if new.views[n] != level.views[k]:
                new.since[n] = costs.time
            new.views[n], new.chosen[n], new.path[n, -1] = level.views[k], costs.time, k
            new.orientation[n], new.rolled[n] = level.orientation[k], level.rolled[k]
    return new, cheapest
