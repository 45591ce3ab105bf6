"""Removal of moving regions that taught objects already explain."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.moving_body import MovingBody
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.motion.outlines.region_outline import clean_mask, describe_mask

COMPARED_SIZE = 384  # longer side of the image for comparing regions, pixels
RIM_WIDTH = 0.12  # tolerance around an object's outline, as a share of the square root of its area
EXPLAINED_SHARE = 0.5  # share of a region inside an object from which the object explains it
REMAINING_SHARE = 0.35  # least share of a region that remains when reported without the object
REMAINING_AREA = 0.0004  # least remaining area, as a share of the image

Mask = NDArray[np.bool_]


def unexplained(
    moving: Sequence[Region], objects: Sequence[Region], size: tuple[int, int]
) -> tuple[Region, ...]:
    """The moving regions that no object explains, each without the objects' pixels.

    Args:
        moving: Regions of motion segmentation.
        objects: Taught objects in view.
        size: (width, height) of the frame.
    """
    if not moving or not objects:
        return tuple(moving)
    near = _dilated_objects(objects, size)
    out = []
    for region in moving:
        left = _unexplained_part(region, objects, near, size)
        if left is not None:
            out.append(left)
    return tuple(out)


def region_iou(region: Region, blob: Blob, scene: Scene) -> float:
    """Intersection over union of a region and a blob.

    Args:
        region: In frame pixels.
        blob: In working pixels of the scene.
        scene: The scene, for its scale.
    """
    here = np.zeros(scene.size[::-1], dtype=bool)
    left, top, right, bottom = blob.window
    here[top:bottom, left:right] = blob.mask
    there = _rasterised(region, (here.shape[0], here.shape[1]), scene.scale)
    both, either = int(np.sum(here & there)), int(np.sum(here | there))
    return both / max(either, 1)


def moving_body(region: Region, scene: Scene) -> MovingBody:
    """A moving region in working pixels of the scene."""
    return MovingBody(region.id, _scaled_blob(region, scene.size, scene.scale), region.cut)


def _dilated_objects(objects: Sequence[Region], size: tuple[int, int]) -> tuple[Mask, float]:
    """(h, w) bool: objects and their rims in a small image; and the scale of that image."""
    scale = min(1.0, COMPARED_SIZE / max(size))
    shape = max(1, round(size[1] * scale)), max(1, round(size[0] * scale))
    out = np.zeros(shape, dtype=bool)
    for r in objects:
        side = float(np.sqrt(r.area)) * scale
        reach = 2 * max(1, round(RIM_WIDTH * side)) + 1
        mask = _rasterised(r, shape, scale)
        grown = cv2.dilate(mask.view(np.uint8), np.ones((reach, reach), np.uint8))
        out |= np.asarray(grown) > 0
    return out, scale


def _rasterised(region: Region, shape: tuple[int, int], scale: float) -> Mask:
    """(h, w) bool: a region in an image of another scale."""
    blob = _scaled_blob(region, (shape[1], shape[0]), scale)
    left, top, right, bottom = blob.window
    out = np.zeros(shape, dtype=bool)
    out[top:bottom, left:right] = blob.mask
    return out


def _scaled_blob(region: Region, size: tuple[int, int], scale: float) -> Blob:
    """The pixels of a region in an image of another scale and of a size (width, height)."""
    x, y, w, h = region.bbox
    x0, y0 = min(int(x * scale), size[0] - 1), min(int(y * scale), size[1] - 1)
    x1 = min(max(x0 + 1, round((x + w) * scale)), size[0])
    y1 = min(max(y0 + 1, round((y + h) * scale)), size[1])
    part = cv2.resize(region.mask.view(np.uint8), (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA)
    return Blob((x0, y0, x1, y1), np.asarray(part) > 0)


def _unexplained_part(
    region: Region,
    objects: Sequence[Region],
    near: tuple[Mask, float],
    size: tuple[int, int],
) -> Region | None:
    """The part of a region outside the objects; None when it is insignificant."""
    covered, scale = near
    small = _rasterised(region, (covered.shape[0], covered.shape[1]), scale)
    share = float(np.mean(covered[small]))
    if share == 0.0:
        return region
    if share >= EXPLAINED_SHARE:
        return None
    left = region.mask.copy()
    for r in objects:
        _remove_object(left, region.bbox, r)
    # Remains of the rim are not worth reporting.
    mask = clean_mask(left, REMAINING_AREA * size[0] * size[1])
    if mask is None or np.count_nonzero(mask) < REMAINING_SHARE * region.area:
        return None
    return describe_mask(mask, region.bbox[:2], size).applied_to(region)


def _remove_object(left: Mask, bbox: tuple[int, int, int, int], object_region: Region) -> None:
    """Remove an object's pixels from a mask in place."""
    x, y, w, h = bbox
    u, v, n, m = object_region.bbox
    x0, y0, x1, y1 = max(x, u), max(y, v), min(x + w, u + n), min(y + h, v + m)
    if x1 > x0 and y1 > y0:
        left[y0 - y : y1 - y, x0 - x : x1 - x] &= ~object_region.mask[
            y0 - v : y1 - v, x0 - u : x1 - u
        ]
