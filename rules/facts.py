"""One mind as rules see it: truths and quantities of all objects and pairs, as arrays.

What was not observed is unknown, never false. Truths are codes: `YES`, `NO`, `MAYBE` of not known.
Quantities are intervals: value +- `SIGMAS` standard deviations where the deviation is measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief, Relation, Truth
from visup.rules.geometry import RCC8
from visup.rules.measure import Measured
from visup.rules.relations import measured

Codes = NDArray[np.int8]
Floats = NDArray[np.float64]
YES, MAYBE, NO = 1, 0, -1
CODE = {Truth.TRUE: YES, Truth.UNKNOWN: MAYBE, Truth.FALSE: NO}

SIGMAS = 1.0
"""How many standard deviations a measured quantity's interval reaches to either side."""

RELATION_NAMES = (
    "converging",
    "diverging",
    "keeping_distance",
    "touching",
    "coupled",
    "moving_together",
    *RCC8,
)
"""Relations between two objects; all but the proper parts are symmetric."""


class Facts:
    """One mind as rules see it; made once for each step.

    Args:
        mind: The mind after relations were judged.

    Attributes:
        mind: The mind.
        beliefs: Objects that are believed present, by increasing id.
        ids: Their ids.
        row: Id -> place in `ids`, and so in all arrays.
    """

    def __init__(self, mind: Mind) -> None:
        self.mind = mind
        self.beliefs = mind.present()
        self.ids = tuple(b.id for b in self.beliefs)
        self.row = {object_id: i for i, object_id in enumerate(self.ids)}
        self._codes: dict[str, Codes] = {}

    def each(self, look: Callable[[ObjectBelief], int]) -> Codes:
        """(n,) codes from a look at each object."""
        return np.array([look(b) for b in self.beliefs], dtype=np.int8)

    def pairs(self, code: int) -> Codes:
        """(n, n) codes that are all the same."""
        return np.full((len(self.ids), len(self.ids)), code, dtype=np.int8)

    def related(self, name: str) -> Codes:
        """(n, n) codes of a relation; of the box relations, a is the row and b the column."""
        if name not in self._codes:
            self._codes[name] = self._box(name) if name in RCC8 else self._plain(name)
        return self._codes[name]

    @cached_property
    def _told(self) -> Mapping[str, list[Relation]]:
        """Relations between objects that are here, by name."""
        found: dict[str, list[Relation]] = {}
        for r in self.mind.relations:
            found.setdefault(r.name, []).append(r)
        return found

    def _plain(self, name: str) -> Codes:
        """A relation for which the order of its objects does not matter."""
        if name == "coupled":
            codes = self.pairs(NO)
            self._put(codes, [(c.objects, YES) for c in self.mind.couplings])
            return codes
        codes = self.pairs(MAYBE)
        self._put(codes, [(r.objects, CODE[r.truth]) for r in self._told.get(name, ())])
        np.fill_diagonal(codes, NO)
        return codes

    def _put(self, codes: Codes, found: list[tuple[tuple[int, ...], int]]) -> None:
        row = self.row
        known = [(row[a], row[b], c) for (a, b), c in found if a in row and b in row]
        if known:
            i, j, values = np.array(known).T
            codes[i, j] = codes[j, i] = values

    def _box(self, name: str) -> Codes:
        """One box relation is told of each pair, in the order of its ids."""
        codes, inverse = self.pairs(MAYBE), INVERSE.get(name, name)
        told = (r for n in RCC8 for r in self._told.get(n, ()) if r.truth is Truth.TRUE)
        for r in told:
            if set(r.objects) <= self.row.keys():
                i, j = self.row[r.objects[0]], self.row[r.objects[1]]
                codes[i, j] = YES if r.name == name else NO
                codes[j, i] = YES if r.name == inverse else NO
        np.fill_diagonal(codes, YES if name == "equal" else NO)
        return codes

    @cached_property
    def measured(self) -> Measured:
        """Quantities of all pairs."""
        return measured(self.mind)

    @cached_property
    def _rows(self) -> NDArray[np.intp]:
        """Where the objects stand in what was measured; -1 for those that were not."""
        known = {object_id: i for i, object_id in enumerate(self.measured.ids)}
        return np.array([known.get(i, -1) for i in self.ids], dtype=np.intp)

    def one(self, quantity: str) -> Floats:
        """(n,) one quantity of each object; NaN when unknown."""
        table: Floats = getattr(self.measured, quantity)
        if self.measured.ids == self.ids:
            return table
        values = np.full(len(self.ids), np.nan)
        known = self._rows >= 0
        values[known] = table[self._rows[known]]
        return values

    def pair(self, quantity: str) -> Floats:
        """(n, n) one quantity of each pair; NaN when unknown."""
        table: Floats = getattr(self.measured, quantity)
        if self.measured.ids == self.ids:
            return table
        values = np.full((len(self.ids), len(self.ids)), np.nan)
        known = self._rows >= 0
        inner = np.ix_(self._rows[known], self._rows[known])
        values[np.ix_(known, known)] = table[inner]
        return values

    @cached_property
    def closing(self) -> Floats:
        """(3, n, n) how fast distances shrink, px/s: the least, the most likely, the most."""
        rate, sigma = -self.pair("rate"), SIGMAS * np.nan_to_num(self.pair("rate_sigma"))
        return np.stack((rate - sigma, rate, rate + sigma))

    @cached_property
    def contact(self) -> Floats:
        """(3, n, n) seconds until outlines meet: soonest, most likely, latest; NaN when unknown."""
        gap, closing = self.pair("gap"), self.closing[::-1]
        with np.errstate(invalid="ignore", divide="ignore"):
            times = np.where(closing > 0, gap / closing, np.inf)
        times[:, np.isnan(gap) | np.isnan(closing[1])] = np.nan
        times[:, (gap == 0.0) & ~np.isnan(closing[1])] = 0.0
        return times


INVERSE = {
    a + b: a + c
    for a in ("tangential_proper_part", "non_tangential_proper_part")
    for b, c in (("", "_inverse"), ("_inverse", ""))
}
"""Box relation -> the same with its objects exchanged; the others are symmetric."""


def code(value: bool) -> int:
    """`YES` or `NO`."""
    return YES if value else NO


def exactly(values: Floats) -> Floats:
    """(2, ...) intervals of known values; NaN becomes unknown."""
    unknown = np.isnan(values)
    if not unknown.any():
        return np.stack((values, values))
    return np.stack((np.where(unknown, -np.inf, values), np.where(unknown, np.inf, values)))


def between(low: Floats, high: Floats) -> Floats:
    """(2, ...) intervals; NaN becomes unknown."""
    return np.stack((np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)))
