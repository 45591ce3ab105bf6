"""Detection of an object in the whole image, at several scales and rotations."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.colours import OWN_LOG_ODDS, colour_bins
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.verification import Match, verify

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

COARSE = 13.0  # side to which an object is reduced for a search of the whole image, pixels
_MOST = 6  # most positions to verify
_EACH = 3  # most candidate positions per scale and rotation


def search_image(
    scene: Scene,
    appearance: Appearance,
    poses: Sequence[PatchPose],
    most: int = _MOST,
    where: Mask | None = None,
) -> list[Match]:
    """The positions most similar to an object.

    Args:
        scene: The frame.
        appearance: The object's appearance.
        poses: Scales and rotations to try; positions are ignored.
        most: Most positions to verify.
        where: (h, w) bool, of any size: parts of the image that may hold the object's centre.

    Returns:
        Matches, best first.
    """
    found = [c for p in poses for c in _coarse_matches(scene, appearance, p, where)]
    found.sort(key=lambda c: c[0])
    places: list[PatchPose] = []
    for _, pose in found:
        if len(places) < most and not any(
            _is_same_position(pose, p, appearance.radius) for p in places
        ):
            places.append(pose)
    matches = [verify(scene, appearance, p) for p in places]
    return sorted(matches, key=lambda m: -m.score)


def colour_peaks(
    scene: Scene, appearance: Appearance, pose: PatchPose, where: Mask | None = None
) -> list[tuple[float, PatchPose]]:
    """Positions where an object's colours concentrate, for objects that have bent or turned.

    Args:
        scene: The frame.
        appearance: The object's last appearance.
        pose: Its scale and rotation; the position is ignored.
        where: (h, w) bool, of any size: parts of the image that may hold the object's centre.

    Returns:
        The two best positions as (excess, pose): share of pixels with the object's colours inside the pose
        minus that around it, -1 to 1; best first.
    """
    reduction = min(1.0, COARSE / (2 * appearance.radius * pose.scale))
    width, height = scene.size
    size = max(8, round(width * reduction)), max(8, round(height * reduction))
    image = np.asarray(cv2.resize(scene.lab[0], size, interpolation=cv2.INTER_AREA), np.uint8)
    own = (appearance.colours.odds(colour_bins(image)) > OWN_LOG_ODDS).astype(np.float32)
    at, inside, around = _colour_kernels(appearance, pose, reduction)
    off = own.mean()
    more = cv2.filter2D(own - off, -1, inside - around, borderType=cv2.BORDER_CONSTANT)
    if where is not None:
        more[~_allowed_corners(where, size, more.shape, at)] = -1
    reach = max(2, round(0.6 * COARSE))
    out = []
    for _ in range(2):
        y, x = divmod(int(more.argmax()), more.shape[1])
        place = (x + at[0] + 0.5) / reduction - 0.5, (y + at[1] + 0.5) / reduction - 0.5
        out.append((float(more[y, x]), PatchPose(place[0], place[1], pose.scale, pose.angle)))
        more[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = -1
    return out


def _colour_kernels(
    appearance: Appearance, pose: PatchPose, reduction: float
) -> tuple[tuple[float, float], Floats, Floats]:
    """The offset of the patch's centre from the kernels' centre, and two kernels that each sum to 1.

    The first kernel weighs pixels within the object, the second those around it.
    """
    _, mask, middle = _small_template(appearance, pose, reduction)
    wide = np.pad(mask, 5)
    soft = cv2.GaussianBlur(wide, (0, 0), 1.5)
    ring = cv2.dilate(wide, np.ones((9, 9), np.uint8)) - cv2.dilate(wide, np.ones((3, 3), np.uint8))
    inside = np.asarray(soft / max(float(soft.sum()), 1e-6), dtype=np.float32)
    around = np.asarray(ring / max(float(ring.sum()), 1e-6), dtype=np.float32)
    h, w = wide.shape
    return (middle[0] + 5 - w // 2, middle[1] + 5 - h // 2), inside, around


def _is_same_position(a: PatchPose, b: PatchPose, radius: float) -> bool:
    """Whether verification of one position would find the other."""
    near = a.apart(b, 0) <= 0.4 * radius * a.scale + abs(a.scale - b.scale)
    return near and abs(a.angle - b.angle) < 0.3 and 0.8 < a.scale / b.scale < 1.25


def _coarse_matches(
    scene: Scene, appearance: Appearance, pose: PatchPose, where: Mask | None
) -> list[tuple[float, PatchPose]]:
    """Positions of one scale and rotation by colour alone: (mean squared difference, pose)."""
    side = float(np.sqrt(appearance.mask.sum())) * pose.scale
    reduction = min(1.0, COARSE / side)
    width, height = scene.size
    size = max(8, round(width * reduction)), max(8, round(height * reduction))
    image = cv2.resize(scene.lab[0], size, interpolation=cv2.INTER_AREA)
    template, mask, middle = _small_template(appearance, pose, reduction)
    h, w = mask.shape
    if h >= size[1] or w >= size[0]:
        return []
    count = float(mask.sum())
    off = cv2.matchTemplate(image, template, cv2.TM_SQDIFF, mask=np.repeat(mask[..., None], 3, 2))
    off = np.nan_to_num(off / np.float32(3 * max(count, 1.0)), nan=1e6, posinf=1e6)
    if where is not None:
        off[~_allowed_corners(where, size, off.shape, middle)] = 1e6
    out = []
    for _ in range(_EACH):
        y, x = divmod(int(off.argmin()), off.shape[1])
        value = float(off[y, x])
        if value >= 1e6:
            break
        at = (x + middle[0] + 0.5) / reduction - 0.5, (y + middle[1] + 0.5) / reduction - 0.5
        out.append((value, PatchPose(at[0], at[1], pose.scale, pose.angle)))
        off[max(0, y - h // 3) : y + h // 3 + 1, max(0, x - w // 3) : x + w // 3 + 1] = 1e6
    return out


def _allowed_corners(
    where: Mask, size: tuple[int, int], shape: tuple[int, ...], middle: tuple[float, float]
) -> Mask:
    """(h, w) bool, of `shape`: positions of the template's corner for which its centre is in `where`."""
    reduction = cv2.resize(where.view(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    ys = np.clip(np.arange(shape[0]) + round(middle[1]), 0, size[1] - 1)
    xs = np.clip(np.arange(shape[1]) + round(middle[0]), 0, size[0] - 1)
    return np.asarray(reduction[np.ix_(ys, xs)] > 0)


def _small_template(
    appearance: Appearance, pose: PatchPose, reduction: float
) -> tuple[NDArray[np.uint8], NDArray[np.float32], tuple[float, float]]:
    """The object rendered at a scale and rotation, cropped: image, mask, centre of its patch."""
    by = pose.scale * reduction
    reach = int(np.ceil(np.hypot(*appearance.shape) * by / 2)) + 1
    at = PatchPose(reach, reach, by, pose.angle)
    matrix = at.matrix(appearance.shape)
    lab = appearance.lab if by > 0.7 else cv2.GaussianBlur(appearance.lab, (0, 0), 0.4 / by)
    mask = appearance.mask if by > 0.7 else cv2.GaussianBlur(appearance.mask, (0, 0), 0.4 / by)
    size = (2 * reach + 1, 2 * reach + 1)
    lab = cv2.warpAffine(lab, matrix, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    mask = cv2.warpAffine(mask, matrix, size, flags=cv2.INTER_LINEAR)
    x, y, w, h = cv2.boundingRect((mask > 0.4).astype(np.uint8))
    if w == 0 or h == 0:
        x, y, w, h = reach, reach, 1, 1
    part = np.s_[y : y + h, x : x + w]
    sure = np.asarray(mask[part] > 0.4, dtype=np.float32)
    return np.ascontiguousarray(lab[part]), sure, (reach - x, reach - y)
