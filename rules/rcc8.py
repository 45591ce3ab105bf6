"""RCC-8, the region connection calculus (Randell, Cui and Cohn 1992), on boxes and on outlines.

Two boxes relate along each axis by the order of their edges (Allen 1983); RCC-8 follows from the
signs of four differences on each axis. These signs are what carries noise thresholds, so that the
relation of boxes whose edges are level in truth does not flicker.

Two outlines relate by how far the points of each lie outside the other (negative: within it):
nearest point and farthest point. Where boxes are apart by more than the threshold, or the gap of
the outlines is, no such distance is looked up: the two are disconnected. Else it costs a nearest
neighbour search of at most 200 points of each outline among the other's, about 15 us for a pair.
Holes within an outline count as outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.rules.geometry import RCC8, Floats
from visup.rules.latch import ABOVE, BELOW, UNKNOWN, WITHIN, Codes
from visup.rules.outlines import signed_distances
from visup.rules.pairs import Indices, pairs

DC, EC, PO, EQ, TPP, NTPP, TPPI, NTPPI = range(8)
CONVERSE: Codes = np.array(
    [RCC8.index(n) for n in RCC8[:4]] + [TPPI, NTPPI, TPP, NTPP, UNKNOWN], dtype=np.int8
)
"""Code of (a, b) -> code of (b, a); the last one stands for `UNKNOWN` = -1."""


def edge_differences(boxes: Floats) -> Floats:
    """How the edges of all pairs of boxes stand to each other.

    Args:
        boxes: (M, 4) float: x, y, width, height, pixels.

    Returns:
        (8, P) pixels, for each pair (a, b) and each axis x, y: start of a after that of b; end of b
        after that of a; end of b after the start of a; end of a after the start of b.
    """
    edges = np.array(boxes)
    edges[:, 2:] += edges[:, :2]
    plus, minus = _edges_of(len(boxes))
    return edges.take(plus) - edges.take(minus)


@lru_cache(maxsize=64)
def _edges_of(m: int) -> tuple[Indices, Indices]:
    """Places (8, P) of what is subtracted from what, among (M, 4) edges: left, top, right, bottom."""
    low = np.array([[0], [1]])
    a, b = (4 * k + low for k in pairs(m))
    plus, minus = [a, b + 2, b + 2, a + 2], [b, a + 2, a, b]
    return np.concatenate(plus), np.concatenate(minus)


def from_signs(signs: Codes) -> Codes:
    """RCC-8 from the signs of `edge_differences`.

    Args:
        signs: (8, P) codes `BELOW`, `WITHIN` (edges level), `ABOVE`, `UNKNOWN`.

    Returns:
        (P,) codes into `RCC8`: what a is to b.
    """
    nested, overlap = signs[:4], signs[4:].min(axis=0)
    codes: Codes = _RELATIONS[overlap, nested.min(axis=0), nested.max(axis=0)]
    return codes


def _relations() -> Codes:
    """Relation by the codes of the least overlap and of the least and most nested order; -1 is last."""
    codes = np.array([BELOW, WITHIN, ABOVE, UNKNOWN])
    overlap, least, most = np.meshgrid(codes, codes, codes, indexing="ij")
    code = np.full(overlap.shape, PO, dtype=np.int8)
    code[least >= WITHIN] = TPP
    code[least == ABOVE] = NTPP
    code[most <= WITHIN] = TPPI
    code[most == BELOW] = NTPPI
    code[(least == WITHIN) & (most == WITHIN)] = EQ
    code[(overlap == WITHIN) & (code != EQ)] = EC
    code[overlap == BELOW] = DC
    code[np.minimum(overlap, least) == UNKNOWN] = UNKNOWN
    return code


_RELATIONS = _relations()


def rcc8(boxes: Floats, tolerance: float = 0.0) -> NDArray[np.int8]:
    """RCC-8 relation of all pairs of boxes, without memory.

    Args:
        boxes: (M, 4) float, x, y, width, height, pixels; boxes are closed regions of the plane.
        tolerance: Edges closer than this count as level, pixels.

    Returns:
        (M, M) int8 codes into `RCC8`; [a, b] says what a is to b.
    """
    apart = edge_differences(boxes)
    signs = (np.sign(apart) * (np.abs(apart) > tolerance)).astype(np.int8) + np.int8(WITHIN)
    code = from_signs(signs)
    table = np.full((len(boxes), len(boxes)), EQ, dtype=np.int8)
    i, j = pairs(len(boxes))
    table[i, j], table[j, i] = code, CONVERSE[code]
    return table


def outline_differences(
    regions: Sequence[Region], near: NDArray[np.bool_], known: NDArray[np.bool_], far: float
) -> Floats:
    """How the outlines of all pairs of regions stand to each other.

    Args:
        regions: (M) regions.
        near: (P,) bool: pairs that may meet; the others are taken to be apart.
        known: (P,) bool: pairs of which both are seen.
        far: Distance that stands for pairs that are apart, pixels.

    Returns:
        (3, P) pixels: nearest point of either outside the other; farthest point of a outside b;
        farthest of b outside a. Negative is within; NaN where not known.
    """
    found = np.full((3, len(near)), far)
    found[:, ~known] = np.nan
    i, j = pairs(len(regions))
    for k in np.flatnonzero(near & known):
        a, b = regions[i[k]], regions[j[k]]
        least_a, most_a = signed_distances(a, b)
        least_b, most_b = signed_distances(b, a)
        # Outlines run through the centres of pixels: neighbours meet, though they are 1 px apart.
        found[:, k] = min(least_a, least_b) - 1.0, most_a, most_b
    return found


def from_outline_signs(signs: Codes) -> Codes:
    """RCC-8 from the signs of `outline_differences`.

    Args:
        signs: (3, P) codes.

    Returns:
        (P,) codes into `RCC8`: what a is to b.
    """
    apart, a_out, b_out = signs
    code = np.full(len(apart), PO, dtype=np.int8)
    code[apart == WITHIN] = EC
    code[b_out == WITHIN] = TPPI
    code[a_out == WITHIN] = TPP
    code[b_out == BELOW] = NTPPI
    code[a_out == BELOW] = NTPP
    code[(a_out <= WITHIN) & (b_out <= WITHIN)] = EQ
    code[apart == ABOVE] = DC
    code[signs.min(axis=0) == UNKNOWN] = UNKNOWN
    return code
