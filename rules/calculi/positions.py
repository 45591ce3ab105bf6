"""Positions of points: cardinal directions, named distances, movement, three points (TPCC)."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, degrees, hypot

from visup.rules.calculi.qtc import Point

CARDINAL = ("e", "ne", "n", "nw", "w", "sw", "s", "se")
SECTOR = 45.0


def cardinal(a: Point, b: Point) -> str:
    """Direction of a from b, y up: eight sectors of 45 degrees, or `eq` (Frank 1996)."""
    x, y = a[0] - b[0], a[1] - b[1]
    if x == y == 0.0:
        return "eq"
    return CARDINAL[int((degrees(atan2(y, x)) + SECTOR / 2) // SECTOR) % 8]


def argd(a: Point, b: Point, limits: Mapping[str, float]) -> str:
    """Named distance: the first name whose limit is not less than the distance; the last beyond."""
    distance = hypot(a[0] - b[0], a[1] - b[1])
    ordered = sorted(limits, key=lambda name: limits[name])
    return next((n for n in ordered if distance <= limits[n]), ordered[-1])


def moving_or_stationary(before: Point, now: Point, slack: float = 0.0) -> str:
    """`m` when a point moved by more than `slack`, else `s`."""
    return "m" if hypot(now[0] - before[0], now[1] - before[1]) > slack else "s"


def tpcc(origin: Point, relatum: Point, referent: Point) -> str:
    """Position of the referent relative to the line from origin to relatum (Moratz and others 2003).

    Returns:
        `sam` (at the relatum), `dou` (at the origin), `tri` (relatum and origin coincide), or two parts:
        `c` closer to the relatum than the origin is, `d` not; then straight (`s`) back, front, left,
        right, or one of eight sectors between, such as `lf` (left, rather front).
    """
    if origin == relatum:
        return "tri" if referent == relatum else "dou"
    if referent == relatum:
        return "sam"
    ahead = (relatum[0] - origin[0], relatum[1] - origin[1])
    there = (referent[0] - relatum[0], referent[1] - relatum[1])
    near = "c" if hypot(*there) < hypot(*ahead) else "d"
    across = ahead[0] * there[1] - ahead[1] * there[0]
    along = ahead[0] * there[0] + ahead[1] * there[1]
    if across == 0.0:
        return near + ("sf" if along > 0 else "sb")
    side = "l" if across > 0 else "r"
    if along == 0.0:
        return f"{near}s{side}"
    end = "f" if along > 0 else "b"
    return near + (side + end if abs(across) > abs(along) else end + side)
