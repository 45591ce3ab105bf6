"""Superpixels: small cells that follow image edges, and the affinity of neighbours.

A watershed from a regular grid of seeds: cells stay compact in flat regions and stop at edges, so a
silhouette made of cells is as sharp as the image.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from visup.percepts.motion.features._partition_jit import cell_borders, csr_links, watershed
from visup.percepts.motion.features._superpixels_jit import (
    bounding_box,
    cell_statistics,
    cell_totals,
    covered_pixels,
    dilate_cells,
    flat_seeds,
    paint_cells,
)
from visup.percepts.motion.features.work_image import Floats, WorkImage

STIFF = 15.0  # affinity of flat cells of one tone, which are nearly one: a sky, a face of a box
CALM = 1.0  # mean gradient up to which a cell is flat, grey levels per pixel
LOOSE = 0.05
FLAT = 3.0  # gradient, averaged over 3 x 3 pixels, below which there is no edge worth following


@dataclass(frozen=True, slots=True, eq=False)
class Superpixels:
    """A partition of the image into cells.

    Attributes:
        labels: (h, w) int32, 0 to count - 1.
        count: How many.
        area: (count,) float32 pixels.
        centre: (count, 2) float32 mean (x, y).
        tone: (count, 3) float32 mean tone.
        link: (count, count) sparse float32, symmetric, affinity of neighbours by the length of
            their common border and the likeness of their tones.
        corners: (count, 4) int32 (left, top, right, bottom) of each cell, the latter two exclusive;
            of a cell without pixels, right and bottom are 0, left and top the image's size.
    """

    labels: NDArray[np.int32]
    count: int
    area: Floats
    centre: Floats
    tone: Floats
    link: sparse.csr_matrix
    corners: NDArray[np.int32]
    _known: list[tuple[NDArray[Any], Floats]] = field(default_factory=list, repr=False)

    def dilated(self, members: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
        """Which cells lie within some steps of the members; (count, K) bool from the same."""
        return dilate_cells(
            self.link.indptr, self.link.indices, np.ascontiguousarray(members), steps
        )

    def mean(self, values: NDArray[Any]) -> Floats:
        """Mean of an (h, w) map, float32 or bool, in each cell, (count,) float32; cached per map.

        Several steps of a frame ask for the same few maps of hidden objects.
        """
        for known, found in self._known:
            if known is values:
                return found
        found = self._mean(values)
        found.flags.writeable = False
        self._known.append((values, found))
        return found

    def _mean(self, values: NDArray[Any]) -> Floats:
        mask = values.dtype == np.bool_
        values = np.ascontiguousarray(values, dtype=np.uint8 if mask else np.float32)
        return np.asarray(cell_totals(self.labels, values, self.count) / self.area)

    def shifted(self, old: Superpixels, members: NDArray[np.bool_], by: tuple[int, int]) -> Floats:
        """Share of each cell that some cells of another image cover when moved by whole pixels.

        Args:
            old: The cells of the other image.
            members: (old count,) bool, which of those.
            by: (x, y) pixels.

        Returns:
            (count,) float32.
        """
        some = np.ascontiguousarray(members)
        pixels = covered_pixels(self.labels, old.labels, old.corners, some, by, self.count)
        return np.asarray(pixels / self.area, dtype=np.float32)

    def paint(self, members: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """A map that is True in some cells and False elsewhere, (h, w)."""
        return paint_cells(self.labels, self.corners, np.ascontiguousarray(members))

    def box(self, members: NDArray[np.bool_]) -> tuple[int, int, int, int]:
        """(x, y, width, height) of the smallest box around some cells; empty when there are none."""
        x, y, right, bottom = bounding_box(self.corners, np.ascontiguousarray(members))
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
    busy = np.abs(image.gx) + np.abs(image.gy)
    # Seeds avoid edges, and the watershed has nothing to find in a cell that is flat throughout.
    seeds, count = flat_seeds(_smoothed(busy), cell, FLAT)
    watershed(*_edges(image.tone), seeds)
    labels = _without_boundaries(seeds)
    number, sums, corners = cell_statistics(labels, image.tone, busy, count)
    area = np.maximum(number, 1)
    mean = np.asarray(sums / area[:, None], dtype=np.float32)
    calm = np.exp(-0.5 * (mean[:, 5] / CALM) ** 2)
    tone = np.ascontiguousarray(mean[:, 2:5])
    link = _links(labels, tone, calm, contrast, cell)
    centre = np.ascontiguousarray(mean[:, :2])
    return Superpixels(labels, count, area, centre, tone, link, corners)


def _smoothed(busy: Floats) -> Floats:
    return np.asarray(cv2.boxFilter(busy, -1, (3, 3)), dtype=np.float32)


def _edges(tone: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Difference of each pixel of (h, w, 3) from the next, (h, w), and from that below, (h - 1, w)."""
    right = np.zeros(tone.shape[:2], dtype=np.uint8)
    right[:, :-1] = _unlike(tone[:, 1:], tone[:, :-1])
    return right, _unlike(tone[1:], tone[:-1])


def _unlike(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Largest difference over the channels of two images, (h, w)."""
    first, second, third = cv2.split(cv2.absdiff(one, other))
    return np.asarray(cv2.max(cv2.max(first, second), third), dtype=np.uint8)


def _without_boundaries(found: NDArray[np.int32]) -> NDArray[np.int32]:
    """Cells numbered from 0; boundary pixels, -1, go to the adjacent cell of highest number."""
    short = (found + 1).astype(np.uint16)  # 0 on a boundary, 1 where not reached
    grown = cv2.dilate(short, np.ones((3, 3), np.uint8))
    cv2.copyTo(grown, (short < 2).view(np.uint8), short)
    labels = short.astype(np.int32) - 2
    return np.maximum(labels, 0, out=labels)


def _links(
    labels: NDArray[np.int32], tone: Floats, calm: Floats, contrast: float, cell: int
) -> sparse.csr_matrix:
    count = len(tone)
    i, j, pixels = cell_borders(labels, count)
    # Faster column by column than as maxima along short rows.
    gaps = np.abs(tone[i] - tone[j])
    unlike = np.maximum(np.maximum(gaps[:, 0], gaps[:, 1]), gaps[:, 2])
    stiff = 1 + STIFF * calm[i] * calm[j]
    alike = stiff * np.exp(-0.5 * (unlike / contrast) ** 2) + LOOSE
    value = (np.minimum(pixels / cell, 2.0) * alike).astype(np.float32)
    ends, columns, data = csr_links(i, j, value, count)
    return sparse.csr_matrix((data, columns, ends), shape=(count, count))
