"""Segmentation into objects: each pixel is assigned to the object that explains it best."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.colours import colour_bins
from visup.percepts.appearance.models.pose import PatchPose, Window, paint, window_of
from visup.percepts.appearance.models.rest_memory import RestMemory
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking._rest_check_jit import unchanged_pixels
from visup.percepts.appearance.tracking.verification import explained_pixels, template_of

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

Claim = tuple[Window, Floats]
"""A window (left, top, right, bottom) and (h, w) float32 log odds that its pixels are the object's."""

_SHAPE = np.float32(3.0)  # log odds of a pixel well within an object, or well outside
_COLOUR = np.float32(2.0)  # most log odds of a colour
_LIKE, _UNLIKE = np.float32(1.0), np.float32(-1.5)  # log odds of a match with the template, or none
_INNER = np.float32(4.0)  # distance to the outline of a pixel well in or out, patch pixels
_LIMB = 11.0  # how far a limb may extend beyond the outline, patch pixels
_UNLIKE_ALL = 2.5  # log odds above which a colour is unique to the object
_CHANGED = 14, 7  # tolerance of lightness and of colour of a pixel at rest, steps
# Log odds of unchanged and of changed pixels of an object at rest. An unchanged pixel shows no occluder, so
# it outweighs any claim of another object.
_SAME, _DIFFERENT = np.float32(5.0), np.float32(-2.0)
NOWHERE = np.float32(-9.0)  # log odds of pixels outside an object's patch


def appearance_log_odds(scene: Scene, pose: PatchPose, appearance: Appearance) -> Claim | None:
    """Log odds that pixels near an object are its own.

    Args:
        scene: The frame.
        pose: Pose of the object.
        appearance: Its appearance.

    Returns:
        The window and (h, w) float32 log odds; None when the object is out of view.
    """
    window = window_of(pose, appearance.shape, scene.size)
    if window is None:
        return None
    lab = scene.patch(pose, appearance.shape)
    odds = appearance.colours.odds(colour_bins(lab))
    log_odds = _shape_odds(appearance.mask, odds) + np.clip(odds, -_COLOUR, _COLOUR)
    like, _ = explained_pixels(template_of(appearance.lab, appearance.mask), lab)
    log_odds += np.where(like, _LIKE, _UNLIKE) * np.clip(appearance.mask * 2 - 1, 0, 1)
    return window, np.asarray(paint(log_odds, pose, window, float(NOWHERE)), dtype=np.float32)


def _shape_odds(mask: Floats, colours: Floats) -> Floats:
    """(h, w) float32: log odds of pixels by their distance to the outline.

    Limbs move, so a colour unique in the surroundings may extend the outline.
    """
    inside = (mask > 0.5).view(np.uint8)
    if not inside.any():
        return np.full(mask.shape, -_SHAPE)
    within = cv2.distanceTransform(inside, cv2.DIST_L2, 3)
    without = cv2.distanceTransform(np.uint8(1) - inside, cv2.DIST_L2, 3)
    depth = np.minimum(within, _INNER) / _INNER - np.minimum(without, _INNER) / _INNER
    limb = (colours > _UNLIKE_ALL) & (without > 0) & (without < _LIMB)
    return np.where(limb, np.maximum(depth * _SHAPE, -0.5 * _COLOUR), depth * _SHAPE)


def rest_log_odds(rest: RestMemory, same: Mask) -> Claim:
    """Log odds that pixels still belong to an object at rest.

    Args:
        rest: Its rest memory.
        same: From `unchanged`.
    """
    log_odds = np.where(same, _SAME, _DIFFERENT)
    log_odds[~rest.blob.mask] = NOWHERE
    return rest.blob.window, log_odds


def unchanged(scene: Scene, rest: RestMemory) -> Mask:
    """(h, w) bool: pixels of a resting object's window that equal its memory but for lighting."""
    left, top, right, bottom = rest.blob.window
    now = np.ascontiguousarray(scene.lab[0][top:bottom, left:right])
    same = unchanged_pixels(now, rest.lab, *_CHANGED)
    if same.all():
        return same
    # Single pixels that flicker are noise.
    changed = cv2.morphologyEx((~same).view(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    return np.asarray(changed == 0)


def assign_pixels(claims: Sequence[Claim | None], size: tuple[int, int]) -> list[Blob | None]:
    """The pixels that each object wins.

    Args:
        claims: For each object its window and (h, w) float32 log odds.
        size: (width, height) of the image.

    Returns:
        For each object its visible blob, including specks; None where nothing remains.
    """
    best = np.zeros(size[::-1], dtype=np.float32)
    for claim in claims:
        if claim is not None:
            left, top, right, bottom = claim[0]
            part = best[top:bottom, left:right]
            np.maximum(part, claim[1], out=part)
    out: list[Blob | None] = []
    for claim in claims:
        if claim is None:
            out.append(None)
            continue
        left, top, right, bottom = claim[0]
        mask = (claim[1] > 0) & (claim[1] >= best[top:bottom, left:right])
        out.append(Blob(claim[0], mask) if mask.any() else None)
    return out


def without_specks(blob: Blob) -> Blob | None:
    """The blob without small connected components; None if it is empty."""
    mask = blob.mask.view(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    if count < 2:
        return None
    areas = stats[1:, cv2.CC_STAT_AREA]
    keep = np.zeros(count, dtype=bool)
    keep[1:] = areas >= max(0.12 * areas.max(), 6)
    if keep[1:].all():
        return blob
    return Blob(blob.window, keep[labels])
