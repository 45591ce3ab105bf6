"""Area overlap of two silhouettes at their best rotation.

A silhouette is sampled in rings about its centroid, holes and islands included, slightly blurred. A rotation
shifts each ring, so that the overlap at all rotations, mirrored or not, is one correlation by Fourier
transform. It costs microseconds per view and tolerates rough outlines, which makes it the first filter of a
database; thin limbs weigh little in it, which is why outlines and shock graphs count too.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

RINGS = 14
ANGLES = 48
"""Samples of a map: rings, innermost first, times angles from x towards y."""

_FREQUENCIES = 17
_EDGES = np.concatenate([np.linspace(0.0, 1.2, 10), np.linspace(1.56, 3.0, 5)])
_RADII = 0.5 * (_EDGES[1:] + _EDGES[:-1])
_WEIGHTS = np.sqrt(np.diff(_EDGES) * _RADII).astype(np.float32)
_BLUR = 0.06
_PIXELS = 32


@dataclass(frozen=True, slots=True, eq=False)
class AreaOverlaps:
    """Overlaps of one map with others, as they are and mirrored.

    Attributes:
        similarity: (V, 2) float64, 0 to 1: the Dice coefficient.
        rotation: (V, 2) float64, radians from x towards y that take the other (first mirrored left to right
            in the second column) onto the one, in (-pi, pi].
    """

    similarity: NDArray[np.float64]
    rotation: NDArray[np.float64]


def area_map(mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """A silhouette's area by ring and angle about its centroid, in units of its area's square root.

    Args:
        mask: (H, W) bool, not empty; y down.

    Returns:
        (RINGS, ANGLES) uint8, 255 where fully covered. Area beyond 3 units is ignored.
    """
    scale = _PIXELS / float(np.count_nonzero(mask)) ** 0.5
    tone = _blurred_tone(mask, scale)
    total = float(tone.sum())
    if total <= 0:
        return np.zeros((RINGS, ANGLES), dtype=np.uint8)
    x = float(tone.sum(axis=0) @ np.arange(tone.shape[1])) / total
    y = float(tone.sum(axis=1) @ np.arange(tone.shape[0])) / total
    around = np.arange(ANGLES) * (2 * np.pi / ANGLES)
    reach = _RADII[:, None] * total**0.5
    at_x, at_y = x + reach * np.cos(around), y + reach * np.sin(around)
    sampled = cv2.remap(tone, at_x.astype(np.float32), at_y.astype(np.float32), cv2.INTER_LINEAR)
    return np.asarray(np.rint(255 * np.clip(sampled, 0.0, 1.0)), dtype=np.uint8)


def _blurred_tone(mask: NDArray[np.bool_], scale: float) -> NDArray[np.float32]:
    """The mask at working resolution with a margin, blurred; float32."""
    margin = int(np.ceil(4 * _BLUR * _PIXELS))
    size = tuple(max(1, round(n * scale)) for n in mask.shape[::-1])
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    small = cv2.resize(mask.astype(np.float32), size, interpolation=method)
    tone = cv2.GaussianBlur(np.pad(small, margin), (0, 0), _BLUR * _PIXELS)
    return np.asarray(tone, dtype=np.float32)


def paint_outline(contour: NDArray[np.floating], pixels: int, half: float) -> NDArray[np.float32]:
    """A shape rasterised on a square about its centroid.

    Args:
        contour: (N, 2) outline in normal form.
        pixels: Pixels per unit.
        half: Half the side of the square, units; anything further out is lost.

    Returns:
        (S, S) float32, 0 to 1.
    """
    side = int(2 * half * pixels)
    canvas = np.zeros((side, side), dtype=np.uint8)
    spots = np.round((np.asarray(contour) + half) * pixels * 16 - 8).astype(np.int32)
    cv2.fillPoly(canvas, [spots], 255, shift=4)
    # Pixels along the outline are painted at half intensity, since half of each is inside.
    cv2.polylines(canvas, [spots], True, 128, shift=4)
    return np.asarray(canvas.astype(np.float32) / np.float32(255), dtype=np.float32)


class AreaIndex:
    """Area maps of many views, prepared for comparison with one.

    Args:
        maps: (V, RINGS, ANGLES) uint8.
    """

    def __init__(self, maps: NDArray[np.uint8]) -> None:
        spectra, self._powers = _spectra(maps)
        # One matrix per frequency, so that a query is compared with all views in one product.
        self._spectra = np.ascontiguousarray(np.moveaxis(spectra.conj(), 2, 0))

    def __len__(self) -> int:
        return len(self._powers)

    def overlaps(
        self, query: NDArray[np.uint8], among: NDArray[np.intp] | None = None
    ) -> AreaOverlaps:
        """Overlap one map with many.

        Args:
            query: (RINGS, ANGLES) uint8.
            among: Numbers of the views to compare; all when None.
        """
        return _best_rotations(*self._correlations(query, among))

    def similarities(
        self, query: NDArray[np.uint8], among: NDArray[np.intp] | None = None
    ) -> NDArray[np.float64]:
        """The similarities of `overlaps` alone, (V, 2), in less time."""
        correlations, powers = self._correlations(query, among)
        return _dice_coefficients(correlations.max(axis=0), powers)

    def _correlations(
        self, query: NDArray[np.uint8], among: NDArray[np.intp] | None
    ) -> tuple[NDArray[np.floating], NDArray[np.float64]]:
        """Common area at all rotations, (ANGLES, V, 2), and the sums of both areas."""
        known, powers = self._spectra, self._powers
        if among is not None:
            known, powers = known[:, among], powers[among]
        spectrum, power = _spectra(query[None])
        own = spectrum[0].T[..., None]
        products = known @ np.concatenate([own, own.conj()], axis=2)
        return np.fft.irfft(products, ANGLES, axis=0), powers + power[0]


def area_overlaps(query: NDArray[np.uint8], others: NDArray[np.uint8]) -> AreaOverlaps:
    """Overlap one map (RINGS, ANGLES) with others (V, RINGS, ANGLES), both uint8."""
    return AreaIndex(others).overlaps(query)


def _spectra(maps: NDArray[np.uint8]) -> tuple[NDArray[np.complex64], NDArray[np.float64]]:
    """Fourier transforms along the angle (V, RINGS, F), weighted by area, and their powers (V,)."""
    weighted = maps.astype(np.float32) * (_WEIGHTS[:, None] / 255)
    spectra = np.fft.rfft(weighted, axis=2)[..., :_FREQUENCIES].astype(np.complex64)
    counts = np.where(np.arange(_FREQUENCIES) > 0, 2.0, 1.0) / ANGLES
    powers = ((spectra.real**2 + spectra.imag**2).sum(axis=1) * counts).sum(axis=1)
    return spectra, powers.astype(np.float64)


def _best_rotations(
    correlations: NDArray[np.floating], powers: NDArray[np.float64]
) -> AreaOverlaps:
    """The best rotation of each view, from overlaps (ANGLES, V, 2): as it is, and mirrored."""
    best = correlations.argmax(axis=0)
    chosen = np.take_along_axis(correlations, best[None], axis=0)[0].astype(np.float64)
    before, after = (
        np.take_along_axis(correlations, (best[None] + step) % ANGLES, axis=0)[0]
        for step in (-1, 1)
    )
    # The vertex of the parabola through the best step and its neighbours.
    bend = np.maximum(2 * chosen - before - after, 1e-9)
    angle = (best + 0.5 * (after - before) / bend) * (2 * np.pi / ANGLES)
    # Mirroring left to right is mirroring top to bottom and a half turn.
    angle[:, 1] = np.pi - angle[:, 1]
    return AreaOverlaps(_dice_coefficients(chosen, powers), np.angle(np.exp(1j * angle)))


def _dice_coefficients(
    common: NDArray[np.floating], powers: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Dice coefficients, (V, 2)."""
    return np.clip(2.0 * common.astype(np.float64) / np.maximum(powers, 1e-12)[:, None], 0.0, 1.0)
