"""Operators on pieces: new pieces in, new pieces out, each moment once and in order.

A window is [t + low, t + high] around a moment t, with negative numbers for the past. It includes every piece
that it meets, so a piece counts from begin - high up to but excluding end - low.
 `since` and `until` over samples evaluate f at the samples between g and now. In dense time f must be true at
all moments between, including the rest of the piece in which g was true.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from math import inf
from typing import Any, Protocol

from visup.rules.dense_time.sweep import Aligned, Fold, Lane, Piece, Sweep, append
from visup.rules.monitoring import _interval_jit as on_intervals
from visup.rules.monitoring.intervals import FALSE, TRUE, UNKNOWN, Interval, Scalars

_ON = Scalars()
least, most = _ON.least, _ON.most


class Operator(Protocol):
    """One step of a program over pieces."""

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """Process new pieces of all operands, and return the resulting pieces."""

    def finish(self, end: float) -> list[Piece]:
        """Finish at `end`, and return the rest."""


class Pointwise:
    """A pointwise function.

    Args:
        count: Number of operands.
        function: Function of their values.
    """

    def __init__(self, count: int, function: Callable[..., Any]) -> None:
        self._aligned, self._function = Aligned(count), function

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `Operator`."""
        return [Piece(p.begin, p.end, self._function(*p.value)) for p in self._aligned.take(rows)]

    def finish(self, end: float) -> list[Piece]:
        """See `Operator`."""
        return []


class Swept(ABC):
    """Base of window operators: a sweep over lanes, and how far it may proceed.

    Args:
        count: Number of operands.
        high: How far it looks into the future, microseconds.
        samples: Whether pieces are samples, each of which counts separately.
    """

    lanes: Sequence[Lane]

    def __init__(self, count: int, high: float, samples: bool) -> None:
        self._aligned, self._high, self.merges = Aligned(count), max(high, 0.0), not samples
        self._known: float = -inf

    def lane(self, fold: Fold, nothing: Any) -> Lane:
        """A lane of this operator."""
        return Lane(fold, nothing, self.merges)

    def swept(self, lanes: Sequence[Lane], join: Callable[..., Any]) -> None:
        """Set the lanes of the sweep."""
        # For samples also the start of each, so that pieces stay samples.
        self._grid = None if self.merges else Lane(lambda old, new: new, None, merges=False)
        every = lanes if self._grid is None else (*lanes, self._grid)
        self._sweep = Sweep(every, lambda *v: join(*v[: len(lanes)]), self.merges)

    @abstractmethod
    def put(self, piece: Piece) -> None:
        """Put one piece into the lanes."""

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `Operator`."""
        for piece in self._aligned.take(rows):
            if self._sweep.at is None:
                self._sweep.at = piece.begin
            self.put(piece)
            if self._grid is not None:
                self._grid.push(piece.begin, piece.end, None)
            self._known = piece.end
        return self._sweep.until(self._known - self._high)

    def finish(self, end: float) -> list[Piece]:
        """See `Operator`."""
        return self._sweep.until(end)


class Window(Swept):
    """The minimum or maximum over [t + low, t + high].

    Args:
        kind: 'always' or 'once'.
        low: Microseconds.
        high: Microseconds.
        samples: See `Swept`.
    """

    def __init__(self, kind: str, low: float, high: float, samples: bool) -> None:
        super().__init__(1, high, samples)
        self._low, self._at = low, high
        fold, nothing = (least, TRUE) if kind == "always" else (most, FALSE)
        self._lane = self.lane(fold, nothing)
        self.swept((self._lane,), lambda value: value)

    def put(self, piece: Piece) -> None:
        """See `Swept`."""
        self._lane.push(piece.begin - self._at, piece.end - self._low, piece.value[0])


class SinceWindow(Swept):
    """`f since[a .. b] g`; b may be infinite.

    Args:
        low: a, microseconds.
        high: b.
        samples: See `Swept`.
    """

    def __init__(self, low: float, high: float, samples: bool) -> None:
        super().__init__(2, 0.0, samples)
        self._low, self._far, self._samples = low, high, samples
        self._window = self.lane(_since, (FALSE, TRUE))
        self._after = self.lane(least, TRUE)
        self._now = self.lane(most, FALSE)
        self.swept((self._window, self._after, self._now), self._joined)

    def _joined(self, window: Any, after: Interval, now: Interval) -> Interval:
        return most(least(window[0], after), now)

    def put(self, piece: Piece) -> None:
        """See `Swept`."""
        (f, g), begin, end = piece.value, piece.begin, piece.end
        found = g if self._samples else least(f, g)
        self._window.push(begin + self._low, end + self._far, (found, f))
        if self._low:
            self._after.push(begin, begin + self._low, f)
        else:
            self._now.push(begin, end, g)


class UntilWindow(Swept):
    """`f until[a .. b] g`.

    Args:
        low: a, microseconds.
        high: b.
        samples: See `Swept`.
    """

    def __init__(self, low: float, high: float, samples: bool) -> None:
        super().__init__(2, high, samples)
        self._low, self._far, self._samples = low, high, samples
        self._window = self.lane(_until, (FALSE, TRUE))
        self._before = self.lane(least, TRUE)
        self.swept((self._window, self._before), lambda window, before: least(window[0], before))

    def put(self, piece: Piece) -> None:
        """See `Swept`."""
        (f, g), begin, end = piece.value, piece.begin, piece.end
        self._window.push(begin - self._far, end - self._low, (g, f))
        if self._low:
            enter = end - self._low if self._samples else begin - self._low
            self._before.push(enter, end, f)


class SoFar:
    """`always`, `once` and `since` without a window: from the first sample on; before it unknown.

    Args:
        inner: The operator with an infinite window.
    """

    def __init__(self, inner: Swept) -> None:
        self._inner, self._begin = inner, inf

    def begins(self, moment: float) -> None:
        """Set the time of the first sample, microseconds."""
        self._begin = moment

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `Operator`."""
        found: list[Piece] = []
        cut = [[_later(p, self._begin) for p in row if p.end > self._begin] for row in rows]
        for p in rows[0]:
            if p.begin < self._begin:
                append(found, Piece(p.begin, min(p.end, self._begin), UNKNOWN))
        return found + self._inner.take(cut)

    def finish(self, end: float) -> list[Piece]:
        """See `Operator`."""
        return self._inner.finish(end)


class Latch:
    """A comparison with hysteresis: the second threshold applies while it is true."""

    def __init__(self) -> None:
        self._aligned, self._entered = Aligned(2), False

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `Operator`."""
        found = []
        for piece in self._aligned.take(rows):
            enter, leave = piece.value
            value, self._entered = _latched(enter, leave, self._entered)
            found.append(Piece(piece.begin, piece.end, value))
        return found

    def finish(self, end: float) -> list[Piece]:
        """See `Operator`."""
        return []


class PieceNote:
    """`let x be q at f`: the value of q when f was last true."""

    def __init__(self) -> None:
        self._aligned, self._kept = Aligned(2), UNKNOWN

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `Operator`."""
        found = []
        for piece in self._aligned.take(rows):
            value, at = piece.value
            self._kept = value if at[0] > 0 else self._kept
            found.append(Piece(piece.begin, piece.end, self._kept))
        return found

    def finish(self, end: float) -> list[Piece]:
        """See `Operator`."""
        return []


class PieceHold:
    """`last(f, 0.5 s)`: the last known value, while it is no older.

    Args:
        age: Greatest age, microseconds.
    """

    def __init__(self, age: float) -> None:
        self._age, self._kept, self._until = age, UNKNOWN, -inf

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `Operator`."""
        found: list[Piece] = []
        for piece in rows[0]:
            if piece.value != UNKNOWN:
                self._kept, self._until = piece.value, piece.end + self._age
                append(found, piece)
                continue
            middle = min(max(self._until, piece.begin), piece.end)
            if middle > piece.begin:
                append(found, Piece(piece.begin, middle, self._kept))
            if middle < piece.end:
                append(found, Piece(middle, piece.end, UNKNOWN))
        return found

    def finish(self, end: float) -> list[Piece]:
        """See `Operator`."""
        return []


class PreviousPiece:
    """`previous f`, where pieces are samples."""

    def __init__(self) -> None:
        self._before: Interval | None = None

    def take(self, rows: Sequence[list[Piece]]) -> list[Piece]:
        """See `Operator`."""
        found = []
        for piece in rows[0]:
            value = UNKNOWN if self._before is None else self._before
            found.append(Piece(piece.begin, piece.end, value))
            self._before = piece.value
        return found

    def finish(self, end: float) -> list[Piece]:
        """See `Operator`."""
        return []


def _later(piece: Piece, begin: float) -> Piece:
    return Piece(max(piece.begin, begin), piece.end, piece.value)


def _since(older: Any, newer: Any) -> Any:
    return most(newer[0], least(older[0], newer[1])), least(older[1], newer[1])


def _until(older: Any, newer: Any) -> Any:
    return most(older[0], least(older[1], newer[0])), least(older[1], newer[1])


_latched: Callable[..., tuple[Interval, bool]] = on_intervals.latched.py_func  # type: ignore[attr-defined]
