"""Removal of moving regions that taught objects already explain."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.percepts.appearance.looks.blob import Blob
from visup.percepts.appearance.looks.bodies import MovingBody
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.motion.outlines.region_outline import clean_mask, describe_mask

SMALL = 384  # longer side of the picture for comparing regions, pixels
RIM = 0.12  # tolerance around an object's outline, as a share of the square root of its area
MAINLY = 0.5  # share of a region inside an object from which the object explains it
LEFT = 0.35  # least share of a region that remains when reported without the object
LEAST = 0.0004  # least remaining area, as a share of the picture

Mask = NDArray[np.bool_]


def unexplained(
    moving: Sequence[Region], things: Sequence[Region], size: tuple[int, int]
) -> tuple[Region, ...]:
    """The moving regions that no object explains, each without the objects' pixels.

    Args:
        moving: Regions of motion segmentation.
        things: Taught objects in view.
        size: (width, height) of the frame.
    """
    if not moving or not things:
        return tuple(moving)
    near = _near(things, size)
    out = []
    for region in moving:
        left = _rest_of(region, things, near, size)
        if left is not None:
            out.append(left)
    return tuple(out)


def shares(region: Region, blob: Blob, scene: Scene) -> float:
    """Intersection over union of a region and a blob.

    Args:
        region: In frame pixels.
        blob: In working pixels of the scene.
        scene: The scene, for its scale.
    """
    here = np.zeros(scene.size[::-1], dtype=bool)
    left, top, right, bottom = blob.window
    here[top:bottom, left:right] = blob.mask
    there = _small(region, (here.shape[0], here.shape[1]), scene.scale)
    both, either = int(np.sum(here & there)), int(np.sum(here | there))
    return both / max(either, 1)


def moving_body(region: Region, scene: Scene) -> MovingBody:
    """A moving region in working pixels of the scene."""
    return MovingBody(region.id, _scaled(region, scene.size, scene.scale), region.cut)


def _near(things: Sequence[Region], size: tuple[int, int]) -> tuple[Mask, float]:
    """(h, w) bool: objects and their rims in a small picture; and the scale of that picture."""
    scale = min(1.0, SMALL / max(size))
    shape = max(1, round(size[1] * scale)), max(1, round(size[0] * scale))
    out = np.zeros(shape, dtype=bool)
    for r in things:
        side = float(np.sqrt(r.area)) * scale
        reach = 2 * max(1, round(RIM * side)) + 1
        mask = _small(r, shape, scale)
        grown = cv2.dilate(mask.view(np.uint8), np.ones((reach, reach), np.uint8))
        out |= np.asarray(grown) > 0
    return out, scale


def _small(region: Region, shape: tuple[int, int], scale: float) -> Mask:
    """(h, w) bool: a region in a picture of another scale."""
    blob = _scaled(region, (shape[1], shape[0]), scale)
    left, top, right, bottom = blob.window
    out = np.zeros(shape, dtype=bool)
    out[top:bottom, left:right] = blob.mask
    return out


def _scaled(region: Region, size: tuple[int, int], scale: float) -> Blob:
    """The pixels of a region in a picture of another scale and of a size (width, height)."""
    x, y, w, h = region.bbox
    x0, y0 = min(int(x * scale), size[0] - 1), min(int(y * scale), size[1] - 1)
    x1 = min(max(x0 + 1, round((x + w) * scale)), size[0])
    y1 = min(max(y0 + 1, round((y + h) * scale)), size[1])
    part = cv2.resize(region.mask.view(np.uint8), (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA)
    return Blob((x0, y0, x1, y1), np.asarray(part) > 0)


def _rest_of(
    region: Region,
    things: Sequence[Region],
    near: tuple[Mask, float],
    size: tuple[int, int],
) -> Region | None:
    """The part of a region outside the objects; None when it is insignificant."""
    covered, scale = near
    small = _small(region, (covered.shape[0], covered.shape[1]), scale)
    share = float(np.mean(covered[small]))
    if share == 0.0:
        return region
    if share >= MAINLY:
        return None
    left = region.mask.copy()
    for r in things:
        _take(left, region.bbox, r)
    # Remains of the rim are not worth reporting.
    mask = clean_mask(left, LEAST * size[0] * size[1])
    if mask is None or np.count_nonzero(mask) < LEFT * region.area:
        return None
    return describe_mask(mask, region.bbox[:2], size).applied_to(region)


def _take(left: Mask, bbox: tuple[int, int, int, int], thing: Region) -> None:
    """Remove an object's pixels from a mask in place."""
    x, y, w, h = bbox
    u, v, n, m = thing.bbox
    x0, y0, x1, y1 = max(x, u), max(y, v), min(x + w, u + n), min(y + h, v + m)
    if x1 > x0 and y1 > y0:
        left[y0 - y : y1 - y, x0 - x : x1 - x] &= ~thing.mask[y0 - v : y1 - v, x0 - u : x1 - u]
