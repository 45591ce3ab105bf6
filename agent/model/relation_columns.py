"""The columns of a relation table: one question per column, with the answers for all pairs as arrays."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from visup.agent.model.display import enable_display
from visup.agent.model.records import Truth

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

UNKNOWN_CODE = -1


@dataclass(frozen=True, slots=True)
class Relation:
    """A relation between objects at one moment.

    Attributes:
        name: 'converging', 'diverging', 'keeping_distance', 'touching', 'coupled', ...
        objects: Ids; order matters only for relations that are not symmetric.
        truth: True, false or unknown.
        since: Seconds since when it has this truth.
        confidence: 0 to 1.
        value: The quantity behind it (such as pixels per second), or None.
        sigma: Standard deviation of `value`.
    """

    name: str
    objects: tuple[int, ...]
    truth: Truth
    since: float
    confidence: float = 1.0
    value: float | None = None
    sigma: float | None = None


@dataclass(frozen=True, slots=True)
class Column:
    """One question about every pair of objects; see `RelationBlock`.

    Attributes:
        names: The relation of each code; '' for a code without a name (not with `listed='one'`).
        rows: Row of the codes for a to b, and row of those for b to a; equal if the question is symmetric.
        confidence: Row of the confidences, 0 to 1.
        value: Row of the underlying quantity, NaN if unknown; or None.
        sigma: Row of its standard deviation, NaN if unknown; or None.
        listed: Which of its relations are listed when iterating over a mind's relations: 'each' (true or
            false), 'one' (the one that holds), or 'none' (on request only).
    """

    names: tuple[str, ...]
    rows: tuple[int, int]
    confidence: int
    value: int | None = None
    sigma: int | None = None
    listed: str = "each"

    @property
    def count(self) -> int:
        """Number of relations listed per pair."""
        return {"each": sum(map(bool, self.names)), "one": 1, "none": 0}[self.listed]


@dataclass(frozen=True, eq=False)
class ColumnLayout:
    """Columns that occur together in every step, created once.

    Attributes:
        each: The columns in listing order.
    """

    each: tuple[Column, ...]

    @cached_property
    def named(self) -> Mapping[str, tuple[Column, int]]:
        """Relation -> its column and its code."""
        return {n: (q, code) for q in self.each for code, n in enumerate(q.names) if n}


@dataclass(frozen=True, slots=True, eq=False)
class RelationBlock:
    """The relations between all pairs of objects.

    Pairs (a, b) with a < b are in the order (0, 1), (0, 2), ..., (1, 2), ... of a table's ids.

    Attributes:
        columns: Meaning of the rows.
        state: (R, P) int8 codes, -1 unknown.
        since: (R, P) seconds since when each pair has its code.
        numbers: (N, P) confidences and quantities.
    """

    columns: ColumnLayout
    state: NDArray[np.int8]
    since: NDArray[np.float64]
    numbers: NDArray[np.float64]

    def relation(
        self, column: Column, code: int, pair: tuple[int, int], row: int, k: int
    ) -> Relation:
        """The relation of one code for pair number k, in order (row 0) or reversed (1)."""
        at = column.rows[row]
        state = int(self.state[at, k])
        unknown = state == UNKNOWN_CODE
        known_truth = Truth.TRUE if state == code else Truth.FALSE
        return Relation(
            column.names[code],
            pair,
            Truth.UNKNOWN if unknown else known_truth,
            float(self.since[at, k]),
            0.0 if unknown else float(self.numbers[column.confidence, k]),
            self._number(column.value, k),
            self._number(column.sigma, k),
        )

    def listed_of(self, column: Column, pair: tuple[int, int], k: int) -> Iterator[Relation]:
        """The listed relations of one pair in order; converses are available on request."""
        codes: Iterable[int] = range(len(column.names))
        if column.listed == "one":
            codes = (max(0, int(self.state[column.rows[0], k])),)
        return (self.relation(column, c, pair, 0, k) for c in codes if column.names[c])

    def _number(self, row: int | None, k: int) -> float | None:
        if row is None:
            return None
        value = float(self.numbers[row, k])
        return value if value == value else None  # NaN is not equal to itself


enable_display(Relation)
