"""Views with their narrow gaps closed, as segmentation closes them.

Between two panels or the rungs of a ladder a few pixels of background are easily assigned to the object. The
silhouette then has other parts and another outline, and no longer matches its view. Therefore a view with
narrow gaps is stored a second time, without them.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

CLOSING_RADIUS = 0.06
"""Radius of the disc that closes gaps, in square roots of the area."""
MIN_GAIN = 0.06
"""A closed silhouette is stored if its area is larger by this share."""


def without_gaps(mask: NDArray[np.bool_]) -> NDArray[np.bool_] | None:
    """A silhouette with its narrow gaps filled.

    Args:
        mask: (H, W) bool.

    Returns:
        (H, W) bool, or None where there is little to fill.

    Example:
        >>> comb = np.zeros((40, 40), bool)
        >>> comb[:, ::3] = comb[:5] = True
        >>> closed = without_gaps(comb)
        >>> closed is not None and bool(closed[20, 10:30].all())
        True
        >>> without_gaps(np.ones((40, 40), bool)) is None
        True
    """
    area = np.count_nonzero(mask)
    radius = round(CLOSING_RADIUS * area**0.5)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    # A border of background, since OpenCV treats pixels beyond the image as neutral.
    padded = np.pad(mask, radius + 1).astype(np.uint8)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, disc)[radius + 1 : -radius - 1]
    filled = np.asarray(closed[:, radius + 1 : -radius - 1], dtype=np.bool_)
    return filled if np.count_nonzero(filled) >= (1 + MIN_GAIN) * area else None
