"""Appearance: likelihood of tones under each label, from smoothed histograms."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from visup.percepts.motion.features._products_jit import smoothed_and_turned
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats

BINS = 16
SMOOTHING = gaussian_filter1d(np.eye(BINS), 0.8, axis=0, mode="nearest")


def tone_likelihood(cells: Superpixels, prior: Floats, least: float = 12.0) -> Floats:
    """Likelihood of each superpixel's tone under each label.

    Args:
        cells: The superpixels.
        prior: (count, K) float32 label shares; label 0 is the background, the last is unknown.
        least: Fewest cells for a label's histogram to be trusted.

    Returns:
        (count, K) float32, normalised over labels; uniform where a label is too small.
    """
    bins = np.minimum((cells.tone / (256 / BINS)).astype(np.int64), BINS - 1)
    code = (bins[:, 0] * BINS + bins[:, 1]) * BINS + bins[:, 2]
    out = np.zeros_like(prior)
    even = np.full(cells.count, 1.0 / BINS, dtype=np.float32)
    for k in range(prior.shape[1]):
        size = float(prior[:, k].sum())
        if size < least:
            out[:, k] = even
            continue
        histogram = np.bincount(code, weights=prior[:, k], minlength=BINS**3)
        out[:, k] = smoothed_histogram(histogram)[code] / size + 0.002
    return np.asarray(out / out.sum(axis=1, keepdims=True), dtype=np.float32)


def smoothed_histogram(histogram: NDArray[Any]) -> NDArray[Any]:
    """A flat histogram after a Gaussian along each of its three axes."""
    out = np.asarray(histogram, dtype=np.float64)
    for _ in range(3):
        # Each product smooths the first axis and moves it last.
        out = smoothed_and_turned(SMOOTHING, out.reshape(BINS, -1))
    return out.ravel()
