"""QTC, the qualitative trajectory calculus: how two moving points move to each other.

Van de Weghe, *Representing and reasoning about moving objects: a qualitative approach* (PhD,
Ghent 2004); Van de Weghe, Cohn, De Tre, De Maeyer, *A qualitative trajectory calculus as a basis
for representing moving objects in geographical information systems*, Control and Cybernetics 35
(2006). QTC-B tells for each of the two whether it moves towards the other's place (-), away from
it (+) or neither (0). QTC-C (double cross) adds on which side of the line from itself to the other
it moves: to the left (-), to the right (+), or neither (0).

Signs are judged of velocities (the definition's limit for short times) along and across the line
between the places. Left and right are as one sees them in the image.
"""

from __future__ import annotations

import numpy as np

from visup.rules.latch import Floats
from visup.rules.pairs import pairs

SIGNS = ("-", "0", "+")
"""What a code stands for: `BELOW`, `WITHIN`, `ABOVE`."""


def components(places: Floats, velocities: Floats) -> tuple[Floats, Floats]:
    """How fast each of a pair moves away from the other's place, and across to its right.

    Args:
        places: (M, 2) points, pixels, y down.
        velocities: (M, 2) pixels per second.

    Returns:
        (4, P) pixels per second: of the first and of the second of each pair away from the other
        (negative: towards it), then of the first and of the second to the right of the line from
        itself to the other (negative: to the left); 0 where two points coincide, NaN where unknown.
        And the (P,) lengths of these lines, pixels.
    """
    i, j = pairs(len(places))
    x, y = (places[j] - places[i]).T
    length = np.sqrt(x * x + y * y)
    scale = 1.0 / np.maximum(length, 1e-12)
    x, y = x * scale, y * scale
    ux, uy = velocities[i].T
    vx, vy = velocities[j].T
    # With y down, a positive cross product turns to the right; seen from the second, the line
    # runs the other way.
    speeds = np.array((-(ux * x + uy * y), vx * x + vy * y, x * uy - y * ux, y * vx - x * vy))
    return speeds, length


def text(*codes: int) -> str | None:
    """Codes as the calculus writes them, such as '-0+0'; None when one is unknown.

    >>> text(0, 1, 2, 1)
    '-0+0'
    """
    return None if min(codes) < 0 else "".join(SIGNS[c] for c in codes)
