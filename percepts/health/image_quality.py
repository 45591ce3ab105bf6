"""Quality of a single image: its tones, noise, and straight steps as in broken blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Grey = NDArray[np.uint8]
Floats = NDArray[np.float32]

SMALL = 160  # most pixels along the longer side of the small image
STRIP, EVERY = 8, 32  # noise is measured on strips of 8 in every 32 lines
IMPULSE = 60  # grey levels by which a pixel must differ from the median around it
STEP = 10  # grey levels of a step
RUN = 8  # least length of a straight step, pixels
DOWN = np.ones((RUN, 1), dtype=np.uint8)
LAPLACE = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class ImageQuality:
    """An image and its measurements.

    Attributes:
        grey: (H, W) uint8.
        small: (h, w) float32, means of `factor` x `factor` pixels of `grey`.
        factor: Side of a pixel of the small image, pixels of `grey`.
        low: Grey level that 3 % of the small image do not exceed.
        high: Grey level that 0.1 % of the small image exceed.
        spread: Grey levels between the darkest and the brightest half percent.
        noise: Standard deviation of pixel noise, grey levels.
        impulses: Share of pixels that stick out from their neighbours.
        steps: Share of pixels on straight steps one pixel wide, along rows or columns.
        edges: Share of pixels that differ from a neighbour by a step at all.
    """

    grey: Grey
    small: Floats
    factor: int
    low: float
    high: float
    spread: float
    noise: float
    impulses: float
    steps: float
    edges: float


def measure_quality(image: NDArray[np.uint8]) -> ImageQuality:
    """Measure an image.

    Args:
        image: (H, W), (H, W, 1) or (H, W, 3) uint8, BGR.

    Returns:
        Its measurements.
    """
    colour = image.ndim == 3 and image.shape[2] == 3
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)) if colour else image
    grey = grey.reshape(image.shape[:2]).astype(np.uint8, copy=False)
    factor = max(1, -(-max(grey.shape) // SMALL))
    small = box_average(grey, factor)
    low, high, darkest, brightest = _levels(small, (0.03, 0.999, 0.005, 0.995))
    # Grey averages the noise of three channels; a single channel shows it in full.
    strips = _strips(image[..., 1] if colour else grey)
    steps, edges = _steps(grey)
    return ImageQuality(
        grey=grey,
        small=small,
        factor=factor,
        low=low,
        high=high,
        spread=brightest - darkest,
        noise=_noise(strips),
        impulses=_impulses(strips),
        steps=steps,
        edges=edges,
    )


def _levels(small: Floats, shares: Sequence[float]) -> list[float]:
    """Grey levels that shares of the small image do not exceed."""
    at = [min(small.size - 1, int(share * small.size)) for share in shares]
    levels = np.partition(small, sorted(set(at)), axis=None)
    return [float(levels[index]) for index in at]


def box_average(grey: Grey, factor: int) -> Floats:
    """Means of squares of pixels; incomplete squares at the border are dropped."""
    rows, columns = (max(1, n // factor) for n in grey.shape)
    # Means are not rounded: slow change is less than a grey level.
    part = grey[: rows * factor, : columns * factor].astype(np.float32)
    if factor == 1:
        return part
    small = cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float32)


def _strips(channel: Grey) -> Grey:
    """Some lines of an image, in strips: a quarter of it is enough to measure noise."""
    height, width = channel.shape
    count = height // EVERY
    if count == 0:
        return np.ascontiguousarray(channel)
    part = channel[: count * EVERY].reshape(count, EVERY, width)[:, :STRIP]
    return np.ascontiguousarray(part.reshape(count * STRIP, width))


def _noise(strips: Grey) -> float:
    """Noise by Immerkaer's kernel, which is blind to slopes; the low quartile avoids texture."""
    response = cv2.convertScaleAbs(cv2.filter2D(strips, cv2.CV_16S, LAPLACE))
    counts = np.cumsum(cv2.calcHist([response], [0], None, [256], [0, 256]).ravel())
    at = int(np.searchsorted(counts, 0.25 * counts[-1]))
    return at / (0.319 * 6.0)


def _impulses(strips: Grey) -> float:
    difference = cv2.absdiff(strips, cv2.medianBlur(strips, 3))
    return float(np.count_nonzero(difference > IMPULSE)) / max(1, strips.size)


def _steps(grey: Grey) -> tuple[float, float]:
    """Shares of pixels on straight steps, and on steps of any kind."""
    straight = edges = 0
    for image in (grey, cv2.transpose(grey)):
        if image.shape[1] < 4 or image.shape[0] < RUN:
            continue
        step = cv2.absdiff(image[:, 1:], image[:, :-1])
        edges += cv2.countNonZero(cv2.threshold(step, STEP - 1, 1, cv2.THRESH_BINARY)[1])
        neighbours = cv2.max(step[:, 2:], step[:, :-2])
        # Optical edges rise over several pixels; edges between blocks do not.
        isolated = cv2.subtract(step[:, 1:-1], cv2.add(neighbours, neighbours))
        mask = cv2.threshold(isolated, STEP - 1, 1, cv2.THRESH_BINARY)[1]
        lines = cv2.reduce(cv2.erode(mask, DOWN), 0, cv2.REDUCE_SUM, dtype=cv2.CV_32S)
        # A single line is the edge of a straight object; broken blocks have many.
        straight += int(lines.sum()) - int(lines.max())
    return straight / grey.size, edges / grey.size
