"""Appearance models of objects from taught views: patch, mask, colours, filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.colours import ColourModel, colour_bins, learn_colours
from visup.percepts.appearance.models.correlation_filter import CorrelationFilter, learn_filter
from visup.percepts.appearance.models.features import CELL, cell_features
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene, prepare_scene, work_scale
from visup.percepts.taught.taught_view import TaughtView

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

SIDE = 44.0  # side of a square object in its patch, pixels
LONGEST = 104.0  # most pixels of an object's longer side
AROUND = 1.15  # margin of a patch around the object, in sides


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """One view of an object, as a patch with the object in the middle.

    Attributes:
        lab: (h, w, 3) uint8, CIE Lab.
        mask: (h, w) float32, 0 to 1, the object.
        colours: Colours of the object and its surroundings.
        filter: Filter learned on the patch.
    """

    lab: Bytes
    mask: Floats
    colours: ColourModel
    filter: CorrelationFilter

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of the patch."""
        return self.lab.shape[0], self.lab.shape[1]

    @property
    def area(self) -> float:
        """Area of the object, pixels of the patch."""
        return float(self.mask.sum())

    @property
    def radius(self) -> float:
        """Half the side of a square of the object's area, pixels of the patch."""
        return 0.5 * float(np.sqrt(self.area))


@dataclass(frozen=True, slots=True, eq=False)
class ViewModel:
    """An appearance and where it was taught.

    Attributes:
        name: Name of the object.
        appearance: Its appearance.
        pose: Its pose, working pixels of the image in which it was taught.
        size: (width, height) of that image, working pixels.
        scene: (H, W, 3) uint8, BGR: that image, reduced.
    """

    name: str
    appearance: Appearance
    pose: PatchPose
    size: tuple[int, int]
    scene: Bytes


def view_models(views: Sequence[TaughtView]) -> tuple[ViewModel, ...]:
    """The models of taught views, in order."""
    return tuple(_view_model(v) for v in views)


def _view_model(view: TaughtView) -> ViewModel:
    scale = work_scale(view.frame_size)
    scene = _part_scene(view.image, scale)
    x, y, w, h = cv2.boundingRect(view.mask.astype(np.uint8))
    pose, shape = _fitted((x * scale, y * scale, w * scale, h * scale))
    mask = _mask_patch(view.mask, pose, shape, scale)
    origin = view.origin[0] * scale, view.origin[1] * scale
    placed = PatchPose(pose.x + origin[0], pose.y + origin[1], pose.scale)
    size = round(view.frame_size[0] * scale), round(view.frame_size[1] * scale)
    return ViewModel(
        view.name, learn_appearance(scene.patch(pose, shape), mask), placed, size, view.scene
    )


def _part_scene(image: Bytes, scale: float) -> Scene:
    if scale < 1:
        size = max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return prepare_scene(image, 0.0)


def _fitted(box: tuple[float, float, float, float]) -> tuple[PatchPose, tuple[int, int]]:
    """The pose and size of the patch that shows a box and its margin."""
    x, y, w, h = box
    side = float(np.sqrt(w * h))
    by = min(SIDE / side, LONGEST / max(w, h))
    around = AROUND * side * by
    width, height = (int(np.ceil((v * by + around) / CELL)) * CELL for v in (w, h))
    return PatchPose(x + (w - 1) / 2, y + (h - 1) / 2, 1 / by), (height, width)


def _mask_patch(
    mask: NDArray[np.bool_], pose: PatchPose, shape: tuple[int, int], scale: float
) -> Floats:
    whole = PatchPose(
        (pose.x + 0.5) / scale - 0.5, (pose.y + 0.5) / scale - 0.5, pose.scale / scale
    )
    soft = np.asarray(mask, dtype=np.float32)
    if whole.scale > 1.5:
        soft = np.asarray(cv2.GaussianBlur(soft, (0, 0), whole.scale / 2.5), dtype=np.float32)
    matrix = whole.matrix(shape)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(
        cv2.warpAffine(soft, matrix, shape[::-1], flags=flags, borderMode=cv2.BORDER_CONSTANT),
        dtype=np.float32,
    )


def learn_appearance(lab: Bytes, mask: Floats) -> Appearance:
    """Build an appearance from a patch and its mask."""
    colours = learn_colours(lab, mask, surroundings(mask))
    return Appearance(lab, mask, colours, learned_filter(lab, mask, colours))


def surroundings(mask: Floats) -> Floats:
    """(h, w) float32: weight of each pixel of a patch as surroundings."""
    near = cv2.dilate(mask, np.ones((5, 5), np.uint8))
    return np.asarray(1 - near, dtype=np.float32)


def learned_filter(lab: Bytes, mask: Floats, colours: ColourModel) -> CorrelationFilter:
    """The filter of a patch with the object in the middle."""
    features = cell_features(lab, colours.odds(colour_bins(lab)))
    rows, cols = features.shape[1:]
    support = cv2.resize(mask, (cols, rows), interpolation=cv2.INTER_AREA)
    support = np.asarray(cv2.dilate(support, np.ones((3, 3), np.uint8)), dtype=np.float32)
    size = float(np.sqrt(max((support > 0.3).sum(), 1)))
    return learn_filter(features, (support > 0.25).astype(np.float32), size)
