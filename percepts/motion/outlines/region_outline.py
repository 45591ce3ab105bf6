"""Region outlines: from a probability map to a clean mask and its contour in frame pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.agent.model.fast_replace import replace
from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

HOLE = 0.08  # holes up to this share of the region's area are filled

MARGIN = 3  # working pixels around a region that smoothing needs


@dataclass(frozen=True, slots=True, eq=False)
class RegionOutline:
    """A mask and its properties, in frame pixels.

    Attributes:
        bbox: (x, y, width, height), half open.
        mask: (height, width) bool, cropped to the box.
        contour: (N, 2) float32 outer boundary of the largest part.
        centroid: (x, y).
        area: Pixels.
        cut: Whether it touches the border of the frame.
    """

    bbox: tuple[int, int, int, int]
    mask: NDArray[np.bool_]
    contour: Floats
    centroid: tuple[float, float]
    area: float
    cut: bool

    def region(
        self, number: int, velocity: tuple[float, float], sigma: float, confidence: float
    ) -> Region:
        """The region that has this outline.

        Args:
            number: Its public id.
            velocity: (vx, vy), frame pixels per second.
            sigma: Standard deviation of the velocity, the same unit.
            confidence: 0 to 1.

        Returns:
            The region.
        """
        return Region(
            id=number,
            bbox=self.bbox,
            mask=self.mask,
            contour=self.contour,
            centroid=self.centroid,
            area=self.area,
            velocity=velocity,
            velocity_sigma=sigma,
            cut=self.cut,
            confidence=confidence,
        )

    def applied_to(self, region: Region) -> Region:
        """A region with this outline in place of its own."""
        return replace(
            region,
            bbox=self.bbox,
            mask=self.mask,
            contour=self.contour,
            centroid=self.centroid,
            area=self.area,
            cut=self.cut,
        )


def region_outline(
    share: Floats,
    corner: tuple[int, int],
    shape: tuple[int, int],
    size: tuple[int, int],
    least: float,
) -> RegionOutline | None:
    """The outline of a region.

    Args:
        share: (h, w) float32 probability in a part of the working image, `MARGIN` wider than the
            region where the image allows.
        corner: (x, y) of that part, working pixels.
        shape: (height, width) of the working image.
        size: (width, height) of the frame.
        least: Least area, frame pixels.

    Returns:
        The outline, or None when too little is left.
    """
    scale = size[0] / shape[1], size[1] / shape[0]
    # Cleaned at the small size; then only the part around the region is enlarged.
    mask = clean_mask(share > 0.5, least / (scale[0] * scale[1]))
    if mask is None:
        return None
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    left, top = max(x - MARGIN, 0), max(y - MARGIN, 0)
    part = np.s_[top : y + h + MARGIN, left : x + w + MARGIN]
    soft = _soft(share[part], mask[part])
    left, top = corner[0] + left, corner[1] + top
    bottom, right = top + soft.shape[0], left + soft.shape[1]
    smooth = cv2.GaussianBlur(soft, (3, 3), 0.8)
    x0, y0 = round(left * scale[0]), round(top * scale[1])
    x1, y1 = round(right * scale[0]), round(bottom * scale[1])
    full = cv2.resize(smooth, (x1 - x0, y1 - y0), interpolation=cv2.INTER_LINEAR) > 127
    return describe_mask(full, (x0, y0), size) if full.any() else None


def _soft(share: Floats, mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Shares in 255ths, forced to the mask's side of one half."""
    lifted = np.where(mask, np.where(share > 0.5, share, 1), np.minimum(share, 0.498))
    return np.asarray(lifted * np.float32(255) + np.float32(0.5), dtype=np.uint8)


def clean_mask(mask: NDArray[np.bool_], least: float) -> NDArray[np.bool_] | None:
    """Drop specks, keep parts of at least a tenth of the largest (an occluder may split a region).

    Args:
        mask: (H, W) bool.
        least: Least area of the largest part, pixels.

    Returns:
        (H, W) bool, or None when the largest part is too small.
    """
    count, labels = cv2.connectedComponents(mask.view(np.uint8), connectivity=4)
    if count < 2:
        return None
    areas = component_areas(mask.view(np.uint8), labels, count)[1:]
    largest = int(areas.max())
    if largest < least:
        return None
    keep = np.ones(count, dtype=bool)
    keep[1:] = areas >= max(0.1 * largest, 0.25 * least)
    # Most regions are one piece without holes, and need no repainting.
    whole = mask if keep.all() else mask & chosen(labels, keep)
    return _filled(whole, HOLE * largest)


def component_areas(mask: NDArray[np.uint8], labels: NDArray[Any], count: int) -> NDArray[Any]:
    """Pixels of each component, the rest of the image first; OpenCV's statistics take four times as long.

    Args:
        mask: (h, w), not 0 where the components are.
        labels: (h, w), from `cv2.connectedComponents`.
        count: Number of labels.
    """
    if count > 2:
        return label_areas(labels, count)
    inside = cv2.countNonZero(mask)
    return np.array([mask.size - inside, inside])[:count]


@compiled
def label_areas(labels: NDArray[Any], count: int) -> NDArray[np.int64]:
    """Pixels of each of `count` labels, (count,)."""
    out = np.zeros(count, np.int64)
    for y in range(labels.shape[0]):
        # Run by run: to add to one place again and again is slow.
        label, begin = labels[y, 0], 0
        for x in range(labels.shape[1]):
            if labels[y, x] != label:
                out[label] += x - begin
                label, begin = labels[y, x], x
        out[label] += labels.shape[1] - begin
    return out


@compiled
def chosen(labels: NDArray[Any], keep: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pixels of the labels that are kept, (h, w) bool; `keep[labels]` takes five times as long."""
    out = np.empty(labels.shape, np.bool_)
    for y in range(labels.shape[0]):
        for x in range(labels.shape[1]):
            out[y, x] = keep[labels[y, x]]
    return out


@compiled
def marked(labels: NDArray[Any], where: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Which of `count` labels, but for 0, some pixels of (h, w) have, (count,) bool."""
    out = np.zeros(count, np.bool_)
    for y in range(labels.shape[0]):
        for x in range(labels.shape[1]):
            if where[y, x]:
                out[labels[y, x]] = True
    out[0] = False
    return out


@compiled
def renumbered(labels: NDArray[Any], number: NDArray[np.int32]) -> NDArray[np.int32]:
    """(h, w) labels, each replaced by its new number, (count,); most of them are 0, and stay so."""
    out = np.zeros(labels.shape, np.int32)
    for y in range(labels.shape[0]):
        for x in range(labels.shape[1]):
            if labels[y, x]:
                out[y, x] = number[labels[y, x]]
    return out


def _filled(mask: NDArray[np.bool_], most: float) -> NDArray[np.bool_]:
    """Fill holes of up to `most` pixels: small enclosed parts are seldom background."""
    padded = np.ones((mask.shape[0] + 2, mask.shape[1] + 2), dtype=np.uint8)
    np.logical_not(mask, out=padded[1:-1, 1:-1].view(bool))
    count, labels = cv2.connectedComponents(padded, connectivity=4)
    if count == 2:
        return mask
    small = component_areas(padded, labels, count) <= most
    small[[0, labels[0, 0]]] = False
    return np.asarray(mask | chosen(labels, small)[1:-1, 1:-1]) if small.any() else mask


def describe_mask(
    mask: NDArray[np.bool_], origin: tuple[int, int], size: tuple[int, int]
) -> RegionOutline:
    """Box, contour, centroid and area of a mask that is not empty.

    Args:
        mask: (H, W) bool, part of the frame.
        origin: (x, y) of the part in the frame.
        size: (width, height) of the frame.

    Returns:
        The outline.
    """
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    crop = np.ascontiguousarray(mask[y : y + h, x : x + w])
    x, y = x + origin[0], y + origin[1]
    found, _ = cv2.findContours(
        crop.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE, offset=(x, y)
    )
    largest = max(found, key=cv2.contourArea)
    sums = cv2.moments(crop.view(np.uint8), binaryImage=True)
    area = sums["m00"]
    return RegionOutline(
        bbox=(x, y, w, h),
        mask=crop,
        contour=largest.reshape(-1, 2).astype(np.float32),
        centroid=(sums["m10"] / area + x, sums["m01"] / area + y),
        area=area,
        cut=bool(x == 0 or y == 0 or x + w == size[0] or y + h == size[1]),
    )
