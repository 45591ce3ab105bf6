"""Feature channels of a patch for the correlation filter: edges, colours, and colour odds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models._cell_features_jit import (
    BINS,
    COLOURS,
    cell_histograms,
    normalise_edges,
)

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

CELL = 4
"""Side of a cell, pixels of a patch."""

_WEAK = 60.0  # summed edge strength of a cell at the noise level
_CONTRAST = np.float32(1 / 60)  # scale of lightness, so that it weighs as much as edges
_CHROMA = np.float32(1 / 30)


def cell_features(lab: Bytes, odds: Floats) -> Floats:
    """Features of the cells of a patch.

    Args:
        lab: (h, w, 3) uint8, CIE Lab as OpenCV codes it; h and w are multiples of `CELL`.
        odds: (h, w) float32, log odds of each pixel's colour.

    Returns:
        (channels, h / CELL, w / CELL) float32, mean about 0, each channel within about -1 to 1.
    """
    cells = normalise_edges(cell_histograms(lab, odds, CELL), _WEAK)
    middle = cells[BINS]
    cells[BINS] = (middle - middle.mean()) * _CONTRAST
    cells[BINS + 1 : BINS + COLOURS] = (cells[BINS + 1 : BINS + COLOURS] - 128) * _CHROMA
    cells[BINS + COLOURS :] *= np.float32(0.3)
    return cells
