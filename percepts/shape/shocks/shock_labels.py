"""Shocks: the four kinds of skeleton segment, classified by the change of radius along it.

After Siddiqi, Shokoufandeh, Dickinson and Zucker, Shock Graphs and Shape Matching (1999): along a
*protrusion* (1) the radius changes monotonically; at a *neck* (2) it has a minimum; along a *bend* (3) it is
constant; at a *seed* (4) it has a maximum. Changes smaller than a share of the radius are ignored, for
robustness to noise.

Read next: `shock_graph.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

TOLERANCE = 0.18
"""Share of the radius below which a change is ignored."""

MIN_SLOPE = 0.35
"""Change of the radius per length that counts on a branch too short to change by much."""

MIN_BEND = 1.5
"""Least length of a bend inside a longer branch, in radii."""


class ShockKind(IntEnum):
    """Kinds of shock, numbered as in the paper; the root of a shock graph is none of them."""

    ROOT = 0
    PROTRUSION = 1
    NECK = 2
    BEND = 3
    SEED = 4


@dataclass(frozen=True, slots=True)
class Shock:
    """A run of skeleton points of one kind.

    Attributes:
        kind: Protrusion, neck, bend or seed.
        start: Number of the first point within the branch.
        stop: Number of the last point, the same as `start` for necks and seeds.
    """

    kind: ShockKind
    start: int
    stop: int


def label_branch(
    radii: NDArray[np.float64], along: NDArray[np.float64], tolerance: float = TOLERANCE
) -> tuple[Shock, ...]:
    """Split one branch into shocks.

    Args:
        radii: (N,) radius at each point, N at least 2.
        along: (N,) length along the branch at each point, in the same unit.
        tolerance: Share of the radius below which a change is ignored.

    Returns:
        Shocks in order along the branch: runs that share their end points, with a neck or seed between
        two runs at an extremum of the radius; a neck that stays level for long is a bend.

    Example:
        >>> along = np.arange(5.0)
        >>> [s.kind.name for s in label_branch(np.array([1.0, 2, 3, 2, 1]), along)]
        ['PROTRUSION', 'SEED', 'PROTRUSION']
        >>> [s.kind.name for s in label_branch(np.array([3.0, 2, 1, 2, 3]), along)]
        ['PROTRUSION', 'NECK', 'PROTRUSION']
        >>> [s.kind.name for s in label_branch(np.array([1.0, 1, 1.01, 1, 1]), along)]
        ['BEND']
    """
    cuts = [0]
    between: list[list[Shock]] = []
    for k in turning_points(radii, tolerance):
        a, b = _level_neck(radii, along, k, tolerance) if radii[k] < radii[cuts[-1]] else (k, k)
        kind = (
            ShockKind.BEND
            if b > a
            else ShockKind.NECK
            if radii[k] < radii[cuts[-1]]
            else ShockKind.SEED
        )
        between.append([Shock(kind, a, b)])
        cuts += [a, b]
    cuts.append(len(radii) - 1)
    runs = [
        _split_run(radii, along, a, b, tolerance)
        for a, b in zip(cuts[::2], cuts[1::2], strict=True)
    ]
    return tuple(
        s for pair in zip(runs, [*between, []], strict=True) for part in pair for s in part
    )


def _level_neck(
    radii: NDArray[np.float64], along: NDArray[np.float64], k: int, tolerance: float
) -> tuple[int, int]:
    """The level stretch around a minimum if it is long enough for a bend, else the point."""
    level = radii <= radii[k] * (1 + 0.5 * tolerance)
    a = k - int(np.argmin(level[k::-1])) + 1 if not level[: k + 1].all() else 0
    b = k + int(np.argmin(level[k:])) - 1 if not level[k:].all() else len(radii) - 1
    return (a, b) if along[b] - along[a] >= MIN_BEND * radii[k] else (k, k)


def turning_points(radii: NDArray[np.float64], tolerance: float) -> list[int]:
    """Extrema of the radius deeper than the tolerance, inner points only.

    Args:
        radii: (N,) radius at each point.
        tolerance: Share of the greater radius by which it must return to count as an extremum.

    Returns:
        Numbers of local maxima and minima, alternating.

    Example:
        >>> turning_points(np.array([1.0, 2, 1.9, 2.1, 1, 3]), 0.2)
        [3, 4]
    """
    values = radii.tolist()
    turns: list[int] = []
    rising: bool | None = None
    high = low = 0
    for k, r in enumerate(values):
        high = k if r > values[high] else high
        low = k if r < values[low] else low
        if rising is not False and r < values[high] * (1 - tolerance):
            if rising:
                turns.append(high)
            rising, low = False, k
        elif rising is not True and r * (1 - tolerance) > values[low]:
            if rising is False:
                turns.append(low)
            rising, high = True, k
    return turns


def _split_run(
    radii: NDArray[np.float64], along: NDArray[np.float64], a: int, b: int, tolerance: float
) -> list[Shock]:
    """Split a monotonic run: one protrusion, one bend, or parts of both."""
    change, length = abs(radii[a] - radii[b]), along[b] - along[a]
    if change <= tolerance * max(radii[a], radii[b]) and change <= MIN_SLOPE * length:
        return [Shock(ShockKind.BEND, a, b)]
    c, d = _longest_level(radii, along, a, b, tolerance)
    if along[d] - along[c] < MIN_BEND * radii[c : d + 1].mean():
        return [Shock(ShockKind.PROTRUSION, a, b)]
    parts = [
        Shock(ShockKind.PROTRUSION, a, c),
        Shock(ShockKind.BEND, c, d),
        Shock(ShockKind.PROTRUSION, d, b),
    ]
    return [p for p in parts if p.stop > p.start]


def _longest_level(
    radii: NDArray[np.float64], along: NDArray[np.float64], a: int, b: int, tolerance: float
) -> tuple[int, int]:
    """The longest stretch within a run on which the radius stays within half the tolerance."""
    best, start = (a, a), a
    lows, highs = radii.tolist(), along.tolist()
    for stop in range(a, b + 1):
        while abs(lows[start] - lows[stop]) > 0.5 * tolerance * max(lows[start], lows[stop]):
            start += 1
        if highs[stop] - highs[start] > highs[best[1]] - highs[best[0]]:
            best = (start, stop)
    return best
