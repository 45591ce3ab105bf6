"""Superpixels: small cells that follow image edges, and how alike neighbours are.

Watershed from a regular grid of seeds: cells keep to their place in flat parts and stop at edges,
so a silhouette found on cells is as sharp as the image.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from visup.percepts.motion.image import Floats, WorkImage

STIFF = 15.0  # flat cells of one tone are nearly one: a whole sky, a whole face of a box
CALM = 1.0  # mean gradient up to which a cell is flat, grey levels per pixel
LOOSE = 0.05


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
        runs: The cells along the rows of the image.
    """

    labels: NDArray[np.int32]
    count: int
    area: Floats
    centre: Floats
    tone: Floats
    link: sparse.csr_matrix
    runs: Runs

    def reach(self, members: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
        """Which cells lie within some steps of the members; (count, K) bool from the same."""
        near = members.astype(np.float32)
        for _ in range(steps):
            near = np.minimum(near + self.link @ near, 1.0)
            near = (near > 0).astype(np.float32)
        return np.asarray(near > 0)

    def mean(self, values: Floats) -> Floats:
        """Mean of an (h, w) map in each cell, (count,) float32; a map may be zero nearly all over.

        Only the box around what is not zero is looked at.
        """
        x, y, w, h = cv2.boundingRect((values != 0).view(np.uint8))
        if w == 0:
            return np.zeros(self.count, dtype=np.float32)
        if w * h > 0.3 * values.size:
            return np.asarray(self.runs.total(values, self.count) / self.area, dtype=np.float32)
        part = np.s_[y : y + h, x : x + w]
        total = np.bincount(
            self.labels[part].ravel(), weights=values[part].ravel(), minlength=self.count
        )
        return np.asarray(total / self.area, dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """Where cells begin along the rows of an image: sums over cells are first taken over these.

    Attributes:
        start: (R,) int64 index of the first pixel of each run in the flattened image.
        length: (R,) int64 pixels.
        label: (R,) int64 cell.
    """

    start: NDArray[np.int64]
    length: NDArray[np.int64]
    label: NDArray[np.int64]

    def total(self, values: NDArray[Any], count: int) -> NDArray[np.float64]:
        """Sum of an (h, w) map over each cell, (count,)."""
        kind = np.int32 if values.dtype.kind in "bu" else None
        each = np.add.reduceat(values.ravel(), self.start, dtype=kind)
        return np.bincount(self.label, weights=each, minlength=count).astype(np.float64)


def runs_of(codes: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First index and length of each run of equal values along the rows of an (h, w) map."""
    height, width = codes.shape
    begins = np.ones((height, width), dtype=bool)
    np.not_equal(codes[:, 1:], codes[:, :-1], out=begins[:, 1:])
    start = np.flatnonzero(begins.ravel())
    return start, np.diff(start, append=codes.size)


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
    seeds = np.zeros((height, width), dtype=np.int32)
    busy = np.abs(image.gx) + np.abs(image.gy)
    ys, xs = _seeds(busy, cell)
    seeds[ys, xs] = np.arange(1, len(ys) + 1)
    labels = cv2.watershed(image.tone, seeds)
    # Lines between the cells go to the later of the cells beside them.
    ridge = np.maximum(labels, 0).astype(np.uint16)
    grown = cv2.dilate(ridge, np.ones((3, 3), np.uint8))
    filled = np.maximum(np.where(ridge > 0, ridge, grown).astype(np.int32) - 1, 0)
    count = len(ys)
    start, length = runs_of(filled)
    runs = Runs(start, length, filled.ravel()[start].astype(np.int64))

    def mean(total: NDArray[Any]) -> Floats:
        return np.asarray(total / area, dtype=np.float32)

    area = np.maximum(np.bincount(runs.label, weights=length, minlength=count), 1).astype(
        np.float32
    )
    tone = np.stack([mean(runs.total(p, count)) for p in cv2.split(image.tone)], axis=1)
    row, col = np.divmod(start, width)
    xs_of, ys_of = length * (col + (length - 1) / 2), length * row
    centre = np.stack(
        [mean(np.bincount(runs.label, weights=w, minlength=count)) for w in (xs_of, ys_of)], axis=1
    )
    calm = np.exp(-0.5 * (mean(runs.total(busy, count)) / CALM) ** 2).astype(np.float32)
    link = _links(filled, count, tone, calm, contrast, cell)
    return Superpixels(filled, count, area, centre, tone, link, runs)


def _seeds(busy: Floats, cell: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The flattest place of each cell, so that no seed sits on an edge."""
    rows, cols = busy.shape[0] // cell, busy.shape[1] // cell
    strength = cv2.boxFilter(busy, -1, (3, 3))
    cells = strength[: rows * cell, : cols * cell].reshape(rows, cell, cols, cell)
    inner = cells[:, 1:-1, :, 1:-1].transpose(0, 2, 1, 3).reshape(rows * cols, -1)
    best, side = inner.argmin(axis=1), cell - 2
    number = np.arange(rows * cols)
    return (number // cols) * cell + best // side + 1, (number % cols) * cell + best % side + 1


def _links(
    labels: NDArray[np.int32], count: int, tone: Floats, calm: Floats, contrast: float, cell: int
) -> sparse.csr_matrix:
    pairs = []
    for a, b in ((labels[:, :-1], labels[:, 1:]), (labels[:-1], labels[1:])):
        differ = np.flatnonzero(a != b)
        one, other = a.ravel()[differ], b.ravel()[differ]
        pairs.append(np.minimum(one, other).astype(np.int64) * count + np.maximum(one, other))
    # Neighbours in the order of their numbers; how often they touch is the length of the border.
    pair, pixels = np.unique(np.concatenate(pairs), return_counts=True)
    i, j = np.divmod(pair, count)
    unlike = np.abs(tone[i] - tone[j]).max(axis=1)
    stiff = 1 + STIFF * calm[i] * calm[j]
    alike = stiff * np.exp(-0.5 * (unlike / contrast) ** 2) + LOOSE
    value = (np.minimum(pixels / cell, 2.0) * alike).astype(np.float32)
    both = np.concatenate([value, value]), (np.concatenate([i, j]), np.concatenate([j, i]))
    return sparse.coo_matrix(both, shape=(count, count)).tocsr()


def overlap(old: Superpixels, new: Superpixels, from_where: NDArray[np.int32]) -> sparse.csr_matrix:
    """Which old cells the pixels of each new cell come from.

    Args:
        old: Cells of the old image.
        new: Cells of the new image.
        from_where: (h, w) int32 old cell of each pixel of the new image, -1 for none.

    Returns:
        (new count, old count) sparse float32 shares; rows sum to 1, or less.
    """
    code = new.labels.astype(np.int64) * (old.count + 1) + (from_where + 1)
    start, length = runs_of(code)
    i, j = np.divmod(code.ravel()[start], old.count + 1)
    known = j > 0
    i, j = i[known], j[known] - 1
    share = (length[known] / new.area[i]).astype(np.float32)
    return sparse.coo_matrix((share, (i, j)), shape=(new.count, old.count)).tocsr()
