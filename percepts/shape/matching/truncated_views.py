"""Silhouettes cut by the image border: known views are cut in the same way and compared with them.

A cut silhouette shows the bearing of the border, but not how much of the object lies beyond. So each view is
cut by a line from all sides and by several shares, and the remainder is sampled in rings about its centroid,
the line always on the right. A cut silhouette, rotated so that its border is on the right too, is compared
with all of these without a rotation search. Between the tested lines the best is interpolated by a parabola.

A view is prepared on first use, in about a millisecond, and takes 31 kB.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.matching._truncated_views_jit import (
    Samples,
    places_of_samples,
    weighted_remainders,
)
from visup.percepts.shape.matching.shape_similarity import Shape
from visup.percepts.shape.silhouette.area_overlap import paint_outline
from visup.percepts.shape.silhouette.silhouette import polygon_moments, resample_closed

BEARINGS = 32
"""Directions in which a view is cut."""

SHARES = (0.06, 0.11, 0.18, 0.28, 0.45)
"""Shares of a view's area that are cut off, one line each."""

MAX_CACHED = 4096
"""Most views kept prepared."""

_EDGES = np.concatenate([np.linspace(0.0, 1.2, 11), np.linspace(1.45, 2.95, 7)])
_RADII = 0.5 * (_EDGES[1:] + _EDGES[:-1])
_WEIGHTS = np.sqrt(np.diff(_EDGES) * _RADII)
_ANGLES = 32
_RING_WAVES, _TURN_WAVES = 5, 4
_PIXELS, _HALF = 24, 3.6
_BLUR = 0.06
_SAMPLE = 12


@dataclass(frozen=True, slots=True)
class CutLine:
    """A line that cuts a view.

    Attributes:
        bearing: Direction of its outward normal in the view's frame, radians from x towards y.
        offset: Distance of the line from the view's centroid, units; negative beyond it.
        share: Share of the view's area beyond it.
        similarity: Overlap of the remainder with the cut silhouette, 0 to 1; see `area_overlap.AreaOverlaps`.
        mirrored: Whether the silhouette is compared with the mirrored remainder.
    """

    bearing: float
    offset: float
    share: float
    similarity: float
    mirrored: bool


class _PaintedShape:
    """A shape prepared for cutting: rasterised, and as points spread over its area.

    Args:
        contour: (N, 2) outline in normal form.
    """

    def __init__(self, contour: NDArray[np.floating]) -> None:
        self.tone = _blurred(contour)
        rows, columns = np.nonzero(paint_outline(contour, _SAMPLE, _HALF) > 0.6)
        self.points = (np.stack([columns, rows], axis=1) + 0.5) / _SAMPLE - _HALF

    def cut(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The remainders of cuts from all `BEARINGS`, each by all `SHARES`.

        Returns:
            (B, S, R * A) float64, the weighted map of each, the line on the right; and the lines' offsets
            (B, S).
        """
        normals, directions = _directions()
        shares = np.array(SHARES)
        heights = self.points @ normals.T
        order = np.argsort(heights, axis=0)
        left = np.clip(((1 - shares) * len(order)).astype(int), 1, len(order)) - 1
        offsets = np.take_along_axis(heights, order, axis=0)[left].T.copy()
        sums = np.cumsum(self.points[order], axis=0)[left].swapaxes(0, 1)
        centres = sums / (left + 1.0)[None, :, None]
        units = np.asarray(np.sqrt((left + 1.0) / len(order)), dtype=np.float64)
        samples = Samples(centres, units, _RADII, directions)
        at = places_of_samples(samples, _HALF, _PIXELS)
        tone = np.asarray(cv2.remap(self.tone, at[0], at[1], cv2.INTER_LINEAR), np.float32)
        maps = weighted_remainders(tone, samples, _WEIGHTS, normals, offsets, _BLUR)
        return maps, offsets


def query_map(contour: NDArray[np.floating], border: float) -> NDArray[np.float64]:
    """The map of a cut silhouette, rotated so that its border is on the right.

    Args:
        contour: (N, 2) outline in normal form, the border's stretch included.
        border: Bearing of the border, radians; see `silhouette.Silhouette`.

    Returns:
        (R * A,) float64.
    """
    tone = _blurred(contour)
    around = border + np.arange(_ANGLES) * (2 * np.pi / _ANGLES)
    x, y = _RADII[:, None] * np.cos(around), _RADII[:, None] * np.sin(around)
    at_x, at_y = (((n + _HALF) * _PIXELS - 0.5).astype(np.float32) for n in (x, y))
    found = cv2.remap(tone, at_x, at_y, cv2.INTER_LINEAR).astype(np.float64)
    return np.asarray((found * _WEIGHTS[:, None]).ravel(), dtype=np.float64)


def mirrored_map(whole: NDArray[np.float64]) -> NDArray[np.float64]:
    """The map of the mirror image, the border still on the right."""
    rings = whole.reshape(len(_RADII), _ANGLES)
    return rings[:, -np.arange(_ANGLES) % _ANGLES].ravel()


class CutIndex:
    """Known views, cut from all sides; each is prepared on first use.

    Args:
        shapes: The views' shapes, uncut.
    """

    def __init__(self, shapes: Sequence[Shape]) -> None:
        self._shapes = shapes
        self._slots = np.full(len(shapes), -1, dtype=np.intp)
        self._used = 0
        size = (min(len(shapes), MAX_CACHED), BEARINGS, len(SHARES))
        self._coefficients = np.zeros((*size, _basis().shape[1]), dtype=np.float32)
        self._powers = np.zeros(size, dtype=np.float32)
        self._offsets = np.zeros(size, dtype=np.float32)

    def likeliest(
        self, query: NDArray[np.float64], among: NDArray[np.intp], most: int, *, mirror: bool = True
    ) -> list[tuple[int, CutLine]]:
        """The views that, after some cut, are most similar to a cut silhouette.

        Args:
            query: Its map, see `query_map`.
            among: Numbers of the views to search, `MAX_CACHED` at most.
            most: How many to return.
            mirror: Whether mirror images count.

        Returns:
            (number of the view, its best cut), best first.
        """
        slots = self._prepared(among)
        queries = np.stack([query, mirrored_map(query)] if mirror else [query], axis=1)
        waves = (_basis().T @ queries).astype(np.float32)
        # Squared distances of maps from the query's, (V, BEARINGS, SHARES, 1 or 2).
        codes = self._coefficients[slots]
        products = (codes.reshape(-1, len(waves)) @ waves).reshape(*codes.shape[:3], -1)
        distances = self._powers[slots][..., None] - 2 * products
        distances += np.float32((waves**2).sum() / waves.shape[1])
        flat = distances.reshape(len(among), -1)
        best = flat.argmin(axis=1)
        order = np.argsort(flat[np.arange(len(among)), best], kind="stable")[:most]
        places = np.arange(len(self._coefficients))[slots][order]
        cuts = self._interpolated(places, distances[order], best[order], float(query @ query))
        return list(zip(among[order].tolist(), cuts, strict=True))

    def _prepared(self, among: NDArray[np.intp]) -> NDArray[np.intp] | slice:
        """Slots of the prepared views; contiguous ones as a slice, to avoid a copy."""
        missing = among[self._slots[among] < 0]
        if self._used + len(missing) > len(self._coefficients):
            self._slots[:] = -1
            self._used = 0
            missing = among
        for number in missing.tolist():
            self._prepare(number)
        slots = self._slots[among]
        if len(slots) and np.array_equal(slots, np.arange(slots[0], slots[0] + len(slots))):
            return slice(int(slots[0]), int(slots[0]) + len(slots))
        return slots

    def _prepare(self, number: int) -> None:
        slot = self._used
        maps, offsets = _PaintedShape(self._shapes[number].contour).cut()
        # One product of matrices takes half the time of one for each bearing.
        codes = maps.reshape(-1, maps.shape[-1]) @ _basis()
        self._coefficients[slot] = codes.reshape(*maps.shape[:2], -1)
        self._powers[slot] = (self._coefficients[slot] ** 2).sum(axis=-1)
        self._offsets[slot] = offsets
        # At last, since a search may be stopped before.
        self._slots[number] = slot
        self._used += 1

    def _interpolated(
        self,
        slots: NDArray[np.intp],
        distances: NDArray[np.float32],
        best: NDArray[np.intp],
        power: float,
    ) -> list[CutLine]:
        """The best cut of each view, interpolated between the tested ones.

        Args:
            slots: (K,) slots of the views.
            distances: (K, BEARINGS, SHARES, S) squared distances.
            best: (K,) flat indices of their minima.
            power: Power of the query's map.
        """
        bearing_number, share, side = np.unravel_index(best, distances.shape[1:])
        numbers = np.arange(len(slots))
        adjacent = (bearing_number[:, None] + (-1, 0, 1)) % BEARINGS
        bearing_step, bearing_gain = _parabola_minima(
            distances[numbers[:, None], adjacent, share[:, None], side[:, None]]
        )
        inner = np.clip(share, 1, len(SHARES) - 2)
        adjacent_shares = inner[:, None] + (-1, 0, 1)
        share_step, share_gain = _parabola_minima(
            distances[numbers[:, None], bearing_number[:, None], adjacent_shares, side[:, None]]
        )
        share_step, share_gain = np.where(inner == share, (share_step, share_gain), 0.0)
        position = share + share_step
        lower = np.clip(np.floor(position), 0, len(SHARES) - 2).astype(np.intp)
        fraction = position - lower
        shares = np.array(SHARES)
        offsets = self._offsets[slots[:, None], adjacent]
        columns = (1 - fraction[:, None]) * offsets[numbers[:, None], (0, 1, 2), lower[:, None]]
        columns += fraction[:, None] * offsets[numbers[:, None], (0, 1, 2), lower[:, None] + 1]
        neighbour = columns[numbers, np.where(bearing_step < 0, 0, 2)]
        offset = columns[:, 1] + np.abs(bearing_step) * (neighbour - columns[:, 1])
        distance = np.maximum(
            0.0, distances.reshape(len(slots), -1)[numbers, best] - bearing_gain - share_gain
        )
        similarities = np.clip(
            1.0 - distance / (power + self._powers[slots, bearing_number, share]), 0.0, 1.0
        )
        bearing = (bearing_number + bearing_step) * (2 * np.pi / BEARINGS)
        cut_share = (1 - fraction) * shares[lower] + fraction * shares[lower + 1]
        rows = zip(bearing, offset, cut_share, similarities, side > 0, strict=True)
        return [CutLine(float(b), float(o), float(c), float(s), bool(m)) for b, o, c, s, m in rows]


def _parabola_minima(three: NDArray[np.float32]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Minima of parabolas through three values (K, 3): offset from the middle, in steps, and depth."""
    before, middle, after = three.astype(np.float64).T
    curvature = before - 2 * middle + after
    is_convex = curvature > 1e-9
    step = np.clip(0.5 * (before - after) / np.where(is_convex, curvature, 1.0), -0.5, 0.5)
    depth = -(0.5 * curvature * step**2 + 0.5 * (after - before) * step)
    return np.where(is_convex, step, 0.0), np.where(is_convex, depth, 0.0)


def cut_outline(contour: NDArray[np.floating], cut: CutLine) -> NDArray[np.float64]:
    """The outline of a cut view, in its own normal form.

    Args:
        contour: (N, 2) outline in normal form.
        cut: The line.

    Returns:
        (M, 2) float64, the line's stretch included; all pieces that the line separates, joined along
        it. The outline itself when nothing would remain.
    """
    points = np.asarray(contour, dtype=np.float64)
    height = points @ (np.cos(cut.bearing), np.sin(cut.bearing)) - cut.offset
    following, after = np.roll(points, -1, axis=0), np.roll(height, -1)
    crosses = (height <= 0) != (after <= 0)
    part = np.where(crosses, height / np.where(crosses, height - after, 1.0), 0.0)
    crossing = points + part[:, None] * (following - points)
    both = np.stack([points, crossing], axis=1).reshape(-1, 2)
    clipped = both[np.stack([height <= 0, crosses], axis=1).ravel()]
    if len(clipped) < 3:
        return points
    area, centroid = polygon_moments(clipped)
    return resample_closed((clipped - centroid) / max(abs(area), 1e-9) ** 0.5)


@lru_cache(maxsize=1)
def _directions() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normals of the lines (B, 2), and cosines and sines of a ring's samples for each bearing (2, B, A)."""
    bearings = np.arange(BEARINGS) * (2 * np.pi / BEARINGS)
    around = bearings[:, None] + np.arange(_ANGLES) * (2 * np.pi / _ANGLES)
    normals = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    return normals, np.stack([np.cos(around), np.sin(around)])


@lru_cache(maxsize=1)
def _basis() -> NDArray[np.float64]:
    """An orthonormal basis of low frequencies along and around the rings, (R * A, D)."""
    ring = np.arange(len(_RADII)) + 0.5
    rings = np.cos(np.pi / len(_RADII) * np.outer(ring, np.arange(_RING_WAVES)))
    phase = np.outer(np.arange(_ANGLES), np.arange(_TURN_WAVES + 1)) * (2 * np.pi / _ANGLES)
    turns = np.hstack([np.cos(phase), np.sin(phase[:, 1:])])
    rings /= np.linalg.norm(rings, axis=0)
    turns /= np.linalg.norm(turns, axis=0)
    return np.asarray(np.kron(rings, turns))


def _blurred(contour: NDArray[np.floating]) -> NDArray[np.float32]:
    tone = cv2.GaussianBlur(paint_outline(contour, _PIXELS, _HALF), (0, 0), _BLUR * _PIXELS)
    return np.asarray(tone, dtype=np.float32)
