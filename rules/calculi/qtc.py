"""The qualitative trajectory calculus of two points (Van de Weghe 2004): basic, double cross, both.

The four signs: motion of k towards (-1) or away from (1) l's position, motion of l relative to k's position;
the side of the line from k to l to which k moves (-1 left, 1 right, with y up), and likewise for l.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

Point = tuple[float, float]
Signs = tuple[int, ...]
DIGITS = 9
"""Decimals to which movements are rounded, so that level motion gives 0."""


def qtc_step(k: tuple[Point, Point], ell: tuple[Point, Point], slack: float = 0.0) -> Signs:
    """QTC-C of a step of two points.

    Args:
        k: Its previous and current position.
        ell: The other point likewise.
        slack: Movement up to this counts as none, in the unit of the positions.

    Returns:
        Four signs; the first two of them are QTC-B.
    """
    (towards_k, side_k), (towards_l, side_l) = _moved(k, ell[0], slack), _moved(ell, k[0], slack)
    return towards_k, towards_l, side_k, side_l


def qtc_bc_step(
    k: tuple[Point, Point], ell: tuple[Point, Point], near: float, slack: float = 0.0
) -> Signs:
    """QTC-BC: the sides count only while the points are at most `near` apart."""
    signs = qtc_step(k, ell, slack)
    apart = hypot(k[1][0] - ell[1][0], k[1][1] - ell[1][1])
    return signs if apart <= near else signs[:2]


def collapsed(states: Sequence[Signs]) -> list[Signs]:
    """A sequence of states without repetitions."""
    return [s for n, s in enumerate(states) if n == 0 or s != states[n - 1]]


def continuous(states: Sequence[Signs]) -> list[Signs]:
    """Insert the states required by continuity: no sign changes from - to + without passing 0."""
    found: list[Signs] = []
    for state in states:
        if found:
            before = found[-1]
            shared = list(zip(before, state, strict=False))
            if any(p * s < 0 for p, s in shared):
                # When one sign passes 0, one that starts from 0 has not left it yet.
                between = tuple(s if p * s > 0 else 0 for p, s in shared)
                found.append(between + state[len(before) :])
        found.append(state)
    return found


def _moved(p: tuple[Point, Point], other: Point, slack: float) -> tuple[int, int]:
    """Motion of a point relative to another's position: towards or away, left or right."""
    (x0, y0), (x1, y1) = p
    line = (other[0] - x0, other[1] - y0)
    length = hypot(*line)
    if length == 0.0:
        return 0, 0  # coincident points define no line
    along = -((x1 - x0) * line[0] + (y1 - y0) * line[1]) / length
    across = -(line[0] * (y1 - y0) - line[1] * (x1 - x0)) / length
    return _sign(along, slack), _sign(across, slack)


def _sign(value: float, slack: float) -> int:
    value = round(value, DIGITS)
    return 0 if abs(value) <= slack else 1 if value > 0 else -1
