"""The region connection calculi RCC-8, 5, 4, 3 and 2 of boxes (Randell, Cui and Cohn 1992)."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

Box = tuple[float, float, float, float]
"""Least x, least y, greatest x, greatest y; any unit."""

RCC8 = ("dc", "ec", "po", "eq", "tpp", "ntpp", "tppi", "ntppi")
_SAME = {name: name for name in RCC8}
COARSER: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "RCC8": _SAME,
        "RCC5": {**_SAME, "dc": "dr", "ec": "dr", "tpp": "pp", "ntpp": "pp", "tppi": "ppi",
                 "ntppi": "ppi"},
        "RCC4": {**_SAME, "ec": "po", "eq": "pp", "tpp": "pp", "ntpp": "pp", "tppi": "ppi",
                 "ntppi": "ppi"},
        "RCC3": {**dict.fromkeys(RCC8, "o"), "dc": "dc", "ec": "po", "po": "po"},
        "RCC2": {**dict.fromkeys(RCC8, "c"), "dc": "dc"},
    }
)  # fmt: skip
"""Calculus -> relation of RCC-8 -> its relation. RCC-4 and RCC-3 as in QSRlib: contact is overlap."""


def rcc(a: Box, b: Box, calculus: str = "RCC8", grown: float = 0.0) -> str:
    """The relation of box a to box b.

    Args:
        a: A closed box.
        b: Another closed box.
        calculus: One of `COARSER`.
        grown: How far each box is grown for the test of disconnection; boxes that only then meet overlap
            partially.

    Returns:
        The relation.
    """
    return COARSER[calculus][_rcc8(a, b, grown)]


def _rcc8(a: Box, b: Box, grown: float) -> str:
    gap = max(b[0] - a[2], a[0] - b[2], b[1] - a[3], a[1] - b[3])
    if gap > 2 * grown:
        return "dc"
    if gap >= 0.0:
        return "ec" if gap == 2 * grown else "po"
    inside = (a[0] - b[0], a[1] - b[1], b[2] - a[2], b[3] - a[3])
    least, most = min(inside), max(inside)
    if least == most == 0.0:
        return "eq"
    if least >= 0.0:
        return "ntpp" if least > 0.0 else "tpp"
    if most <= 0.0:
        return "ntppi" if most < 0.0 else "tppi"
    return "po"
