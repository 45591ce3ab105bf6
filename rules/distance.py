"""Distance and its class: how far apart two bodies are, relative to how large they are.

A gap of 40 px is wide for two screws and nothing for two trains. Classes compare the gap with the
size of the two, the geometric mean of the square roots of their boxes' areas (relative distance in
the manner of Clementini, Di Felice and Hernandez 1997).
"""

from __future__ import annotations

import numpy as np

from visup.rules.latch import UNKNOWN, Codes, Floats
from visup.rules.pairs import pairs

CLASS_NAMES = ("very_close_to", "close_to", "apart_from", "far_from")
LIMITS = (0.25, 1.0, 3.0)
"""Gap over size at which one class ends and the next begins."""
_LIMITS, _NUMBERS = np.array(LIMITS)[:, None], np.arange(len(LIMITS))[:, None]


def signed_gap(differences: Floats) -> Floats:
    """Distance between boxes, negative the depth of their overlap.

    Args:
        differences: (8, P) from `edge_differences`.

    Returns:
        (P,) pixels: between the nearest points where boxes are apart; where they overlap, minus
        how far one must be moved along an axis to part them.
    """
    along = -np.minimum(differences[4:6], differences[6:8])
    dx, dy = np.maximum(along, 0.0)
    most = along.max(axis=0)
    gap: Floats = np.sqrt(dx * dx + dy * dy)
    np.copyto(gap, most, where=most <= 0.0)
    return gap


def sizes(boxes: Floats) -> Floats:
    """(P,) pixels: size of each pair of boxes (M, 4), at least one pixel."""
    root = np.maximum(boxes[:, 2] * boxes[:, 3], 1.0) ** 0.25
    i, j = pairs(len(boxes))
    size: Floats = root[i] * root[j]
    return size


def classes(gap: Floats, size: Floats, before: Codes, slack: float, noise: float) -> Codes:
    """Class of each distance.

    Args:
        gap: (P,) pixels; NaN unknown.
        size: (P,) pixels.
        before: (P,) codes so far.
        slack: How far beyond the end of its class a distance keeps it, share of the limit.
        noise: Standard deviation of an edge, pixels; four are allowed, too.

    Returns:
        (P,) codes into `CLASS_NAMES`.
    """
    limit = _LIMITS * size
    band = np.maximum(slack * limit, 4.0 * noise)
    band *= before != UNKNOWN
    # The band lies towards the other class: what is below is held up to limit + band.
    beyond = gap > limit + np.where(before > _NUMBERS, -band, band)
    code: Codes = beyond.sum(axis=0, dtype=np.int8)
    code[gap != gap] = UNKNOWN  # NaN is not equal to itself
    return code
