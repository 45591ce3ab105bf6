"""Superpixels: small cells that follow image edges, and how alike neighbours are.

Watershed from a regular grid of seeds: cells keep to their place in flat parts and stop at edges,
so a silhouette found on cells is as sharp as the image.
"""

from __future__ import annotations

from dataclasses import dataclass

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
    """

    labels: NDArray[np.int32]
    count: int
    area: Floats
    centre: Floats
    tone: Floats
    link: sparse.csr_matrix

    def reach(self, members: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
        """Which cells lie within some steps of the members; (count, K) bool from the same."""
        near = members.astype(np.float32)
        for _ in range(steps):
            near = np.minimum(near + self.link @ near, 1.0)
            near = (near > 0).astype(np.float32)
        return np.asarray(near > 0)

    def mean(self, values: Floats) -> Floats:
        """Mean of an (h, w) map in each cell, (count,) float32."""
        total = np.bincount(self.labels.ravel(), weights=values.ravel(), minlength=self.count)
        return np.asarray(total / self.area, dtype=np.float32)


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
    ys, xs = _seeds(image, cell)
    seeds[ys, xs] = np.arange(1, len(ys) + 1)
    labels = cv2.watershed(image.tone, seeds)
    grown = cv2.dilate(np.maximum(labels, 0).astype(np.int16), np.ones((3, 3), np.uint8))
    filled = np.where(labels > 0, labels, grown).astype(np.int32) - 1
    filled = np.maximum(filled, 0)
    count = len(ys)
    flat = filled.ravel()
    area = np.maximum(np.bincount(flat, minlength=count), 1).astype(np.float32)
    planes = cv2.split(image.tone)
    sums = [np.bincount(flat, weights=p.ravel(), minlength=count) for p in planes]
    tone = (np.stack(sums, axis=1) / area[:, None]).astype(np.float32)
    h_index, w_index = np.divmod(np.arange(height * width), width)
    centre = np.stack(
        [np.bincount(flat, weights=w, minlength=count) / area for w in (w_index, h_index)], axis=1
    ).astype(np.float32)
    busy = np.abs(image.gx) + np.abs(image.gy)
    mean = np.bincount(flat, weights=busy.ravel(), minlength=count) / area
    calm = np.exp(-0.5 * (mean / CALM) ** 2).astype(np.float32)
    link = _links(filled, count, tone, calm, contrast, cell)
    return Superpixels(filled, count, area, centre, tone, link)


def _seeds(image: WorkImage, cell: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The flattest place of each cell, so that no seed sits on an edge."""
    rows, cols = image.shape[0] // cell, image.shape[1] // cell
    strength = cv2.boxFilter(np.abs(image.gx) + np.abs(image.gy), -1, (3, 3))
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
        differ = a != b
        pairs.append((a[differ], b[differ]))
    i = np.concatenate([p[0] for p in pairs])
    j = np.concatenate([p[1] for p in pairs])
    ones = np.full(len(i), 1.0 / cell, dtype=np.float32)
    border = sparse.coo_matrix((ones, (i, j)), shape=(count, count)).tocsr()
    border = (border + border.T).tocoo()
    unlike = np.abs(tone[border.row] - tone[border.col]).max(axis=1)
    stiff = 1 + STIFF * calm[border.row] * calm[border.col]
    alike = stiff * np.exp(-0.5 * (unlike / contrast) ** 2) + LOOSE
    length = np.minimum(border.data, 2.0)
    link = sparse.coo_matrix((length * alike, (border.row, border.col)), shape=(count, count))
    return link.tocsr()
