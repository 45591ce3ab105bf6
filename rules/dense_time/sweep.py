"""Pieces of time, and a sweep line over the active ones.

The fold of values that enter and leave in the same order is maintained by two stacks (Tangwongsan, Hirzel and
Schneider, "General incremental sliding-window aggregation", 2015), at constant cost per piece whatever the
window.

"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from math import inf
from typing import Any, NamedTuple

Fold = Callable[[Any, Any], Any]
"""Combines an older with a newer value; associative."""


class Piece(NamedTuple):
    """An interval of time with a constant value.

    Attributes:
        begin: Microseconds, or minus infinity.
        end: Microseconds, exclusive; or infinity.
        value: An interval, or the two end values of a straight line.
    """

    begin: float
    end: float
    value: Any


class FoldQueue:
    """A first-in, first-out queue with the fold of its content.

    Args:
        fold: Joins values.
    """

    def __init__(self, fold: Fold) -> None:
        self._fold = fold
        self._front: list[tuple[Any, Any]] = []  # (value, fold from it to the end of the front)
        self._back: list[Any] = []
        self._newer: Any = None

    def push(self, value: Any) -> None:
        """Append a value."""
        self._newer = self._fold(self._newer, value) if self._back else value
        self._back.append(value)

    def pop(self) -> None:
        """Remove the oldest value."""
        if not self._front:
            folded = None
            for value in reversed(self._back):
                folded = self._fold(value, folded) if self._front else value
                self._front.append((value, folded))
            self._back = []
        self._front.pop()

    def value(self, nothing: Any) -> Any:
        """The fold of all values, or `nothing` if empty."""
        if not self._front:
            return self._newer if self._back else nothing
        oldest = self._front[-1][1]
        return self._fold(oldest, self._newer) if self._back else oldest


class Lane:
    """Values that enter and leave in the same order.

    Args:
        fold: Joins values.
        nothing: Their fold when none is active.
        merges: Whether consecutive equal values may be merged.
    """

    def __init__(self, fold: Fold, nothing: Any, merges: bool = True) -> None:
        self._fold, self._nothing, self._merges = fold, nothing, merges
        self._pending: deque[tuple[float, float, Any]] = deque()
        self._leaving: deque[tuple[float, Any]] = deque()
        self._active = FoldQueue(fold)
        self._staying: Any = None  # fold of the values that never leave
        self._stays = False

    def push(self, enter: float, leave: float, value: Any) -> None:
        """Add a value, active from `enter` up to but excluding `leave`."""
        if leave <= enter:
            return
        if self._merges and self._pending and self._pending[-1][1:] == (enter, value):
            enter = self._pending.pop()[0]
        self._pending.append((enter, leave, value))

    def move(self, at: float) -> None:
        """Process all entries and exits up to a moment."""
        while self._pending and self._pending[0][0] <= at:
            _, leave, value = self._pending.popleft()
            if leave == inf and not self._leaving:
                self._staying = self._fold(self._staying, value) if self._stays else value
                self._stays = True
            elif self._merges and self._leaving and self._leaving[-1][1] == value:
                self._leaving[-1] = (leave, value)
            else:
                self._leaving.append((leave, value))
                self._active.push(value)
        while self._leaving and self._leaving[0][0] <= at:
            self._leaving.popleft()
            self._active.pop()

    def next(self) -> float:
        """Time of the next entry or exit."""
        enter = self._pending[0][0] if self._pending else inf
        return min(enter, self._leaving[0][0]) if self._leaving else enter

    def value(self) -> Any:
        """The fold of the active values."""
        if not self._stays:
            return self._active.value(self._nothing)
        if not self._leaving:
            return self._staying
        return self._fold(self._staying, self._active.value(None))


class Sweep:
    """Sweeps through time and returns pieces with the folds of active values.

    Args:
        lanes: The lanes.
        join: The value of a piece, from the folds of all lanes.
        merges: Whether adjacent pieces of equal value are merged.
    """

    def __init__(
        self, lanes: Sequence[Lane], join: Callable[..., Any], merges: bool = True
    ) -> None:
        self._lanes, self._join, self._merges = lanes, join, merges
        self.at: float | None = None

    def until(self, limit: float) -> list[Piece]:
        """The pieces from the end of the last ones up to a moment."""
        found: list[Piece] = []
        while self.at is not None and self.at < limit:
            for lane in self._lanes:
                lane.move(self.at)
            end = min(limit, *(lane.next() for lane in self._lanes))
            append(
                found,
                Piece(self.at, end, self._join(*(x.value() for x in self._lanes))),
                self._merges,
            )
            self.at = end
        return found


def append(pieces: list[Piece], piece: Piece, merges: bool = True) -> None:
    """Append a piece, or extend the last one if the value is equal."""
    if merges and pieces and pieces[-1].value == piece.value and pieces[-1].end == piece.begin:
        piece = Piece(pieces.pop().begin, piece.end, piece.value)
    pieces.append(piece)


class Aligned:
    """Aligns several rows of pieces to common boundaries.

    Args:
        count: How many rows.
    """

    def __init__(self, count: int) -> None:
        self._rows: tuple[deque[Piece], ...] = tuple(deque() for _ in range(count))

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """The common pieces up to where all rows are known; their values are tuples."""
        for row, new in zip(self._rows, rows, strict=True):
            row.extend(new)
        found = []
        while all(self._rows):
            begin = max(row[0].begin for row in self._rows)
            end = min(row[0].end for row in self._rows)
            found.append(Piece(begin, end, tuple(row[0].value for row in self._rows)))
            for row in self._rows:
                if row[0].end <= end:
                    row.popleft()
        return found
