"""A discriminative correlation filter that localises an object in a patch.

With spatial reliability (Lukezic et al., CSR-DCF, 2017): one filter per feature channel, restricted to cells
that show the object, found by alternating (ADMM) between the frequency domain, where the filter is fitted,
and space, where it is masked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Spectrum = NDArray[np.complex64]

_ROUNDS = 4  # iterations of ADMM
_PENALTY, _GROWTH = np.float32(5.0), np.float32(3.0)  # of ADMM; its factor per iteration
_RIDGE = np.float32(0.01)  # regularisation of the filter
_SHARP = 0.06  # width of the target peak, as a share of the object's size in cells


@dataclass(frozen=True, slots=True, eq=False)
class CorrelationFilter:
    """A learned filter.

    Attributes:
        spectrum: (channels, h, w // 2 + 1) complex64.
        weights: (channels,) float32, reliability of each channel; they sum to 1.
        peak: Height of the response on the training patch.
    """

    spectrum: Spectrum
    weights: Floats
    peak: float

    def blended(self, other: CorrelationFilter, share: float) -> CorrelationFilter:
        """This filter blended with a share of another."""
        keep, new = np.float32(1 - share), np.float32(share)
        return CorrelationFilter(
            self.spectrum * keep + other.spectrum * new,
            self.weights * keep + other.weights * new,
            self.peak * (1 - share) + other.peak * share,
        )

    def response(self, features: Floats) -> Floats:
        """The filter's response at each shift of a patch.

        Args:
            features: (channels, h, w) float32.

        Returns:
            (h, w) float32, shift 0 in the middle; about 1 where the object is as learned.
        """
        spectrum = _forward(windowed(features)) * np.conj(self.spectrum)
        summed = np.asarray(np.tensordot(self.weights, spectrum, 1), dtype=np.complex64)
        raw = _backward(summed, features.shape[1:])
        return np.asarray(np.fft.fftshift(raw) / np.float32(self.peak), dtype=np.float32)


def windowed(features: Floats) -> Floats:
    """Features faded out towards the border, since the transform wraps around."""
    rows, cols = features.shape[1:]
    fade = np.outer(np.hanning(rows + 2)[1:-1], np.hanning(cols + 2)[1:-1])
    return features * fade.astype(np.float32)


def learn_filter(features: Floats, mask: Floats, size: float) -> CorrelationFilter:
    """Learn a filter that responds at the object and nowhere else in a patch.

    Args:
        features: (channels, h, w) float32, the object in the middle.
        mask: (h, w) float32, 0 to 1, the cells that show the object.
        size: Size of the object, cells; gives the width of the peak.

    Returns:
        The filter.
    """
    shape = features.shape[1:]
    f = _forward(windowed(features))
    wanted = _forward(_label(shape, max(_SHARP * size, 0.7)))
    cross, power = f * np.conj(wanted), (f * np.conj(f)).real
    spectrum = cross / (power + _RIDGE)
    cut = _forward(mask * _backward(spectrum, shape))
    multiplier = np.zeros_like(cut)
    penalty = _PENALTY
    ridge = _RIDGE / np.float32(2 * shape[0] * shape[1])
    for _ in range(_ROUNDS):
        spectrum = (cross + penalty * cut - multiplier) / (power + penalty)
        masked = _backward(multiplier + penalty * spectrum, shape) / (ridge + penalty)
        cut = _forward(mask * masked)
        multiplier = multiplier + penalty * (spectrum - cut)
        penalty = penalty * _GROWTH
    answers = _backward(f * np.conj(cut), shape)
    weights = np.maximum(answers[:, 0, 0], np.float32(1e-4))
    weights = weights / weights.sum()
    peak = float(weights @ answers[:, 0, 0])
    return CorrelationFilter(cut, weights.astype(np.float32), max(peak, 1e-4))


def peak_of(response: Floats) -> tuple[float, float, float]:
    """The sub-cell maximum of a response.

    Args:
        response: (h, w) float32, shift 0 in the middle.

    Returns:
        (dx, dy, height): the shift in cells, and the response at its maximum.
    """
    rows, cols = response.shape
    r, c = divmod(int(response.argmax()), cols)
    dx = _between(response[r, (c - 1) % cols], response[r, c], response[r, (c + 1) % cols])
    dy = _between(response[(r - 1) % rows, c], response[r, c], response[(r + 1) % rows, c])
    return c + dx - cols // 2, r + dy - rows // 2, float(response[r, c])


def _between(before: np.float32, at: np.float32, after: np.float32) -> float:
    bend = float(before) - 2 * float(at) + float(after)
    return (
        0.0 if bend >= -1e-9 else float(np.clip((float(before) - float(after)) / 2 / bend, -1, 1))
    )


def _label(shape: tuple[int, ...], sigma: float) -> Floats:
    rows, cols = (np.fft.fftfreq(n) * n for n in shape)
    square = rows[:, None] ** 2 + cols[None] ** 2
    return np.exp(-square / (2 * sigma**2)).astype(np.float32)


def _forward(values: Floats) -> Spectrum:
    return np.asarray(scipy.fft.rfft2(values), dtype=np.complex64)


def _backward(values: Spectrum, shape: tuple[int, ...]) -> Floats:
    return np.asarray(scipy.fft.irfft2(values, s=shape), dtype=np.float32)
