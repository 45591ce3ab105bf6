"""A snapshot of a mind for rules: truths and quantities of all objects and pairs, as arrays.

Unobserved facts are unknown, never false. Truths are codes: `YES`, `NO`, and `MAYBE` for unknown.
Quantities are intervals: value +- `SIGMAS` standard deviations where these are known.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief
from visup.rules.formula.truth import NO, YES
from visup.rules.predicates._snapshot_jit import pair_quantities
from visup.rules.relations.kinematics import Kinematics, RelationSettings
from visup.rules.relations.reasoner import NAMES, kinematics, relation_settings
from visup.rules.wording.sentences import short

Codes = NDArray[np.int8]
Floats = NDArray[np.float64]

REFLEXIVE_RELATIONS = frozenset({"equal", "outlines_equal"})
SIGMAS = 1.0
"""Half width of a measured quantity's interval, standard deviations."""

RELATION_NAMES = (*NAMES, "coupled")
"""Relations between two objects available in rules."""


class Snapshot:
    """A mind as seen by rules; made once per step.

    Args:
        mind: The mind after this step's relations.

    Attributes:
        mind: The mind.
        beliefs: Objects believed present, by ascending id.
        ids: Their ids.
        row: Id -> index in `ids`, and so in all arrays.
        measured: Quantities of all pairs.
        relation_settings: The run's limits of relations, which predicates share.
    """

    def __init__(self, mind: Mind) -> None:
        self.mind = mind
        self.beliefs = mind.present()
        self.ids = tuple(b.id for b in self.beliefs)
        self.row = {object_id: i for i, object_id in enumerate(self.ids)}
        self.measured: Kinematics = kinematics(mind)
        self.relation_settings: RelationSettings = relation_settings(mind)
        self._names: dict[int, str] = {}
        self._codes: dict[str, Codes] = {}
        self._paired: tuple[Floats, Codes] | None = None

    def short(self, object_id: int) -> str:
        """An object in two words; see `sentences.short`."""
        if object_id not in self._names:
            self._names[object_id] = short(self.mind, object_id)
        return self._names[object_id]

    def codes_of_objects(self, evaluate: Callable[[ObjectBelief], int]) -> Codes:
        """(n,) codes from a function of each object."""
        return np.array([evaluate(b) for b in self.beliefs], dtype=np.int8)

    def codes_of_ids(self, ids: Collection[int | None]) -> Codes:
        """(n,) `YES` for some objects, `NO` for the others."""
        codes = [YES if i in ids else NO for i in self.ids] if ids else [NO] * len(self.ids)
        return np.array(codes, dtype=np.int8)

    def pairs(self, code: int) -> Codes:
        """(n, n) codes, all the same."""
        codes = np.empty((len(self.ids), len(self.ids)), dtype=np.int8)
        codes.fill(code)
        return codes

    def unknown(self, objects: int) -> Floats:
        """(2, n) or (2, n, n) intervals, all unknown."""
        intervals = np.empty((2, *(len(self.ids),) * objects))
        intervals[0], intervals[1] = -np.inf, np.inf
        return intervals

    def relation_codes(self, name: str) -> Codes:
        """(n, n) codes of a relation, a the row and b the column."""
        if name not in self._codes:
            self._codes[name] = self._coupled() if name == "coupled" else self.relations((name,))[0]
        return self._codes[name]

    def relations(self, names: tuple[str, ...]) -> Codes:
        """(k, n, n) codes of several relations, looked up in one pass; without couplings."""
        tables = self.mind.truth_tables(names, self.ids)
        # An object is equal to itself, and has no other relation to itself.
        n = len(self.ids)
        tables.reshape(len(names), n * n)[:, :: n + 1] = _codes_on_diagonal(names)
        return tables

    def _coupled(self) -> Codes:
        codes, row = self.pairs(NO), self.row
        for a, b in (c.objects for c in self.mind.couplings):
            if a in row and b in row:
                codes[row[a], row[b]] = codes[row[b], row[a]] = YES
        return codes

    @cached_property
    def _rows(self) -> NDArray[np.intp]:
        """Indices of the objects in the measurements; -1 if not measured."""
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

    def pair_intervals(self, quantity: int) -> Floats:
        """(2, n, n) intervals of one of the quantities of `pair_loops`."""
        intervals: Floats = self._pairs[0][quantity]
        return intervals

    @property
    def first_contact(self) -> Codes:
        """(n, n) whether the second is the first contact of the first."""
        return self._pairs[1]

    @property
    def _pairs(self) -> tuple[Floats, Codes]:
        """All quantities of pairs, and first contacts."""
        if self._paired is None:
            n = len(self.ids)
            out, first = np.empty((4, 2, n, n)), np.empty((n, n), np.int8)
            # In one memory layout, so that the loops are compiled once.
            gap, rate, sigma, relative = (
                np.ascontiguousarray(self.pair(name))
                for name in ("gap", "rate", "rate_sigma", "relative_speed")
            )
            pair_quantities(gap, rate, sigma, relative, SIGMAS, out, first)
            self._paired = out, first
        return self._paired


@lru_cache(maxsize=256)
def _codes_on_diagonal(names: tuple[str, ...]) -> Codes:
    """(k, 1) whether relations hold between an object and itself."""
    codes = np.array([YES if name in REFLEXIVE_RELATIONS else NO for name in names], dtype=np.int8)
    return codes.reshape(-1, 1)


def code(value: bool) -> int:
    """`YES` or `NO`."""
    return YES if value else NO


def exact(values: Floats) -> Floats:
    """(2, n) intervals of known values; NaN becomes unknown."""
    known = values.tolist()
    return np.array(
        ([v if v == v else -np.inf for v in known], [v if v == v else np.inf for v in known])
    )


def interval_between(low: Floats, high: Floats) -> Floats:
    """(2, ...) intervals; NaN becomes unknown."""
    both = np.empty((2, *low.shape))
    # These return the number if the other argument is NaN.
    np.fmax(low, -np.inf, out=both[0])
    np.fmin(high, np.inf, out=both[1])
    return both
