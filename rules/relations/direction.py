"""Cardinal direction in the image, by cones (Frank 1996), with hysteresis.

North is the top of the image. `north_of(a, b)` means that a is north of b: the direction from b's centre to
a's is in a cone of 45 degrees about north. Centres close to each other have no direction: they are at the
same place.

"""

from __future__ import annotations

import numpy as np

from visup.rules.smoothing.hysteresis import UNKNOWN, Codes

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
"""Code of (a, b) -> code of (b, a); the last one is for `UNKNOWN` = -1."""
