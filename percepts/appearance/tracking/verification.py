"""Verification: how well a position of the picture matches an appearance."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.colours import OWN, ColourModel, colour_bins
from visup.percepts.appearance.looks.correlation_filter import CorrelationFilter, peak_of
from visup.percepts.appearance.looks.features import CELL, cell_features
from visup.percepts.appearance.looks.pose import PatchPose
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import Appearance

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_NEAR = np.array([16, 9, 9], dtype=np.int16)  # tolerance of a matching pixel, steps of Lab
_LIGHTER = 30.0  # most overall change of lightness, steps
_BLOCK = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class Match:
    """The match of a pose.

    Attributes:
        pose: Position of the filter's peak.
        peak: Height of the peak, about 1 where the object is as learned.
        explained: Share of the object's pixels that look as expected, 0 to 1.
    """

    pose: PatchPose
    peak: float
    explained: float

    @property
    def score(self) -> float:
        """Combination of both, 0 to 1."""
        return float(np.sqrt(np.clip(self.peak, 0, 1) * self.explained))


def respond(
    scene: Scene,
    pose: PatchPose,
    shape: tuple[int, int],
    colours: ColourModel,
    it: CorrelationFilter,
) -> tuple[PatchPose, float]:
    """The pose shifted to the peak of a filter's response near it, and the height of the peak.

    Args:
        scene: The frame.
        pose: Expected pose, working pixels.
        shape: (height, width) of the filter's patch.
        colours: Colours of the object.
        it: Filter of the object.
    """
    lab = scene.patch(pose, shape)
    features = cell_features(lab, colours.odds(colour_bins(lab)))
    dx, dy, peak = peak_of(it.response(features))
    return pose.shifted(dx * CELL, dy * CELL), peak


@dataclass(frozen=True, slots=True, eq=False)
class Template:
    """Pixels of an object, each with its tolerated range.

    Attributes:
        low: (h, w, 3) int16, Lab: the darkest near each pixel.
        high: (h, w, 3) int16, the lightest.
        weight: (h, w) float32, weight of each pixel.
    """

    low: NDArray[np.int16]
    high: NDArray[np.int16]
    weight: Floats


def template_of(lab: Bytes, mask: Floats) -> Template:
    """The template of a patch; neighbouring pixels match too, since poses are inexact."""
    low = np.asarray(cv2.erode(lab, _BLOCK), dtype=np.int16) - _NEAR
    high = np.asarray(cv2.dilate(lab, _BLOCK), dtype=np.int16) + _NEAR
    return Template(low, high, mask)


def explained_pixels(template: Template, lab: Bytes) -> tuple[NDArray[np.bool_], float]:
    """Which pixels of a patch match a template, and their share of its weight."""
    middle = (template.low[..., 0] + template.high[..., 0]) // 2
    sure = template.weight > 0.5
    if not sure.any():
        return np.zeros(lab.shape[:2], dtype=bool), 0.0
    now = lab.astype(np.int16)
    lighter = np.median((now[..., 0] - middle)[sure])
    now[..., 0] -= np.int16(np.clip(lighter, -_LIGHTER, _LIGHTER))
    like: NDArray[np.bool_] = np.asarray(
        np.all((now >= template.low) & (now <= template.high), axis=2)
    )
    weight = float(template.weight.sum())
    return like, float((template.weight * like).sum()) / max(weight, 1e-6)


def colour_agreement(scene: Scene, pose: PatchPose, it: Appearance) -> tuple[float, PatchPose]:
    """Excess of an object's colours at its position over the surroundings, and their centre.

    Args:
        scene: The frame.
        pose: Expected pose.
        it: Its appearance.

    Returns:
        The share of the object's pixels with its colours minus that of the surroundings, -1 to 1, and
        the pose shifted to the centre of these colours.
    """
    odds = it.colours.odds(colour_bins(scene.patch(pose, it.shape)))
    own = (odds > OWN).astype(np.float32)
    inside = float((own * it.mask).sum()) / max(it.area, 1e-6)
    ring = _ring(it.mask)
    around = float((own * ring).sum()) / max(float(ring.sum()), 1e-6)
    reach = cv2.GaussianBlur(cv2.dilate(it.mask, np.ones((9, 9), np.uint8)), (0, 0), 5.0)
    weight = own * reach
    total = float(weight.sum())
    if total < 0.1 * it.area:
        return inside - around, pose
    rows, cols = np.indices(own.shape, dtype=np.float32)
    x, y = (float((weight * at).sum()) / total for at in (cols, rows))
    middle = it.area
    u, v = (float((it.mask * at).sum()) / middle for at in (cols, rows))
    return inside - around, pose.shifted(x - u, y - v)


def _ring(mask: Floats) -> Floats:
    """(h, w) float32: the close surroundings of an object, without its rim."""
    near = cv2.dilate(mask, np.ones((5, 5), np.uint8))
    far = cv2.dilate(mask, np.ones((21, 21), np.uint8))
    return np.asarray(np.clip(far - near, 0, 1), dtype=np.float32)


def verify(scene: Scene, it: Appearance, pose: PatchPose) -> Match:
    """Match an object near a pose, after a local search over position and scale."""
    pose, peak = respond(scene, pose, it.shape, it.colours, it.filter)
    for by in (1.0, 0.93, 1.075):
        at, height = respond(scene, pose.resized(by), it.shape, it.colours, it.filter)
        if height > peak:
            pose, peak = at, height
    template = template_of(it.lab, it.mask)
    _, share = explained_pixels(template, scene.patch(pose, it.shape))
    return Match(pose, peak, share)
