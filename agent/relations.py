"""All that holds between objects at one moment: a table by columns that gives records on demand.

Fifty objects are 1225 pairs of a dozen relations each: too many records to make in every step, of
which a few are ever read. So a step keeps its relations as arrays, a column for each question that
has one answer for a pair (such as: do the two converge, keep their distance, or diverge?), and a
`Relation` is made when somebody asks for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, overload

from visup.agent.records import Truth

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

UNKNOWN_CODE = -1
_CODES = {Truth.TRUE: 1, Truth.UNKNOWN: 0, Truth.FALSE: -1}
_TRUTHS = {code: truth for truth, code in _CODES.items()}


@dataclass(frozen=True, slots=True)
class Relation:
    """What holds between objects now.

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


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One question about every pair of objects, and its answers.

    Pairs (a, b) with a < b stand in the order (0, 1), (0, 2), ..., (1, 2), ... of the table's ids.
    Arrays have one row where the question is symmetric; else row 0 says what a is to b, row 1 what
    b is to a.

    Attributes:
        names: The relation that each code stands for; '' for a code that has no name of its own (not
            where only the one that holds is listed).
        state: (R, P) int8 codes, -1 unknown.
        since: (R, P) seconds since when each pair has its code.
        confidence: (R, P) 0 to 1.
        value: (R, P) the quantity behind it, NaN unknown; or None.
        sigma: (R, P) its standard deviation, NaN unknown; or None.
        listed: Which of its relations are told when a mind's relations are gone through: 'each'
            (true or false), 'one' (the one that holds), or 'none' (they are there to be asked for).
    """

    names: tuple[str, ...]
    state: NDArray[np.int8]
    since: NDArray[np.float64]
    confidence: NDArray[np.float64]
    value: NDArray[np.float64] | None = None
    sigma: NDArray[np.float64] | None = None
    listed: str = "each"

    def relation(self, code: int, pair: tuple[int, int], row: int, k: int) -> Relation:
        """The relation of one code for pair number k, in row `row`."""
        row = min(row, len(self.state) - 1)
        state = int(self.state[row, k])
        unknown = state == UNKNOWN_CODE
        held = Truth.TRUE if state == code else Truth.FALSE
        return Relation(
            self.names[code],
            pair,
            Truth.UNKNOWN if unknown else held,
            float(self.since[row, k]),
            0.0 if unknown else float(self.confidence[row, k]),
            _number(self.value, row, k),
            _number(self.sigma, row, k),
        )

    def told(self, pair: tuple[int, int], k: int) -> Iterator[Relation]:
        """What is listed of one pair, as it stands; the converse can be asked for."""
        codes: Iterable[int] = range(len(self.names))
        if self.listed == "one":
            codes = (max(0, int(self.state[0, k])),)
        return (self.relation(code, pair, 0, k) for code in codes if self.names[code])

    @property
    def count(self) -> int:
        """How many relations are listed of each pair."""
        return {"each": sum(map(bool, self.names)), "one": 1, "none": 0}[self.listed]


@dataclass(frozen=True, eq=False)
class RelationTable(Sequence[Relation]):
    """The relations of one step; immutable. As a sequence it gives those that are listed.

    Attributes:
        ids: (M,) object ids, increasing.
        columns: Questions about all pairs of them.
        extra: RelationTable given one by one (`coupled`, those of plug-ins).
    """

    ids: tuple[int, ...] = ()
    columns: tuple[Column, ...] = ()
    extra: tuple[Relation, ...] = field(default=())

    def find(self, name: str, *objects: int) -> Relation | None:
        """The relation of that name between exactly these objects, or None when it is not judged.

        Args:
            name: Any relation, listed or not.
            objects: Ids; their order matters for relations that are not symmetric.
        """
        at = self._named.get(name)
        if at is not None and len(objects) == 2:
            k, row = self.pair(*objects)
            if k >= 0:
                column, code = at
                return self.columns[column].relation(code, (objects[0], objects[1]), row, k)
        return self._given.get((name, frozenset(objects))) if self.extra else None

    def truth(self, name: str, a: int, b: int) -> Truth | None:
        """Whether the relation of that name holds from a to b, or None when it is not judged."""
        at = self._named.get(name)
        if at is not None:
            k, row = self.pair(a, b)
            if k >= 0:
                column, code = at
                state = self.columns[column].state
                held = int(state[row if len(state) > 1 else 0, k])
                return _TRUTHS[1 if held == code else 0 if held == UNKNOWN_CODE else -1]
        found = self._given.get((name, frozenset((a, b)))) if self.extra else None
        return None if found is None else found.truth

    def true(self, *names: str) -> tuple[Relation, ...]:
        """The relations of some names that are true, by their objects."""
        found = [r for r in self.extra if r.name in names and r.truth is Truth.TRUE]
        for name in names:
            if name not in self._named:
                continue
            number, code = self._named[name]
            column = self.columns[number]
            rows, places = (column.state == code).nonzero()
            pairs = list(self._pairs) if len(places) else []
            for row, k in zip(rows.tolist(), places.tolist(), strict=True):
                pair = pairs[k] if row == 0 else pairs[k][::-1]
                found.append(column.relation(code, pair, row, k))
        return tuple(sorted(found, key=lambda r: r.objects))

    def truths(self, name: str, ids: Sequence[int]) -> NDArray[np.int8]:
        """A relation between all of some objects.

        Args:
            name: Any relation, listed or not.
            ids: Objects, in any order.

        Returns:
            (n, n) int8, a the row and b the column: 1 true, -1 false, 0 unknown or not judged.
        """
        table: NDArray[np.int8] = self.truths_of((name,), ids)[0]
        return table

    def truths_of(self, names: tuple[str, ...], ids: Sequence[int]) -> NDArray[np.int8]:
        """Several relations between all of some objects, in one pass.

        Args:
            names: Any relations, listed or not.
            ids: Objects, in any order.

        Returns:
            (k, n, n) int8, one table as of `truths` for each name.
        """
        import numpy as np

        places, code = _places_of(self._names, self._heights, names, len(self.ids))
        states = [c.state.ravel() for c in self.columns]
        codes = _truth(np.concatenate([*states, _nothing()]).take(places), code)
        if tuple(ids) != self.ids:
            codes = self._of(codes, ids)
        for r in self.extra:
            if r.name in names and len(r.objects) == 2 and set(r.objects) <= set(ids):
                i, j = (list(ids).index(o) for o in r.objects)
                k = names.index(r.name)
                codes[k, i, j] = codes[k, j, i] = _CODES[r.truth]
        return codes

    def _of(self, codes: NDArray[np.int8], ids: Sequence[int]) -> NDArray[np.int8]:
        """(k, n, n) tables for other objects; what is not judged is unknown."""
        import numpy as np

        out = np.zeros((len(codes), len(ids), len(ids)), dtype=np.int8)
        there = [n for n, i in enumerate(ids) if i in self._place]
        here = [self._place[ids[n]] for n in there]
        out[:, np.array(there, np.intp)[:, None], there] = codes[
            :, np.array(here, np.intp)[:, None], here
        ]
        return out

    def all(self) -> Iterator[Relation]:
        """Everything that is judged, listed or not: of each question the relation that holds."""
        for k, pair in enumerate(self._pairs):
            for column in self.columns:
                for row in range(len(column.state)):
                    code = max(0, int(column.state[row, k]))
                    if column.names[code]:
                        yield column.relation(code, pair if row == 0 else pair[::-1], row, k)
        yield from self.extra

    def pair(self, a: int, b: int) -> tuple[int, int]:
        """Number of a pair and its row: 0 as it stands, 1 turned round; number -1 when not there."""
        i, j = self._place.get(a, -1), self._place.get(b, -1)
        if i < 0 or j < 0 or i == j:
            return -1, 0
        low, high, row = (i, j, 0) if i < j else (j, i, 1)
        m = len(self.ids)
        return low * m - low * (low + 1) // 2 + high - low - 1, row

    def __iter__(self) -> Iterator[Relation]:
        listed = [c for c in self.columns if c.listed != "none"]
        for k, pair in enumerate(self._pairs):
            for column in listed:
                yield from column.told(pair, k)
        yield from self.extra

    def __len__(self) -> int:
        m = len(self.ids)
        return m * (m - 1) // 2 * sum(c.count for c in self.columns) + len(self.extra)

    @overload
    def __getitem__(self, index: int) -> Relation: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Relation, ...]: ...
    def __getitem__(self, index: int | slice) -> Relation | tuple[Relation, ...]:
        return self._listed[index]

    def __add__(self, more: Iterable[Relation]) -> RelationTable:
        return RelationTable(self.ids, self.columns, (*self.extra, *more))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RelationTable | tuple):
            return NotImplemented
        return tuple(self) == tuple(other)

    def __hash__(self) -> int:
        return hash(self._listed)

    @property
    def _pairs(self) -> Iterator[tuple[int, int]]:
        return ((a, b) for i, a in enumerate(self.ids) for b in self.ids[i + 1 :])

    @cached_property
    def _listed(self) -> tuple[Relation, ...]:
        return tuple(self)

    @cached_property
    def _place(self) -> Mapping[int, int]:
        return {object_id: i for i, object_id in enumerate(self.ids)}

    @cached_property
    def _named(self) -> Mapping[str, tuple[int, int]]:
        return _codes_of(self._names)

    @property
    def _names(self) -> tuple[tuple[str, ...], ...]:
        return tuple([c.names for c in self.columns])

    @property
    def _heights(self) -> tuple[int, ...]:
        return tuple([len(c.state) for c in self.columns])

    @cached_property
    def _given(self) -> Mapping[tuple[str, frozenset[int]], Relation]:
        return {(r.name, frozenset(r.objects)): r for r in reversed(self.extra)}


def _number(table: Any, row: int, k: int) -> float | None:
    if table is None:
        return None
    value = float(table[row, k])
    return value if value == value else None  # NaN is not equal to itself


@lru_cache(maxsize=16)
def _codes_of(names: tuple[tuple[str, ...], ...]) -> Mapping[str, tuple[int, int]]:
    """Relation -> number of its column and its code there; tables of all steps have the same ones."""
    return {n: (c, code) for c, told in enumerate(names) for code, n in enumerate(told) if n}


@lru_cache(maxsize=128)
def _places_of(
    names: tuple[tuple[str, ...], ...],
    heights: tuple[int, ...],
    wanted: tuple[str, ...],
    m: int,
) -> tuple[NDArray[np.intp], NDArray[np.int8]]:
    """Where some relations of all of m objects are found in the states of all columns, end to end.

    Returns:
        (k, m, m) places, of what is not judged that behind the last state, and (k, 1, 1) codes.
    """
    import numpy as np

    named, first, second = _codes_of(names), *np.triu_indices(m, 1)
    pairs, each = len(first), np.arange(len(first))
    places = np.full((len(wanted), m, m), sum(heights) * pairs, dtype=np.intp)
    codes = np.zeros((len(wanted), 1, 1), dtype=np.int8)
    for k, name in enumerate(wanted):
        if name in named:
            column, codes[k] = named[name]
            row = sum(heights[:column])
            places[k, first, second] = row * pairs + each
            places[k, second, first] = (row + heights[column] - 1) * pairs + each
    return places, codes


@lru_cache(maxsize=1)
def _nothing() -> NDArray[np.int8]:
    """The state of what is not judged."""
    import numpy as np

    return np.array([UNKNOWN_CODE], dtype=np.int8)


def _truth(state: NDArray[np.int8], code: NDArray[np.int8]) -> NDArray[np.int8]:
    """1 where a state has the code, 0 where it is unknown, else -1."""
    held: NDArray[np.int8] = (state == code).view("int8")
    held += held
    held -= (state != UNKNOWN_CODE).view("int8")
    return held
