"""RCC-8, the region connection calculus (Randell, Cui and Cohn 1992), on boxes and on outlines.

Two boxes relate along each axis by the order of their edges (Allen 1983); RCC-8 follows from the signs of
four differences on each axis. These signs have the noise thresholds, so that the relation of boxes with truly
level edges does not flicker.
 Two outlines relate by how far the points of each are outside the other (negative: inside it): nearest and
farthest point. Where boxes, or outlines, are apart by more than the threshold, no such distance is computed:
the two are disconnected. Otherwise it costs a nearest-neighbour search of at most 200 points of each outline
among the other's, about 15 us per pair. Holes inside an outline count as outside.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.compiled import compiled
from visup.rules.geometry.outlines import signed_distances
from visup.rules.geometry.pairs import pairs
from visup.rules.geometry.regions import RCC8, Floats
from visup.rules.relations._thresholds_jit import edge_differences
from visup.rules.smoothing.hysteresis import ABOVE, BELOW, UNKNOWN, WITHIN, Codes

DC, EC, PO, EQ, TPP, NTPP, TPPI, NTPPI = range(8)
CONVERSE: Codes = np.array(
    [RCC8.index(n) for n in RCC8[:4]] + [TPPI, NTPPI, TPP, NTPP, UNKNOWN], dtype=np.int8
)
"""Code of (a, b) -> code of (b, a); the last one is for `UNKNOWN` = -1."""


@compiled
def from_signs(signs: Codes) -> Codes:
    """RCC-8 from the signs of `edge_differences`.

    Args:
        signs: (8, P) codes `BELOW`, `WITHIN` (edges level), `ABOVE`, `UNKNOWN`.

    Returns:
        (P,) codes into `RCC8`: relation of a to b.
    """
    codes = np.empty(signs.shape[1], np.int8)
    for k in range(len(codes)):
        overlap, least, most = ABOVE, ABOVE, UNKNOWN
        for row in range(4):
            overlap = min(overlap, signs[4 + row, k])
            least, most = min(least, signs[row, k]), max(most, signs[row, k])
        if min(overlap, least) == UNKNOWN:
            code = UNKNOWN
        elif overlap == BELOW:
            code = DC
        elif least == WITHIN and most == WITHIN:
            code = EQ
        elif overlap == WITHIN:
            code = EC
        elif most <= WITHIN:
            code = NTPPI if most == BELOW else TPPI
        elif least >= WITHIN:
            code = NTPP if least == ABOVE else TPP
        else:
            code = PO
        codes[k] = code
    return codes


def rcc8(boxes: Floats, tolerance: float = 0.0) -> NDArray[np.int8]:
    """RCC-8 relation of all pairs of boxes, without hysteresis.

    Args:
        boxes: (M, 4) float, x, y, width, height, pixels; boxes are closed regions of the plane.
        tolerance: Edges closer than this are level, pixels.

    Returns:
        (M, M) int8 codes into `RCC8`; [a, b] is the relation of a to b.
    """
    apart = edge_differences(boxes)
    signs = (np.sign(apart) * (np.abs(apart) > tolerance)).astype(np.int8) + np.int8(WITHIN)
    code = from_signs(signs)
    table = np.full((len(boxes), len(boxes)), EQ, dtype=np.int8)
    i, j = pairs(len(boxes))
    table[i, j], table[j, i] = code, CONVERSE[code]
    return table


def outline_differences(regions: Sequence[Region], asked: Sequence[int]) -> Floats:
    """Signed distances of the outlines of some pairs of regions.

    Args:
        regions: (M) regions.
        asked: (K) numbers of pairs.

    Returns:
        (3, K) pixels: nearest point of either outside the other; farthest point of a outside b;
        farthest of b outside a. Negative is inside.
    """
    found = np.empty((3, len(asked)))
    i, j = pairs(len(regions))
    for n, k in enumerate(asked):
        a, b = regions[i[k]], regions[j[k]]
        least_a, most_a = signed_distances(a, b)
        least_b, most_b = signed_distances(b, a)
        # Outlines run through pixel centres: adjacent ones meet although they are 1 px apart.
        found[0, n], found[1, n], found[2, n] = min(least_a, least_b) - 1.0, most_a, most_b
    return found


@compiled
def from_outline_signs(signs: Codes) -> Codes:
    """RCC-8 from the signs of `outline_differences`.

    Args:
        signs: (3, P) codes.

    Returns:
        (P,) codes into `RCC8`: relation of a to b.
    """
    codes = np.empty(signs.shape[1], np.int8)
    for k in range(len(codes)):
        apart, a_out, b_out = signs[0, k], signs[1, k], signs[2, k]
        if min(apart, a_out, b_out) == UNKNOWN:
            code = UNKNOWN
        elif apart == ABOVE:
            code = DC
        elif a_out <= WITHIN and b_out <= WITHIN:
            code = EQ
        elif a_out <= WITHIN:
            code = NTPP if a_out == BELOW else TPP
        elif b_out <= WITHIN:
            code = NTPPI if b_out == BELOW else TPPI
        else:
            code = EC if apart == WITHIN else PO
        codes[k] = code
    return codes
