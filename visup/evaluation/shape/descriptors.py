"""Other shape descriptors as baselines for the recognition of views.

Zernike moments (mahotas) and elliptic Fourier descriptors (pyefd), both made invariant to rotation and
scale, with the nearest neighbour by city-block distance. Needs the extra ``visup[eval]``.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import ExtraMissingError

ZERNIKE_DEGREE = 12
FOURIER_ORDER = 16

_AREA_SIDE = 60.0

Descriptor = Callable[[NDArray[np.bool_]], NDArray[np.float64]]
"""Mask (H, W) bool -> vector."""


def descriptors() -> dict[str, Descriptor]:
    """The baselines by name.

    Raises:
        ExtraMissingError: Their libraries are not installed.
    """
    try:
        import mahotas.features
        import pyefd
    except ImportError as error:
        raise ExtraMissingError("Comparing with Zernike and Fourier descriptors", "eval") from error

    def zernike(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
        solid = _scaled_to_area(mask)
        rows, columns = np.nonzero(solid)
        middle = (float(rows.mean()), float(columns.mean()))
        radius = float(np.hypot(rows - middle[0], columns - middle[1]).max()) + 1.0
        moments = mahotas.features.zernike_moments(solid, radius, degree=ZERNIKE_DEGREE, cm=middle)
        return np.asarray(moments, dtype=np.float64)

    def fourier(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
        coefficients = pyefd.elliptic_fourier_descriptors(_outline(mask), order=FOURIER_ORDER)
        a, b, c, d = np.asarray(coefficients, dtype=np.float64).T
        # Size and area of each harmonic's ellipse are invariant to rotation and starting point.
        sizes = np.sqrt(a**2 + b**2 + c**2 + d**2)
        areas = np.sqrt(np.abs(a * d - b * c))
        return np.concatenate([sizes, areas]) / max(float(sizes[0]), 1e-9)

    return {"zernike": zernike, "fourier": fourier}


def nearest(vectors: NDArray[np.float64], query: NDArray[np.float64]) -> NDArray[np.intp]:
    """Indices of all vectors (N, D) by increasing distance from a query (D,)."""
    return np.argsort(np.abs(vectors - query).sum(axis=1), kind="stable")


def _scaled_to_area(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    scale = _AREA_SIDE / max(1.0, float(np.count_nonzero(mask)) ** 0.5)
    size = tuple(max(1, round(n * scale)) for n in mask.shape[::-1])
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    resized = cv2.resize(mask.astype(np.float32), size, interpolation=method)
    solid = np.asarray(resized > 0.5)
    return solid if solid.any() else np.ones((1, 1), dtype=bool)


def _outline(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    outlines, _ = cv2.findContours(
        np.pad(mask, 1).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    longest = max(outlines, key=len)
    return np.asarray(longest[:, 0], dtype=np.float64)
