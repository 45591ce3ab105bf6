"""Skeletal contexts: the shape as seen from a point of its skeleton.

The context of a point is a histogram of the shape's area over distance along the skeleton and direction
relative to the skeleton there. Sources: shape contexts (Belongie, Malik and Puzicha, 2002), taken at skeleton
points as in skeletal contexts (Xie, Heng and Shah, Shape Matching and Modeling Using Skeletal Context, 2008),
with distances within the shape so that a bent limb looks like a straight one (Ling and Jacobs, Shape
Classification Using the Inner-Distance, 2007). Different here: distance runs along the skeleton alone; left
and right are folded onto each other, so that a mirror image looks the same; thin parts count for more than
their area.

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
"""Distances at the middle of the first and the last ring, units."""

THINNESS = 0.7
"""Area is weighted by local thickness to the power of minus this: 0 gives area, 1 skeleton length."""

SAME_PLACE = 1e-9  # tolerance of offsets along a branch, for rounding


@dataclass(frozen=True, slots=True, eq=False)
class SkeletonPlaces:
    """Positions on a skeleton.

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
        places: Their positions on the branches.
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
        # Branches are laid end to end with gaps, so that one interpolation serves all.
        self._starts = np.cumsum(self.lengths + 1.0) - self.lengths
        self._along = self._starts[branch] + self.places.offset

    def offsets(self, branch: int) -> NDArray[np.float64]:
        """Length along a branch at each of its points."""
        return np.asarray(self.places.offset[self.places.branch == branch])

    def radii_at(
        self, branch: NDArray[np.intp], offset: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Radii at positions; the arguments broadcast to the shape of the result."""
        return np.asarray(np.interp(self._starts[branch] + offset, self._along, self.radii))

    def points_at(
        self, branch: NDArray[np.intp], offset: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(x, y) of positions, (..., 2)."""
        at = self._starts[branch] + offset
        xy = [np.interp(at, self._along, self.points[:, k]) for k in (0, 1)]
        return np.stack(xy, axis=-1)

    def paths(
        self, origins: SkeletonPlaces, targets: SkeletonPlaces
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Paths along the skeleton from N positions to M others.

        Returns:
            (N, M) path lengths; and (N, M) whether each starts towards the end of its branch.
        """
        first, last = self._ends[targets.branch].T
        beyond = self.lengths[targets.branch] - targets.offset
        by_side = []
        for side, to_end in (
            (0, origins.offset),
            (1, self.lengths[origins.branch] - origins.offset),
        ):
            end_distances = self._between[self._ends[origins.branch, side]]
            shortest = np.minimum(
                end_distances[:, first] + targets.offset, end_distances[:, last] + beyond
            )
            by_side.append(shortest + to_end[:, None])
        same = origins.branch[:, None] == targets.branch[None]
        step = targets.offset[None] - origins.offset[:, None]
        length = np.where(same, np.abs(step), np.minimum(*by_side))
        return length, np.where(same, step > SAME_PLACE, by_side[1] < by_side[0])


def _distances(
    ends: NDArray[np.intp], lengths: NDArray[np.float64], size: int
) -> NDArray[np.float64]:
    """Path lengths between all ends of branches of a tree, (size, size)."""
    between = np.zeros((size, size))
    connected, remaining = [int(ends[0, 0])], list(range(len(ends)))
    while remaining:
        k = next(k for k in remaining if ends[k, 0] in connected or ends[k, 1] in connected)
        remaining.remove(k)
        a, b = (int(e) for e in ends[k])
        near_end, far_end = (a, b) if a in connected else (b, a)
        between[far_end, connected] = between[connected, far_end] = (
            between[near_end, connected] + lengths[k]
        )
        if far_end != near_end:
            connected.append(far_end)
            between[far_end, far_end] = 0.0
    return between


def directed_contexts(
    area: NDArray[np.float64],
    thickness: NDArray[np.float64],
    path_lengths: NDArray[np.float64],
    positions: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Histograms of a shape's area by distance and direction from each of some positions.

    Args:
        area: (P, 2) points evenly spread over the shape.
        thickness: (P,) radius of the shape's disc that contains each point.
        path_lengths: (N, P) distance along the skeleton from each position to each point.
        positions: (N, 2) the positions.
        directions: (N, 2) unit vectors of the skeleton there; (0, 0) puts all points straight ahead.

    Returns:
        (N, CONTEXT), rows sum to 1; a point is distributed over the cells around it, so that small
        moves cause small changes.
    """
    dx = area[:, 0] - positions[:, :1]
    dy = area[:, 1] - positions[:, 1:]
    ahead = dx * directions[:, :1] + dy * directions[:, 1:]
    sideways = np.abs(dy * directions[:, :1] - dx * directions[:, 1:])
    angle = np.arctan2(sideways, ahead) * ((ANGLES - 1) / np.pi)
    ring, angle_low = _rings(path_lengths), np.minimum(angle.astype(np.intp), ANGLES - 2)
    ring_low = np.minimum(ring.astype(np.intp), RINGS - 2)
    ring_share, angle_share = ring - ring_low, angle - angle_low
    mass = thickness**-THINNESS
    mass = mass / mass.sum()
    cell = ring_low * ANGLES + angle_low + np.arange(len(positions))[:, None] * CONTEXT
    out = np.zeros(len(positions) * CONTEXT)
    outer, inner = ring_share * mass, (1 - ring_share) * mass
    for step, part in ((0, inner), (ANGLES, outer)):
        beyond = part * angle_share
        for angle_step, weight in ((0, part - beyond), (1, beyond)):
            flat = (cell + (step + angle_step)).ravel()
            out += np.bincount(flat, weights=weight.ravel(), minlength=len(out))
    return out.reshape(len(positions), CONTEXT)


def whole_context(area: NDArray[np.float64]) -> NDArray[np.float64]:
    """The shape as seen from its centroid, invariant to rotation.

    For each ring of distance, the magnitudes of the first Fourier coefficients of the area as a function
    of angle, which are invariant to rotation and mirroring (generic Fourier descriptors; Zhang and Lu,
    2002).

    Args:
        area: (P, 2) points evenly spread over the shape.

    Returns:
        (CONTEXT,), the coefficients of order 0 sum to 1; unused entries are 0.

    Example:
        A disc is the same in every direction: orders 1 and above are nearly zero.

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
    """Fractional ring of each distance, from 0 to RINGS - 1."""
    scale = (RINGS - 1) / np.log(FARTHEST / NEAREST)
    ring = np.log(np.maximum(distance, NEAREST) / NEAREST) * scale
    return np.asarray(np.minimum(ring, RINGS - 1.0))
