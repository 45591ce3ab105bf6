"""Localisation of a taught object by colour alone, for when its shape and texture match no taught view.

An object at rest in another light, turned, or cut off by the border of the picture matches no taught view.
It is accepted where its colours form one connected patch of about its size that stands out from its
surroundings, provided that no other patch of the picture is nearly as good.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.blob import Blob
from visup.percepts.appearance.looks.bodies import body_colours
from visup.percepts.appearance.looks.colours import OWN, colour_bins
from visup.percepts.appearance.looks.pose import PatchPose
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import Appearance

EXCESS = 0.85
"""Least share of a patch's pixels with the object's colours, in excess of that of its surroundings."""

ALIKE = 0.45
"""Least intersection of the colour histograms of a patch and of the object. In 54 rendered and real clips no
patch of another object passes both this and `EXCESS`, but for identical bottles."""

APART = 1.5
"""Least ratio of the best patch's agreement to that of the second best."""

SIDES = (0.5, 1.6)
"""Least and greatest size (square root of the area) of a patch, relative to the object's."""

_SPECK = np.ones((3, 3), np.uint8)  # smaller patches are noise
_GAP = np.ones((5, 5), np.uint8)  # narrower gaps are closed


@dataclass(frozen=True, slots=True, eq=False)
class FoundPatch:
    """A patch with the colours of a taught object.

    Attributes:
        pose: Pose of the object, working pixels.
        share: How well the colours agree, 0 to 1.
        blob: Pixels of the patch.
    """

    pose: PatchPose
    share: float
    blob: Blob


def only_patch(
    scene: Scene, it: Appearance, unit: float, where: NDArray[np.bool_] | None = None
) -> FoundPatch | None:
    """The only patch of the picture with an object's colours and about its size, if there is one.

    Args:
        scene: The frame.
        it: Appearance of the object, as taught or as last seen.
        unit: Expected scale: working pixels per pixel of the appearance's patch.
        where: (h, w) bool, of any size: parts of the picture that may hold it; None for all.

    Returns:
        The patch; None if there is none, or if a second one is nearly as good.
    """
    least, most = SIDES
    found: list[tuple[float, Blob]] = []
    for blob in _patches(scene, it, where):
        if least < float(np.sqrt(blob.area)) / (2 * it.radius * unit) < most:
            excess, alike = body_colours(scene, it, blob)
            found.append((max(excess, 0.0) * alike, blob))
    found.sort(key=lambda f: -f[0])
    rival = found[1][0] if len(found) > 1 else 0.0
    if not found or rival * APART > found[0][0] or not looks_alike(scene, it, found[0][1]):
        return None
    best, blob = found[0]
    return FoundPatch(_pose_of(blob, it, unit, scene.size), float(np.sqrt(best)), blob)


def looks_alike(scene: Scene, it: Appearance, blob: Blob) -> bool:
    """Whether a blob has the colours of an object and its surroundings do not."""
    excess, alike = body_colours(scene, it, blob)
    return excess > EXCESS and alike > ALIKE


def _patches(scene: Scene, it: Appearance, where: NDArray[np.bool_] | None) -> Iterator[Blob]:
    """The connected components of pixels with an object's colours, after opening and closing."""
    own = it.colours.odds(colour_bins(scene.lab[0])) > OWN
    if where is not None:
        near = cv2.resize(where.view(np.uint8), scene.size, interpolation=cv2.INTER_NEAREST)
        own &= np.asarray(near) > 0
    opened = cv2.morphologyEx(own.view(np.uint8), cv2.MORPH_OPEN, _SPECK)
    closed = cv2.morphologyEx(opened, cv2.MORPH_CLOSE, _GAP)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(closed)
    for k in range(1, count):
        x, y, w, h = (int(v) for v in boxes[k, :4])
        part: NDArray[np.bool_] = np.equal(labels[y : y + h, x : x + w], k)
        yield Blob((x, y, x + w, y + h), part)


def _pose_of(blob: Blob, it: Appearance, unit: float, size: tuple[int, int]) -> PatchPose:
    """The pose of an object that a patch shows completely, except for what the border cuts off."""
    box = cv2.boundingRect((it.mask > 0.5).astype(np.uint8))
    middle = (it.shape[1] - 1) / 2, (it.shape[0] - 1) / 2
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
