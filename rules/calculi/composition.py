"""Composition tables: possible relations of a to c, given those of a to b and b to c.

The table of RCC-8 is from Cohn and others (1997); Allen's is derived from all configurations of three
intervals, for which six moments suffice; the rectangle algebra's is Allen's along each axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import product

from visup.rules.calculi.allen import allen
from visup.rules.calculi.rcc import COARSER, RCC8

Table = Mapping[tuple[str, str], frozenset[str]]

_ALL = frozenset(RCC8)
_LETTERS = dict(zip("DEPQTNtn", RCC8, strict=True))
_ROWS = """
D       *       DEPTN   DEPTN   D       DEPTN   DEPTN   D       D
E       DEPtn   DEPTtQ  DEPTN   E       EPTN    PTN     DE      D
P       DEPtn   DEPtn   *       P       PTN     PTN     DEPtn   DEPtn
Q       D       E       P       Q       T       N       t       n
T       D       DE      DEPTN   T       TN      N       DEPTtQ  DEPtn
N       D       D       DEPTN   N       N       N       DEPTN   *
t       DEPtn   EPtn    Ptn     t       PTtQ    PTN     tn      n
n       DEPtn   Ptn     Ptn     n       Ptn     PTNtnQ  n       n
"""
"""Rows: relation of a to b; columns, in the order of `RCC8`: relation of b to c; `*` is any."""


@lru_cache(maxsize=1)
def rcc8_composition() -> Table:
    """(R, S) -> possible relations of a to c, in RCC-8."""
    found: dict[tuple[str, str], frozenset[str]] = {}
    for line in _ROWS.strip().splitlines():
        first, *cells = line.split()
        for second, cell in zip(RCC8, cells, strict=True):
            named = frozenset(_LETTERS[letter] for letter in cell.replace("*", ""))
            found[_LETTERS[first], second] = named or _ALL
    return found


@lru_cache(maxsize=8)
def rcc_composition(calculus: str) -> Table:
    """The table of a coarser calculus, merged from that of RCC-8."""
    names, found = COARSER[calculus], dict[tuple[str, str], frozenset[str]]()
    for (first, second), cell in rcc8_composition().items():
        key = names[first], names[second]
        found[key] = found.get(key, frozenset()) | {names[r] for r in cell}
    return found


@lru_cache(maxsize=1)
def allen_composition() -> Table:
    """(R, S) -> possible relations of interval a to c."""
    intervals = [(p, q) for p, q in product(range(6), repeat=2) if p < q]
    found: dict[tuple[str, str], frozenset[str]] = {}
    for a, b, c in product(intervals, repeat=3):
        key = allen(a, b), allen(b, c)
        found[key] = found.get(key, frozenset()) | {allen(a, c)}
    return found
