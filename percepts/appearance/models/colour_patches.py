"""Localisation of a taught object by colour alone, for when its shape and texture match no taught view.

An object at rest in another light, turned, or cut off by the border of the image matches no taught view.
It is accepted where its colours form one connected patch of about its size that stands out from its
surroundings, provided that no other patch of the image is nearly as good.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.colours import OWN_LOG_ODDS, colour_bins
from visup.percepts.appearance.models.moving_body import colour_similarity
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene

MIN_EXCESS = 0.85
"""Least share of a patch's pixels with the object's colours, in excess of that of its surroundings."""

MIN_SIMILARITY = 0.45
"""Least intersection of the colour histograms of a patch and of the object. In 54 rendered and real clips no
patch of another object passes both this and `MIN_EXCESS`, but for identical bottles."""

MIN_RATIO = 1.5
"""Least ratio of the best patch's agreement to that of the second best."""

SIZE_RANGE = (0.5, 1.6)
"""Least and greatest size (square root of the area) of a patch, relative to the object's."""

_SPECK = np.ones((3, 3), np.uint8)  # smaller patches are noise
_GAP = np.ones((5, 5), np.uint8)  # narrower gaps are closed


@dataclass(frozen=True, slots=True, eq=False)
class ColourPatch:
    """A patch with the colours of a taught object.

    Attributes:
        pose: Pose of the object, working pixels.
        share: How well the colours agree, 0 to 1.
        blob: Pixels of the patch.
    """

    pose: PatchPose
    share: float
    blob: Blob


def unique_colour_patch(
    scene: Scene, appearance: Appearance, unit: float, where: NDArray[np.bool_] | None = None
) -> ColourPatch | None:
    """The only patch of the image with an object's colours and about its size, if there is one.

    Args:
        scene: The frame.
        appearance: Appearance of the object, as taught or as last seen.
        unit: Expected scale: working pixels per pixel of the appearance's patch.
        where: (h, w) bool, of any size: parts of the image that may hold it; None for all.

    Returns:
        The patch; None if there is none, or if a second one is nearly as good.
    """
    smallest, largest = SIZE_RANGE
    found: list[tuple[float, Blob]] = []
    for blob in _patches(scene, appearance, where):
        if smallest < float(np.sqrt(blob.area)) / (2 * appearance.radius * unit) < largest:
            excess, similarity = colour_similarity(scene, appearance, blob)
            found.append((max(excess, 0.0) * similarity, blob))
    found.sort(key=lambda f: -f[0])
    rival = found[1][0] if len(found) > 1 else 0.0
    if (
        not found
        or rival * MIN_RATIO > found[0][0]
        or not has_similar_colours(scene, appearance, found[0][1])
    ):
        return None
    best, blob = found[0]
    return ColourPatch(_pose_of(blob, appearance, unit, scene.size), float(np.sqrt(best)), blob)


def has_similar_colours(scene: Scene, appearance: Appearance, blob: Blob) -> bool:
    """Whether a blob has the colours of an object and its surroundings do not."""
    excess, similarity = colour_similarity(scene, appearance, blob)
    return excess > MIN_EXCESS and similarity > MIN_SIMILARITY


def _patches(
    scene: Scene, appearance: Appearance, where: NDArray[np.bool_] | None
) -> Iterator[Blob]:
    """The connected components of pixels with an object's colours, after opening and closing."""
    has_own_colour = appearance.colours.odds(colour_bins(scene.lab[0])) > OWN_LOG_ODDS
    if where is not None:
        near = cv2.resize(where.view(np.uint8), scene.size, interpolation=cv2.INTER_NEAREST)
        has_own_colour &= np.asarray(near) > 0
    opened = cv2.morphologyEx(has_own_colour.view(np.uint8), cv2.MORPH_OPEN, _SPECK)
    closed = cv2.morphologyEx(opened, cv2.MORPH_CLOSE, _GAP)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(closed)
    for k in range(1, count):
        x, y, w, h = (int(v) for v in boxes[k, :4])
        part: NDArray[np.bool_] = np.equal(labels[y : y + h, x : x + w], k)
        yield Blob((x, y, x + w, y + h), part)


def _pose_of(blob: Blob, appearance: Appearance, unit: float, size: tuple[int, int]) -> PatchPose:
    """The pose of an object that a patch shows completely, except for what the border cuts off."""
    box = cv2.boundingRect((appearance.mask > 0.5).astype(np.uint8))
    middle = (appearance.shape[1] - 1) / 2, (appearance.shape[0] - 1) / 2
    at = [
        _along(blob.window[k], blob.window[k + 2], size[k], box[k + 2] * unit)
        - (box[k] + (box[k + 2] - 1) / 2 - middle[k]) * unit
        for k in range(2)
    ]
    return PatchPose(at[0], at[1], unit)


def _along(low: int, high: int, limit: int, extent: float) -> float:
    """The centre of an object along one axis, working pixels.

    If exactly one side is cut off by the border, it follows from the other side and the object's extent.
    """
    cut = low <= 0, high >= limit
    if cut == (True, False) and high < extent:
        return high - 0.5 - extent / 2
    if cut == (False, True) and high - low < extent:
        return low - 0.5 + extent / 2
    return (low + high - 1) / 2
