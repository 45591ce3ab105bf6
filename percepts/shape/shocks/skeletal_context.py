"""What a shape looks like from a place on its skeleton.

Around a place, the shape's area is counted by how far away it lies along the skeleton and in which
direction, as seen by one who stands there and looks outwards. Sources: shape contexts (Belongie, Malik
and Puzicha, 2002), taken from skeleton points as in skeletal contexts (Xie, Heng and Shah, Shape
Matching and Modeling Using Skeletal Context, 2008), with distances within the shape so that a bent
limb looks as a straight one does (Ling and Jacobs, Shape Classification Using the Inner-Distance,
2007). Ours: the distance runs along the skeleton alone; left and right are folded onto each other, so
that a mirror image looks the same; thin parts count for more than their area.

Read next: `shock_graph.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.shocks.skeleton import Skeleton

RINGS = 5
ANGLES = 14
CONTEXT = RINGS * ANGLES
"""Cells of a context: rings of distance, evenly spaced in its logarithm, times angles."""

NEAREST = 0.1
FARTHEST = 2.0
"""Distances at the middle of the first and of the last ring, units."""

THINNESS = 0.7
"""Area counts by the thickness there to minus this: 0 is area, 1 is length of skeleton."""

SAME_PLACE = 1e-9  # what is nearer along a branch is the same place, but for rounding


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonPlaces:
    """Places on a skeleton.

    Attributes:
        branch: (N,) intp, the branch on which each lies.
        offset: (N,) float64, how far along the branch.
    """

    branch: NDArray[np.intp]
    offset: NDArray[np.float64]


class SkeletonTree:
    """A skeleton with lengths along it.

    Args:
        skeleton: A connected tree of branches, or a single point.

    Attributes:
        radii: (V,) radius at each point of the branches, one branch after another.
        points: (V, 2) their positions.
        places: Where on the branches they lie.
        lengths: (B,) lengths of the branches; one of length 0 for a single point.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        branches = skeleton.branches or (np.zeros(1, dtype=np.intp),)
        sizes = np.array([len(b) for b in branches])
        numbers = np.concatenate(branches)
        branch = np.repeat(np.arange(len(branches)), sizes)
        self.points, self.radii = skeleton.points[numbers], skeleton.radii[numbers]
        steps = np.hypot(*np.diff(self.points, axis=0, prepend=self.points[:1]).T)
        firsts = np.cumsum(sizes) - sizes
        steps[firsts] = 0.0
        along = np.cumsum(steps)
        self.places = SkeletonPlaces(branch, along - along[firsts][branch])
        self.lengths = self.places.offset[firsts + sizes - 1]
        ends = np.stack([numbers[firsts], numbers[firsts + sizes - 1]], axis=1)
        meeting, numbered = np.unique(ends, return_inverse=True)
        self._ends = numbered.reshape(-1, 2)
        self._between = _distances(self._ends, self.lengths, len(meeting))
        # Branches laid end to end with gaps, so that one interpolation serves all of them.
        self._starts = np.cumsum(self.lengths + 1.0) - self.lengths
        self._along = self._starts[branch] + self.places.offset

    def offsets(self, branch: int) -> NDArray[np.float64]:
        """Length along a branch at each of its points."""
        return np.asarray(self.places.offset[self.places.branch == branch])

    def radii_at(
        self, branch: NDArray[np.intp], offset: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Radii at places; arrays that broadcast to a common shape, which is the result's."""
        return np.asarray(np.interp(self._starts[branch] + offset, self._along, self.radii))

    def points_at(
        self, branch: NDArray[np.intp], offset: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Positions of places, (..., 2)."""
        at = self._starts[branch] + offset
        xy = [np.interp(at, self._along, self.points[:, k]) for k in (0, 1)]
        return np.stack(xy, axis=-1)

    def ways(
        self, here: SkeletonPlaces, there: SkeletonPlaces
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Ways along the skeleton from N places to M others.

        Returns:
            (N, M) lengths of the ways; and (N, M) whether each sets out towards the end of its
            branch.
        """
        first, last = self._ends[there.branch].T
        rest = self.lengths[there.branch] - there.offset
        sides = []
        for side, out in ((0, here.offset), (1, self.lengths[here.branch] - here.offset)):
            reach = self._between[self._ends[here.branch, side]]
            nearer = np.minimum(reach[:, first] + there.offset, reach[:, last] + rest)
            sides.append(nearer + out[:, None])
        same = here.branch[:, None] == there.branch[None]
        step = there.offset[None] - here.offset[:, None]
        length = np.where(same, np.abs(step), np.minimum(*sides))
        return length, np.where(same, step > SAME_PLACE, sides[1] < sides[0])


def _distances(
    ends: NDArray[np.intp], lengths: NDArray[np.float64], size: int
) -> NDArray[np.float64]:
    """Lengths of the ways between all ends of branches of a tree, (size, size)."""
    between = np.zeros((size, size))
    known, todo = [int(ends[0, 0])], list(range(len(ends)))
    while todo:
        k = next(k for k in todo if ends[k, 0] in known or ends[k, 1] in known)
        todo.remove(k)
        a, b = (int(e) for e in ends[k])
        old, new = (a, b) if a in known else (b, a)
        between[new, known] = between[known, new] = between[old, known] + lengths[k]
        if new != old:
            known.append(new)
            between[new, new] = 0.0
    return between


def directed_contexts(
    area: NDArray[np.float64],
    thickness: NDArray[np.float64],
    ways: NDArray[np.float64],
    positions: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """How much of a shape lies how far and in which direction from each of some places.

    Args:
        area: (P, 2) points evenly spread over the shape.
        thickness: (P,) radius of the shape's disc that each point lies in.
        ways: (N, P) distance along the skeleton from each place to each point.
        positions: (N, 2) the places.
        directions: (N, 2) unit vectors in which one looks there; (0, 0) sees all straight ahead.

    Returns:
        (N, CONTEXT), rows sum to 1; a point counts for the cells around it by how near their middles
        lie, so that little changes when it moves a little.
    """
    dx = area[:, 0] - positions[:, :1]
    dy = area[:, 1] - positions[:, 1:]
    ahead = dx * directions[:, :1] + dy * directions[:, 1:]
    aside = np.abs(dy * directions[:, :1] - dx * directions[:, 1:])
    angle = np.arctan2(aside, ahead) * ((ANGLES - 1) / np.pi)
    ring, angle_low = _rings(ways), np.minimum(angle.astype(np.intp), ANGLES - 2)
    ring_low = np.minimum(ring.astype(np.intp), RINGS - 2)
    far, turned = ring - ring_low, angle - angle_low
    mass = thickness**-THINNESS
    mass = mass / mass.sum()
    cell = ring_low * ANGLES + angle_low + np.arange(len(positions))[:, None] * CONTEXT
    out = np.zeros(len(positions) * CONTEXT)
    outer, inner = far * mass, (1 - far) * mass
    for step, part in ((0, inner), (ANGLES, outer)):
        beyond = part * turned
        for further, weight in ((0, part - beyond), (1, beyond)):
            flat = (cell + (step + further)).ravel()
            out += np.bincount(flat, weights=weight.ravel(), minlength=len(out))
    return out.reshape(len(positions), CONTEXT)


def whole_context(area: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a shape looks like from its centroid, whichever way one looks.

    The area in each ring of distance as a function of the angle, by the magnitudes of its first
    Fourier coefficients: these stay when the shape is turned or mirrored (generic Fourier
    descriptors; Zhang and Lu, 2002).

    Args:
        area: (P, 2) points evenly spread over the shape.

    Returns:
        (CONTEXT,), the coefficients of order 0 summing to 1; what is not needed stays 0.

    Example:
        All of a disc lies alike in every direction: orders 1 and above are all but zero.

        >>> y, x = np.mgrid[-20:21, -20:21] / 35
        >>> disc = np.stack([x, y], axis=-1)[np.hypot(x, y) < 0.5]
        >>> seen = whole_context(disc)[: RINGS * (ANGLES // 2)].reshape(RINGS, -1)
        >>> float(seen[:, 0].sum().round(6)), bool((seen[:, 1:4] < 0.01).all())
        (1.0, True)
    """
    x, y = (area - area.mean(axis=0)).T
    distance = np.hypot(x, y)
    share = np.maximum(0.0, 1.0 - np.abs(_rings(distance) - np.arange(RINGS)[:, None]))
    turn = (x + 1j * y) / np.maximum(distance, 1e-9)
    orders = ANGLES // 2
    waves = np.cumprod([np.ones_like(turn), *[turn] * (orders - 1)], axis=0)
    out = np.zeros(CONTEXT)
    out[: RINGS * orders] = np.abs(share @ waves.T).ravel() / len(area)
    return out


def _rings(distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Ring in which each distance lies, as a number from 0 to RINGS - 1 with a fraction."""
    scale = (RINGS - 1) / np.log(FARTHEST / NEAREST)
    ring = np.log(np.maximum(distance, NEAREST) / NEAREST) * scale
    return np.asarray(np.minimum(ring, RINGS - 1.0))
