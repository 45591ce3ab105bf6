"""Verification: how well a position of the image matches an appearance."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.colours import OWN_LOG_ODDS, ColourModel, colour_bins
from visup.percepts.appearance.models.correlation_filter import CorrelationFilter, peak_of
from visup.percepts.appearance.models.features import CELL, cell_features
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_NEAR = np.array([16, 9, 9], dtype=np.int16)  # tolerance of a matching pixel, steps of Lab
_MAX_DIFFERENCE = np.float32(60.0)  # most that a pixel counts in a mean difference, steps of Lab
_LIGHTER = 30.0  # most overall change of lightness, steps
_BLOCK = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class Match:
    """The match of a pose.

    Attributes:
        pose: Position of the filter's peak.
        peak: Height of the peak, about 1 where the object is as learned.
        explained_share: Share of the object's pixels that look as expected, 0 to 1.
    """

    pose: PatchPose
    peak: float
    explained_share: float

    @property
    def score(self) -> float:
        """Combination of both, 0 to 1."""
        return float(np.sqrt(np.clip(self.peak, 0, 1) * self.explained_share))


def filter_peak(
    scene: Scene,
    pose: PatchPose,
    shape: tuple[int, int],
    colours: ColourModel,
    correlation_filter: CorrelationFilter,
) -> tuple[PatchPose, float]:
    """The pose shifted to the peak of a filter's response near it, and the height of the peak.

    Args:
        scene: The frame.
        pose: Expected pose, working pixels.
        shape: (height, width) of the filter's patch.
        colours: Colours of the object.
        correlation_filter: Filter of the object.
    """
    lab = scene.patch(pose, shape)
    features = cell_features(lab, colours.odds(colour_bins(lab)))
    dx, dy, peak = peak_of(correlation_filter.response(features))
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
    expected = (template.low[..., 0] + template.high[..., 0]) // 2
    inside = template.weight > 0.5
    if not inside.any():
        return np.zeros(lab.shape[:2], dtype=bool), 0.0
    pixels = lab.astype(np.int16)
    lighter = np.median((pixels[..., 0] - expected)[inside])
    pixels[..., 0] -= np.int16(np.clip(lighter, -_LIGHTER, _LIGHTER))
    matches: NDArray[np.bool_] = np.asarray(
        np.all((pixels >= template.low) & (pixels <= template.high), axis=2)
    )
    weight = float(template.weight.sum())
    return matches, float((template.weight * matches).sum()) / max(weight, 1e-6)


def mean_difference(appearance: Appearance, lab: Bytes) -> float:
    """Mean difference of an object's pixels from a patch, steps of Lab; large ones are capped."""
    off = cv2.absdiff(appearance.lab, lab).sum(axis=2, dtype=np.float32)
    weighted = np.minimum(off, _MAX_DIFFERENCE) * appearance.mask
    return float(weighted.sum() / max(appearance.area, 1e-6))


def colour_agreement(
    scene: Scene, pose: PatchPose, appearance: Appearance
) -> tuple[float, PatchPose]:
    """Excess of an object's colours at its position over the surroundings, and their centre.

    Args:
        scene: The frame.
        pose: Expected pose.
        appearance: Its appearance.

    Returns:
        The share of the object's pixels with its colours minus that of the surroundings, -1 to 1, and
        the pose shifted to the centre of these colours.
    """
    odds = appearance.colours.odds(colour_bins(scene.patch(pose, appearance.shape)))
    has_own_colour = (odds > OWN_LOG_ODDS).astype(np.float32)
    inside = float((has_own_colour * appearance.mask).sum()) / max(appearance.area, 1e-6)
    ring = _ring(appearance.mask)
    around = float((has_own_colour * ring).sum()) / max(float(ring.sum()), 1e-6)
    near = cv2.GaussianBlur(cv2.dilate(appearance.mask, np.ones((9, 9), np.uint8)), (0, 0), 5.0)
    weight = has_own_colour * near
    total = float(weight.sum())
    if total < 0.1 * appearance.area:
        return inside - around, pose
    rows, cols = np.indices(has_own_colour.shape, dtype=np.float32)
    x, y = (float((weight * at).sum()) / total for at in (cols, rows))
    area = appearance.area
    u, v = (float((appearance.mask * at).sum()) / area for at in (cols, rows))
    return inside - around, pose.shifted(x - u, y - v)


def _ring(mask: Floats) -> Floats:
    """(h, w) float32: the close surroundings of an object, without its rim."""
    near = cv2.dilate(mask, np.ones((5, 5), np.uint8))
    far = cv2.dilate(mask, np.ones((21, 21), np.uint8))
    return np.asarray(np.clip(far - near, 0, 1), dtype=np.float32)


def verify(scene: Scene, appearance: Appearance, pose: PatchPose) -> Match:
    """Match an object near a pose, after a local search over position and scale."""
    pose, peak = filter_peak(scene, pose, appearance.shape, appearance.colours, appearance.filter)
    for factor in (1.0, 0.93, 1.075):
        at, other_peak = filter_peak(
            scene, pose.resized(factor), appearance.shape, appearance.colours, appearance.filter
        )
        if other_peak > peak:
            pose, peak = at, other_peak
    template = template_of(appearance.lab, appearance.mask)
    _, share = explained_pixels(template, scene.patch(pose, appearance.shape))
    return Match(pose, peak, share)
