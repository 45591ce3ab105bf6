"""Cardinal direction in the image, by cones (Frank 1996), with hysteresis.

North is the top of the image. `north_of(a, b)` says that a is north of b: the direction from b's
centre to a's lies in a cone of 45 degrees about north. Centres close to each other have no
direction: one is at the place of the other.
"""

from __future__ import annotations

import numpy as np

from visup.rules.latch import UNKNOWN, Codes, Floats
from visup.rules.pairs import pairs

DIRECTION_NAMES = (
    "east_of",
    "south_east_of",
    "south_of",
    "south_west_of",
    "west_of",
    "north_west_of",
    "north_of",
    "north_east_of",
    "at_place_of",
)
"""By code, clockwise as seen in the image."""
AT_PLACE = 8
CONVERSE: Codes = np.array([4, 5, 6, 7, 0, 1, 2, 3, AT_PLACE, UNKNOWN], dtype=np.int8)
"""Code of (a, b) -> code of (b, a); the last one stands for `UNKNOWN` = -1."""


def directions(
    places: Floats, before: Codes, place: tuple[float, float], slack: float, noise: float
) -> Codes:
    """Direction of the first of each pair as seen from the second.

    Args:
        places: (M, 2) centres, pixels, y down; NaN unknown.
        before: (P,) codes so far.
        place: Distances within which two come to one place, and beyond which they leave it, pixels.
        slack: How far beyond the edge of its cone a direction is kept, radians.
        noise: Standard deviation of a coordinate, pixels; four of them are allowed, too.

    Returns:
        (P,) codes into `DIRECTION_NAMES`.
    """
    i, j = pairs(len(places))
    dx, dy = (places[i] - places[j]).T
    length = np.sqrt(dx * dx + dy * dy)
    angle = np.arctan2(dy, dx)
    cone = np.pi / 4.0
    code = np.rint(angle / cone) % 8.0
    off = np.abs((angle - before * cone + np.pi) % (2.0 * np.pi) - np.pi)
    directed = (before >= 0) & (before < AT_PLACE)
    slack_now = np.maximum(slack, 4.0 * np.sqrt(2.0) * noise / np.maximum(length, 1e-9))
    code = np.where(directed & (off <= 0.5 * cone + slack_now), before, code)
    near, far = place
    limit = np.where(before == AT_PLACE, far, np.where(directed, near, 0.5 * (near + far)))
    code[length <= limit] = AT_PLACE
    code[length != length] = UNKNOWN  # NaN is not equal to itself
    return code.astype(np.int8)
