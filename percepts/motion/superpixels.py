"""Superpixels: small cells that follow image edges, and how alike neighbours are.

Watershed from a regular grid of seeds: cells keep to their place in flat parts and stop at edges,
so a silhouette found on cells is as sharp as the image.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from visup.percepts.motion.image import Floats, WorkImage

STIFF = 15.0  # flat cells of one tone are nearly one: a whole sky, a whole face of a box
CALM = 1.0  # mean gradient up to which a cell is flat, grey levels per pixel
LOOSE = 0.05
FLAT = 3.0  # gradient, averaged over 3 x 3 pixels, below which there is no edge worth following


@dataclass(frozen=True, slots=True, eq=False)
class Superpixels:
    """A partition of the image.

    Attributes:
        labels: (h, w) int32, 0 to count - 1.
        count: How many.
        area: (count,) float32 pixels.
        centre: (count, 2) float32 mean (x, y).
        tone: (count, 3) float32 mean tone.
        link: (count, count) sparse float32, symmetric, affinity of neighbours by the length of
            their common border and the likeness of their tones.
        pixels: (count, h * w) sparse float32, 1 where a pixel is in a cell, in scan order: sums
            over cells are products with it.
        corners: (count, 4) int32 (left, top, right, bottom) of each cell, the latter two beyond
            it; of a cell without pixels, right and bottom are 0, left and top the image's size.
    """

    labels: NDArray[np.int32]
    count: int
    area: Floats
    centre: Floats
    tone: Floats
    link: sparse.csr_matrix
    pixels: sparse.csr_matrix
    corners: NDArray[np.int32]
    _known: list[tuple[Floats, Floats]] = field(default_factory=list, repr=False)

    def reach(self, members: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
        """Which cells lie within some steps of the members; (count, K) bool from the same."""
        near = members
        for _ in range(steps):
            amount = near.astype(np.float32)
            near = self.link @ amount + amount > 0
        return np.asarray(near)

    def samples(self, every: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Every n-th pixel of each cell, its first one always.

        Args:
            every: n.

        Returns:
            (N,) int32 places in scan order of the image, cell by cell; (count + 1,) int32, where
            those of each cell begin and end.
        """
        first = self.pixels.indptr[:-1]
        number = (np.diff(self.pixels.indptr) + every - 1) // every
        ends = np.concatenate([[0], np.cumsum(number)]).astype(np.int32)
        place = np.arange(ends[-1]) * every + np.repeat(first - every * ends[:-1], number)
        return np.asarray(self.pixels.indices[place]), ends

    def mean(self, values: Floats) -> Floats:
        """Mean of an (h, w) map in each cell, (count,) float32; that of a map asked again is kept.

        Several steps of a frame ask for the same few maps, of what is hidden.
        """
        for known, found in self._known:
            if known is values:
                return found
        found = self._mean(values)
        found.flags.writeable = False
        self._known.append((values, found))
        return found

    def _mean(self, values: Floats) -> Floats:
        x, y, w, h = cv2.boundingRect((values != 0).view(np.uint8))
        if w * h < 0.2 * values.size:  # little of it is not zero
            part = np.s_[y : y + h, x : x + w]
            where = self.labels[part].ravel().astype(np.int64)
            total = np.bincount(where, weights=values[part].ravel(), minlength=self.count)
            return np.asarray(total / self.area, dtype=np.float32)
        return np.asarray(self.pixels @ values.ravel() / self.area)

    def shifted(self, old: Superpixels, members: NDArray[np.bool_], by: tuple[int, int]) -> Floats:
        """Share of each cell that some cells of another image cover when moved by whole pixels.

        Args:
            old: The cells of the other image.
            members: (old count,) bool, which of those.
            by: (x, y) pixels.

        Returns:
            (count,) float32.
        """
        x, y, w, h = old.box(members)
        height, width = self.labels.shape
        left, top = max(x + by[0], 0), max(y + by[1], 0)
        right, bottom = min(x + by[0] + w, width), min(y + by[1] + h, height)
        if left >= right or top >= bottom:
            return np.zeros(self.count, dtype=np.float32)
        there = np.s_[top - by[1] : bottom - by[1], left - by[0] : right - by[0]]
        covered = self.labels[top:bottom, left:right][members[old.labels[there]]]
        return np.asarray(np.bincount(covered, minlength=self.count) / self.area, dtype=np.float32)

    def paint(self, members: NDArray[np.bool_]) -> Floats:
        """A map that is 1 in some cells and 0 elsewhere, (h, w) float32."""
        out = np.zeros(self.labels.shape, dtype=np.float32)
        x, y, w, h = self.box(members)
        part = np.s_[y : y + h, x : x + w]
        out[part] = members[self.labels[part]]
        return out

    def box(self, members: NDArray[np.bool_]) -> tuple[int, int, int, int]:
        """(x, y, width, height) of the smallest box around some cells; empty when there are none."""
        some = self.corners[members]
        if not len(some):
            return 0, 0, 0, 0
        x, y = some[:, :2].min(axis=0).tolist()
        right, bottom = some[:, 2:].max(axis=0).tolist()
        return (x, y, right - x, bottom - y) if right > x else (0, 0, 0, 0)


def superpixels(image: WorkImage, cell: int, contrast: float) -> Superpixels:
    """Partition an image.

    Args:
        image: The working image.
        cell: Spacing of the seeds, pixels.
        contrast: Difference of tone at which neighbours count as unlike.

    Returns:
        The cells.
    """
    height, width = image.shape
    busy = np.abs(image.gx) + np.abs(image.gy)
    seeds, count = _seeds(busy, cell)
    labels = cv2.watershed(image.tone, seeds)
    # Lines between the cells go to the later of the cells beside them.
    short = (labels + 1).astype(np.uint16)  # on a line 0, what was not reached 1
    grown = cv2.dilate(short, np.ones((3, 3), np.uint8))
    cv2.copyTo(grown, (short < 2).view(np.uint8), short)
    filled = short.astype(np.int32) - 2
    np.maximum(filled, 0, out=filled)
    pixels = _pixels(filled, count)
    area = np.maximum(np.diff(pixels.indptr), 1).astype(np.float32)

    def mean(values: NDArray[Any]) -> Floats:
        return np.asarray(pixels @ values.ravel().astype(np.float32, copy=False) / area)

    tone = np.stack([mean(plane) for plane in cv2.split(image.tone)], axis=1)
    along = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
    centre = np.stack([mean(np.tile(along[0], height)), mean(np.repeat(along[1], width))], axis=1)
    calm = np.exp(-0.5 * (mean(busy) / CALM) ** 2).astype(np.float32)
    link = _links(filled, count, tone, calm, contrast, cell)
    corners = _corners(pixels, height, width)
    return Superpixels(filled, count, area, centre, tone, link, pixels, corners)


def _seeds(busy: Floats, cell: int) -> tuple[NDArray[np.int32], int]:
    """Seeds numbered from 1, (h, w) int32, 0 elsewhere; and how many.

    A seed is the flattest 3 x 3 pixels of its cell, so that none sits on an edge, or the inside of
    a cell that is flat all over: there the watershed has nothing to find.
    """
    rows, cols = busy.shape[0] // cell, busy.shape[1] // cell
    strength = cv2.boxFilter(busy, -1, (3, 3))
    cells = strength[: rows * cell, : cols * cell].reshape(rows, cell, cols, cell)
    inner = cells[:, 1:-1, :, 1:-1].transpose(0, 2, 1, 3).reshape(rows * cols, -1)
    best, side = inner.argmin(axis=1), cell - 2
    number = np.arange(1, rows * cols + 1, dtype=np.int32)
    seeds = np.zeros(busy.shape, dtype=np.int32)
    flat = np.where(inner.max(axis=1) < FLAT, number, 0).reshape(rows, 1, cols, 1)
    own = seeds[: rows * cell, : cols * cell].reshape(rows, cell, cols, cell)
    own[:, 1:-1, :, 1:-1] = flat
    y = np.arange(rows).repeat(cols) * cell + best // side + 1
    x = np.tile(np.arange(cols), rows) * cell + best % side + 1
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            seeds[y + i, x + j] = number
    return seeds, len(number)


def _pixels(labels: NDArray[np.int32], count: int) -> sparse.csr_matrix:
    """Which pixels each cell consists of, in scan order."""
    ones = np.ones(labels.size, dtype=np.float32)
    # Column by column, that is pixel by pixel, there is one entry in each.
    ends = np.arange(labels.size + 1, dtype=np.int32)
    members = sparse.csc_matrix((ones, labels.ravel(), ends), shape=(count, labels.size))
    return members.tocsr()


def _corners(pixels: sparse.csr_matrix, height: int, width: int) -> NDArray[np.int32]:
    rows = np.flatnonzero(np.diff(pixels.indptr))
    first, last = pixels.indptr[rows], pixels.indptr[rows + 1] - 1
    out = np.tile(np.array([width, height, 0, 0], dtype=np.int32), (pixels.shape[0], 1))
    out[rows, 1] = pixels.indices[first] // width
    out[rows, 3] = pixels.indices[last] // width + 1
    x = np.tile(np.arange(width, dtype=np.int16), height)[pixels.indices]
    out[rows, 0] = np.minimum.reduceat(x, first)
    out[rows, 2] = np.maximum.reduceat(x, first).astype(np.int32) + 1
    return out


def _links(
    labels: NDArray[np.int32], count: int, tone: Floats, calm: Floats, contrast: float, cell: int
) -> sparse.csr_matrix:
    pairs = []
    # Two cells are one number, short if that will do: short numbers are sorted sooner.
    kind = np.int32 if count < 46_000 else np.int64
    width, flat = labels.shape[1], labels.ravel()
    for step in (1, width):
        at = np.flatnonzero(flat[:-step] != flat[step:])
        if step == 1:
            at = at[at % width != width - 1]  # the next row is no neighbour of the end of one
        one, other = flat[at].astype(kind), flat[at + step].astype(kind)
        pairs.append(np.minimum(one, other) * kind(count) + np.maximum(one, other))
    # Neighbours in the order of their numbers; how often they touch is the length of the border.
    pair, pixels = np.unique(np.concatenate(pairs), return_counts=True)
    i, j = np.divmod(pair, kind(count))
    unlike = np.abs(tone[i] - tone[j]).max(axis=1)
    stiff = 1 + STIFF * calm[i] * calm[j]
    alike = stiff * np.exp(-0.5 * (unlike / contrast) ** 2) + LOOSE
    value = (np.minimum(pixels / cell, 2.0) * alike).astype(np.float32)
    both = np.concatenate([value, value]), (np.concatenate([i, j]), np.concatenate([j, i]))
    return sparse.coo_matrix(both, shape=(count, count)).tocsr()


def overlap(
    old: Superpixels, new: Superpixels, source: NDArray[np.int32], ends: NDArray[np.int32]
) -> sparse.csr_matrix:
    """Which old cells some pixels of each new cell come from.

    Args:
        old: Cells of the old image.
        new: Cells of the new image.
        source: (N,) int32 old cell of each of those pixels, -1 for none, cell by cell.
        ends: (new count + 1,) int32, where the pixels of each new cell begin and end.

    Returns:
        (new count, old count) sparse float32 shares, entries not summed; rows sum to 1, or less.
    """
    # Each pixel is an entry of its own: products cost less than finding those that are alike.
    number = np.diff(ends)
    share = np.repeat(1 / np.maximum(number, 1).astype(np.float32), number)
    share *= source >= 0
    entries = share, np.maximum(source, 0), ends
    return sparse.csr_matrix(entries, shape=(new.count, old.count))
