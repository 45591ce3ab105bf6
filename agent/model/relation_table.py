"""The relations between objects at one moment: a columnar table that creates records on demand.

Fifty objects have 1225 pairs with a dozen relations each: too many records to create in every step, of which
few are ever read. So relations are stored as arrays, one column for each question with one answer per pair
(such as: do the two converge, keep their distance, or diverge?), and a `Relation` is created when requested.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from operator import itemgetter
from typing import TYPE_CHECKING, overload

from visup.agent.model.display import enable_display
from visup.agent.model.records import Truth
from visup.agent.model.relation_columns import UNKNOWN_CODE, ColumnLayout, Relation, RelationBlock

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_CODES = {Truth.TRUE: 1, Truth.UNKNOWN: 0, Truth.FALSE: -1}
_TRUTHS = {code: truth for truth, code in _CODES.items()}


@dataclass(frozen=True, eq=False)
class RelationTable(Sequence[Relation]):
    """The relations of one step; immutable. As a sequence it has the listed relations.

    Attributes:
        ids: (M,) object ids, increasing.
        parts: Relations between all pairs of them.
        extra: Relations given one by one (those of plug-ins).
    """

    ids: tuple[int, ...] = ()
    parts: tuple[RelationBlock, ...] = ()
    extra: tuple[Relation, ...] = field(default=())

    def with_block(self, cells: RelationBlock) -> RelationTable:
        """The same table with a further block for all pairs of its objects."""
        return RelationTable(self.ids, (*self.parts, cells), self.extra)

    def find(self, name: str, *objects: int) -> Relation | None:
        """The relation of that name between exactly these objects, or None if it is not evaluated.

        Args:
            name: Any relation, listed or not.
            objects: Ids; their order matters for relations that are not symmetric.
        """
        if len(objects) == 2:
            k, row = self.pair(*objects)
            for part in self.parts:
                at = part.columns.named.get(name)
                if at is not None and k >= 0:
                    return part.relation(*at, (objects[0], objects[1]), row, k)
        return self._extra_by_name.get((name, frozenset(objects))) if self.extra else None

    def truth(self, name: str, a: int, b: int) -> Truth | None:
        """Truth of the relation of that name from a to b, or None if it is not evaluated."""
        for part in self.parts:
            at = part.columns.named.get(name)
            if at is not None:
                k, row = self.pair(a, b)
                if k >= 0:
                    column, code = at
                    state = int(part.state[column.rows[row], k])
                    return _TRUTHS[1 if state == code else 0 if state == UNKNOWN_CODE else -1]
        found = self._extra_by_name.get((name, frozenset((a, b)))) if self.extra else None
        return None if found is None else found.truth

    def codes(self, name: str) -> list[int]:
        """A relation for all pairs in order: 1 true, -1 false, 0 unknown or not evaluated."""
        for part in self.parts:
            at = part.columns.named.get(name)
            if at is not None:
                column, code = at
                states = part.state[column.rows[0]].tolist()
                return [1 if c == code else 0 if c == UNKNOWN_CODE else -1 for c in states]
        truths = [self.truth(name, *pair) for pair in self._pairs]
        return [0 if t is None else _CODES[t] for t in truths]

    def holding(self, *names: str) -> tuple[Relation, ...]:
        """The true relations with the given names, by their objects."""
        relations = (self.find(name, *objects) for objects, name in self.holding_objects(*names))
        return tuple([r for r in relations if r is not None])

    def holding_objects(self, *names: str) -> list[tuple[tuple[int, ...], str]]:
        """Objects and names of the true relations with the given names, by objects; creates no records."""
        found: list[tuple[tuple[int, ...], str]] = [
            (r.objects, r.name) for r in self.extra if r.name in names and r.truth is Truth.TRUE
        ]
        pairs: list[tuple[int, int]] = []
        for part in self.parts:
            for name in names:
                column, code = part.columns.named.get(name, (None, 0))
                if column is None:
                    continue
                pairs = pairs or list(self._pairs)
                for row in range(len(set(column.rows))):
                    states = part.state[column.rows[row]].tolist()
                    for k, state in enumerate(states):
                        if state == code:
                            pair = pairs[k] if row == 0 else pairs[k][::-1]
                            found.append((pair, name))
        return sorted(found, key=itemgetter(0))

    def truth_codes(self, name: str, ids: Sequence[int]) -> NDArray[np.int8]:
        """A relation between all pairs of the given objects.

        Args:
            name: Any relation, listed or not.
            ids: Objects, in any order.

        Returns:
            (n, n) int8, a the row and b the column: 1 true, -1 false, 0 unknown or not evaluated.
        """
        table: NDArray[np.int8] = self.truth_tables((name,), ids)[0]
        return table

    def truth_tables(self, names: tuple[str, ...], ids: Sequence[int]) -> NDArray[np.int8]:
        """Several relations between all pairs of the given objects, in one pass.

        Args:
            names: Any relations, listed or not.
            ids: Objects, in any order.

        Returns:
            (k, n, n) int8, one table as in `truth_codes` for each name.
        """
        import numpy as np

        columns = tuple([part.columns for part in self.parts])
        heights = tuple([len(part.state) for part in self.parts])
        indices, code = _indices_of(columns, heights, names, len(self.ids))
        states = [part.state.ravel() for part in self.parts]
        codes = _truth(np.concatenate([*states, _not_evaluated()]).take(indices), code)
        if tuple(ids) != self.ids:
            codes = self._for_ids(codes, ids)
        for r in self.extra:
            if r.name in names and len(r.objects) == 2 and set(r.objects) <= set(ids):
                i, j = (list(ids).index(o) for o in r.objects)
                k = names.index(r.name)
                codes[k, i, j] = codes[k, j, i] = _CODES[r.truth]
        return codes

    def _for_ids(self, codes: NDArray[np.int8], ids: Sequence[int]) -> NDArray[np.int8]:
        """(k, n, n) tables for the given objects; 0 where not evaluated."""
        import numpy as np

        out = np.zeros((len(codes), len(ids), len(ids)), dtype=np.int8)
        rows = [n for n, i in enumerate(ids) if i in self._index]
        source_rows = [self._index[ids[n]] for n in rows]
        out[:, np.array(rows, np.intp)[:, None], rows] = codes[
            :, np.array(source_rows, np.intp)[:, None], source_rows
        ]
        return out

    def all(self) -> Iterator[Relation]:
        """All evaluated relations, listed or not: of each column the one that holds."""
        for part in self.parts:
            for k, pair in enumerate(self._pairs):
                for column in part.columns.each:
                    for row, at in enumerate(dict.fromkeys(column.rows)):
                        code = max(0, int(part.state[at, k]))
                        if column.names[code]:
                            turned = pair if row == 0 else pair[::-1]
                            yield part.relation(column, code, turned, row, k)
        yield from self.extra

    def pair(self, a: int, b: int) -> tuple[int, int]:
        """Number of a pair and its row: 0 in order, 1 reversed; number -1 if it does not exist."""
        i, j = self._index.get(a, -1), self._index.get(b, -1)
        if i < 0 or j < 0 or i == j:
            return -1, 0
        low, high, row = (i, j, 0) if i < j else (j, i, 1)
        m = len(self.ids)
        return low * m - low * (low + 1) // 2 + high - low - 1, row

    def __iter__(self) -> Iterator[Relation]:
        for part in self.parts:
            listed = [q for q in part.columns.each if q.listed != "none"]
            for k, pair in enumerate(self._pairs):
                for column in listed:
                    yield from part.listed_of(column, pair, k)
        yield from self.extra

    def __len__(self) -> int:
        m = len(self.ids)
        count = sum(q.count for part in self.parts for q in part.columns.each)
        return m * (m - 1) // 2 * count + len(self.extra)

    @overload
    def __getitem__(self, index: int) -> Relation: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Relation, ...]: ...
    def __getitem__(self, index: int | slice) -> Relation | tuple[Relation, ...]:
        return self._listed[index]

    def __add__(self, more: Iterable[Relation]) -> RelationTable:
        return RelationTable(self.ids, self.parts, (*self.extra, *more))

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
    def _index(self) -> Mapping[int, int]:
        return {object_id: i for i, object_id in enumerate(self.ids)}

    @cached_property
    def _extra_by_name(self) -> Mapping[tuple[str, frozenset[int]], Relation]:
        return {(r.name, frozenset(r.objects)): r for r in reversed(self.extra)}


@lru_cache(maxsize=128)
def _indices_of(
    columns: tuple[ColumnLayout, ...], heights: tuple[int, ...], wanted: tuple[str, ...], m: int
) -> tuple[NDArray[np.intp], NDArray[np.int8]]:
    """The indices of relations between m objects in the concatenated states of all blocks.

    Returns:
        (k, m, m) indices, one past the last state if not evaluated, and (k, 1, 1) codes.
    """
    import numpy as np

    first, second = np.triu_indices(m, 1)
    pairs, numbers = len(first), np.arange(len(first))
    indices = np.full((len(wanted), m, m), sum(heights) * pairs, dtype=np.intp)
    codes = np.zeros((len(wanted), 1, 1), dtype=np.int8)
    for number, part in enumerate(columns):
        begin = sum(heights[:number])
        for k, name in enumerate(wanted):
            if name in part.named:
                column, codes[k] = part.named[name]
                row, turned = column.rows
                indices[k, first, second] = (begin + row) * pairs + numbers
                indices[k, second, first] = (begin + turned) * pairs + numbers
    return indices, codes


@lru_cache(maxsize=1)
def _not_evaluated() -> NDArray[np.int8]:
    """The state of relations that are not evaluated."""
    import numpy as np

    return np.array([UNKNOWN_CODE], dtype=np.int8)


def _truth(state: NDArray[np.int8], code: NDArray[np.int8]) -> NDArray[np.int8]:
    """1 where a state has the code, 0 where it is unknown, else -1."""
    holds = (state == code).astype("int8")
    return holds + holds - (state != UNKNOWN_CODE)  # type: ignore[no-any-return]


enable_display(RelationTable)
