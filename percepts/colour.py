"""Colour palettes of regions, for tasks that identify actors by colour.

A region's border mixes with its surroundings and depends on the segmentation, so the mask is eroded first.
Palettes are named in `rules/traits/colours.py`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.contract.behaviour import Contract
from visup.agent.contract.saving import Stateless
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Observation, Percept, Region

LIGHTNESS_STEP, CHROMA_STEP = 8.0, 10.0
"""Bin widths of L*, and of a* and b*: finer than colour words."""

ENTRIES = 12
"""Most entries of a palette."""

SAMPLES = 600
"""Sampled pixels of a region: shares are then accurate to a few hundredths."""

ERODED = 0.04
"""Erosion of a mask, as a share of the square root of its area."""

Palette = tuple[tuple[float, float, float, float], ...]
"""(L*, a*, b*, share) of each entry, the greatest share first; shares sum to at most 1."""


class ColourBehaviour(Stateless):
    """Reports a palette of each region, five times a second.

    Its percepts are of the kind 'colour'; their value is a mapping of `region_id` and `palette`.
    """

    contract = Contract("colour", gives=("colour",), needs=("region",), every_s=0.2)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One palette for each region with pixels in the image."""
        for region in observation.of("region"):
            found = palette(frame.image, region)
            if found:
                value = {"region_id": region.id, "palette": found}
                yield Percept("colour", value, frame.time, self.contract.name)


def palette(image: NDArray[np.uint8], region: Region) -> Palette:
    """The colours of a region.

    Args:
        image: (H, W, 3) uint8, BGR.
        region: Its mask may reach beyond the image; that part is ignored.

    Returns:
        At most `ENTRIES` colours in CIE L*a*b* (L* 0 to 100); empty when none of it is in the image.

    Example:
        >>> mask = np.ones((20, 20), bool)
        >>> region = Region(1, (0, 0, 20, 20), mask, np.zeros((0, 2), np.float32), (9.5, 9.5), 400.0)
        >>> palette(np.full((20, 20, 3), (0, 0, 255), np.uint8), region)
        ((52.0, 80.0, 70.0, 1.0),)
    """
    pixels = _pixels(image, region)
    if not len(pixels):
        return ()
    scaled = (pixels[None].astype(np.float32)) / np.float32(255.0)
    lab = cv2.cvtColor(scaled, cv2.COLOR_BGR2Lab)[0]
    steps = np.array([LIGHTNESS_STEP, CHROMA_STEP, CHROMA_STEP])
    middle = np.array(
        [0.5, 0.0, 0.0]
    )  # bins of L* start at black, those of a* and b* are centred on grey
    bins, counts = np.unique(np.rint(lab / steps - middle), axis=0, return_counts=True)
    order = np.argsort(-counts, kind="stable")[:ENTRIES]
    return tuple(
        (*((b + middle) * steps).tolist(), round(float(n) / len(pixels), 6))
        for b, n in zip(bins[order], counts[order], strict=True)
    )


def _pixels(image: NDArray[np.uint8], region: Region) -> NDArray[np.uint8]:
    """(N, 3) evenly sampled pixels of a region, without its border where enough remains."""
    x, y, w, h = region.bbox
    left, top = max(0, x), max(0, y)
    right, bottom = min(image.shape[1], x + w), min(image.shape[0], y + h)
    if right <= left or bottom <= top:
        return np.zeros((0, 3), np.uint8)
    mask = region.mask[top - y : bottom - y, left - x : right - x]
    inner = _eroded(mask)
    found = image[top:bottom, left:right][inner if inner.any() else mask]
    return found[:: max(1, len(found) // SAMPLES)]


def _eroded(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    radius = max(1, round(ERODED * math.sqrt(float(np.count_nonzero(mask)))))
    kernel = np.ones((2 * radius + 1, 2 * radius + 1), np.uint8)
    return cv2.erode(mask.astype(np.uint8), kernel, borderValue=0).astype(bool)
