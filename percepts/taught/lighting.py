"""Other light: taught views as they would look in the light of the present image.

A lamp that is dimmed, or a cloud, changes all colours of a place alike, and with them each bin of a colour
histogram. By how much, the taught image tells beside the present one. That may show another place, or the
same from another side, so that what is estimated is only likely: views in that light are added to the taught
ones, and replace none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.taught.taught_view import TaughtView

CELLS = (32, 24)
"""Cells of an image, across and down."""

MIN_CHANGE = 0.18
"""Least change of the light that matters, as a natural logarithm: by more than a step of the histograms."""

MAX_CHANGE = 1.1
"""Greatest change that is one of light, to a third or threefold; a video that fades in begins in the dark."""


def relit_views(
    views: Sequence[TaughtView], video_image: NDArray[np.uint8]
) -> Iterator[tuple[int, TaughtView]]:
    """The taught views in the light of an image, as far as that differs from the light of theirs.

    Args:
        views: The taught views.
        video_image: (H, W), (H, W, 1) or (H, W, 3) uint8, BGR, of any size.

    Yields:
        The number of a view, and that view in the light of the image.
    """
    if video_image.ndim == 2 or video_image.shape[2] == 1:
        video_image = np.asarray(cv2.cvtColor(video_image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    for number, view in enumerate(views):
        gain = light_change(view.scene, video_image)
        if MIN_CHANGE <= np.abs(np.log(gain)).max() <= MAX_CHANGE:
            image, scene = (_in_light(part, gain) for part in (view.image, view.scene))
            yield number, replace(view, image=image, scene=scene)


def light_change(then: NDArray[np.uint8], now: NDArray[np.uint8]) -> NDArray[np.float64]:
    """The change of light from one image to another.

    Args:
        then: (H, W, 3) uint8, BGR.
        now: The same, of any size.

    Returns:
        (3,) factors of blue, green and red: medians over the cells of the image.
    """
    change = (_cells(now) - _cells(then)).reshape(-1, 3)
    return np.asarray(np.exp(np.median(change, axis=0)))


def _in_light(image: NDArray[np.uint8], gain: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.clip(np.rint(image * gain), 0, 255).astype(np.uint8)


def _cells(image: NDArray[np.uint8]) -> NDArray[np.float64]:
    """(24, 32, 3) logarithms of the mean colours of the cells of an image."""
    small = cv2.resize(image, CELLS, interpolation=cv2.INTER_AREA)
    logarithms: NDArray[np.float64] = np.log(np.asarray(small, dtype=np.float64) + 1.0)
    return logarithms
