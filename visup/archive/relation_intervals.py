"""Converts the relations of all pairs, step by step, to the intervals in which they held or were unknown.

All pairs are processed at once, since a step of twenty objects has 190 of them: one comparison finds the
changes since the previous step, and only those are processed further.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent import Relation, RelationTable, Truth
from visup.agent.model.relation_columns import UNKNOWN_CODE, ColumnLayout, RelationBlock
from visup.archive.value_intervals import IntervalCollector, StepTime, interval_columns

Floats = NDArray[np.float64]
Pair = tuple[int, int]
Row = tuple[Any, ...]
"""Relation, a, b, truth, the five columns of an interval, confidence, minimum, maximum."""


@dataclass(frozen=True, eq=False)
class _LayoutRows:
    """The state rows of a layout: their names, and the rows of their numbers."""

    layout: ColumnLayout

    @cached_property
    def rows(self) -> tuple[tuple[int, bool, tuple[str, ...], int, int], ...]:
        """State row, whether it is of the reversed pair, names, row of confidence, row of value or -1."""
        return tuple(
            (at, turned == 1, q.names, q.confidence, -1 if q.value is None else q.value)
            for q in self.layout.each
            for turned, at in enumerate(dict.fromkeys(q.rows))
        )

    def values(self, block: RelationBlock) -> tuple[NDArray[np.int8], Floats, Floats]:
        """(L, P) states, confidences and values for L rows and P pairs; NaN without a value."""
        state = block.state[[r[0] for r in self.rows]]
        confidence = block.numbers[[r[3] for r in self.rows]]
        confidence = np.where(state == UNKNOWN_CODE, 0.0, confidence)
        value = block.numbers[[max(0, r[4]) for r in self.rows]].astype(np.float64)
        value[[r[4] < 0 for r in self.rows]] = np.nan
        return state, confidence, value


@dataclass(slots=True)
class _OpenPairs:
    """The open intervals of P pairs: (L, P) each."""

    pairs: tuple[Pair, ...]
    state: NDArray[np.int8]
    begin: NDArray[np.int64]
    confidence: Floats
    least: Floats
    most: Floats

    def take(self, numbers: list[int], pairs: tuple[Pair, ...]) -> _OpenPairs:
        """Select some of the pairs."""
        return _OpenPairs(
            pairs,
            self.state[:, numbers],
            self.begin[:, numbers],
            self.confidence[:, numbers],
            self.least[:, numbers],
            self.most[:, numbers],
        )


class RelationIntervals:
    """Collects the relations of each step into the rows of the table `relations`."""

    def __init__(self) -> None:
        self._times: list[StepTime] = []
        self._open: dict[int, tuple[_LayoutRows, _OpenPairs]] = {}
        self._plugin_stretches: IntervalCollector[tuple[str, Pair], tuple[str, float]] = (
            IntervalCollector()
        )
        self._rows: list[Row] = []

    def add(self, at: StepTime, relations: RelationTable | tuple[Relation, ...]) -> None:
        """Add the relations of one step."""
        table = (
            relations if isinstance(relations, RelationTable) else RelationTable(extra=relations)
        )
        self._times.append(at)
        self._plugin_stretches.add(
            at, {(r.name, _pair(r)): _truth_and_value(r) for r in table.extra if _is_binary(r)}
        )
        pairs = tuple(combinations(table.ids, 2))
        blocks = {id(part.columns): part for part in table.parts}
        for key in [k for k in self._open if k not in blocks]:
            layout, open_pairs = self._open.pop(key)
            self._close(layout, open_pairs, np.ones(open_pairs.state.shape, bool), at, False)
        for key, block in blocks.items():
            before = self._open.get(key)
            layout = before[0] if before else _LayoutRows(block.columns)
            self._open[key] = layout, self._next(layout, before and before[1], block, pairs)

    def finish(self) -> list[Row]:
        """All rows, by relation, objects and time."""
        if self._times:
            last = self._times[-1]
            for layout, held in self._open.values():
                self._close(layout, held, np.ones(held.state.shape, bool), last, True)
            for s in self._plugin_stretches.finish(last):
                (name, pair), (truth, confidence) = s.key, s.value
                self._rows.append((name, *pair, truth, *s.columns, confidence, None, None))
        self._open = {}
        return sorted(self._rows, key=lambda r: (r[0], r[1], r[2], r[4]))

    def _next(
        self,
        layout: _LayoutRows,
        open_pairs: _OpenPairs | None,
        block: RelationBlock,
        pairs: tuple[Pair, ...],
    ) -> _OpenPairs:
        """The open intervals after a step; those that end become rows."""
        state, confidence, value = layout.values(block)
        number = len(self._times) - 1
        new = _OpenPairs(
            pairs, state, np.full(state.shape, number, np.int64), confidence, value, value
        )
        if open_pairs is None:
            return new
        if open_pairs.pairs != pairs:
            open_pairs, existed = self._realigned(layout, open_pairs, pairs)
        else:
            existed = np.ones(len(pairs), bool)
        same = (open_pairs.state == state) & existed
        self._close(layout, open_pairs, ~same & existed, self._times[-1], False)
        return _OpenPairs(
            pairs,
            state,
            np.where(same, open_pairs.begin, new.begin),
            np.where(same, np.minimum(open_pairs.confidence, confidence), confidence),
            np.where(same, np.fmin(open_pairs.least, value), value),
            np.where(same, np.fmax(open_pairs.most, value), value),
        )

    def _realigned(
        self, layout: _LayoutRows, open_pairs: _OpenPairs, pairs: tuple[Pair, ...]
    ) -> tuple[_OpenPairs, NDArray[np.bool_]]:
        """Realign to other pairs; returns which existed before. Those of missing pairs are closed."""
        place = {pair: k for k, pair in enumerate(open_pairs.pairs)}
        current = set(pairs)
        missing = np.array([p not in current for p in open_pairs.pairs], bool)
        ended = np.broadcast_to(missing, open_pairs.state.shape)
        self._close(layout, open_pairs, ended, self._times[-1], False)
        existed = np.array([p in place for p in pairs], bool)
        if not open_pairs.pairs:  # no previous pairs to realign
            rows = len(layout.rows)
            zeros = np.zeros((rows, len(pairs)))
            none = zeros.astype(np.int64)
            return _OpenPairs(pairs, none.astype(np.int8), none, zeros, zeros, zeros), existed
        return open_pairs.take([place.get(p, 0) for p in pairs], pairs), existed

    def _close(
        self,
        layout: _LayoutRows,
        open_pairs: _OpenPairs,
        ended: NDArray[np.bool_],
        at: StepTime,
        open_end: bool,
    ) -> None:
        for line, k in zip(*(n.tolist() for n in np.nonzero(ended)), strict=True):
            _, turned, names, _, _ = layout.rows[line]
            pair = open_pairs.pairs[k][::-1] if turned else open_pairs.pairs[k]
            stretch = interval_columns(self._times[int(open_pairs.begin[line, k])], at, open_end)
            numbers = (
                round(float(open_pairs.confidence[line, k]), 6),
                _number(open_pairs.least[line, k]),
                _number(open_pairs.most[line, k]),
            )
            for name, truth in _names_of_state(names, int(open_pairs.state[line, k])):
                self._rows.append((name, *pair, truth, *stretch, *numbers))


def _names_of_state(names: tuple[str, ...], code: int) -> Iterator[tuple[str, str]]:
    """The relations of a state code: the one that holds, or all that are unknown."""
    if code == UNKNOWN_CODE:
        yield from ((name, Truth.UNKNOWN.value) for name in names if name)
    elif names[code]:
        yield names[code], Truth.TRUE.value


def _number(value: np.float64) -> float | None:
    return None if np.isnan(value) else round(float(value), 6)


def _is_binary(r: Relation) -> bool:
    """Whether a plug-in's relation is recorded: only relations of two objects are."""
    return len(r.objects) == 2 and r.truth is not Truth.FALSE


def _pair(r: Relation) -> Pair:
    return r.objects[0], r.objects[1]


def _truth_and_value(r: Relation) -> tuple[str, float]:
    return r.truth.value, round(0.0 if r.truth is Truth.UNKNOWN else r.confidence, 2)
