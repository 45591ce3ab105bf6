"""States of operators, and their re-indexing when objects come and go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from visup.rules.monitoring.intervals import Interval, IntervalArray
from visup.rules.monitoring.operators import (
    BooleanWindow,
    PointOperator,
    Unbounded,
    WindowOperator,
)
from visup.rules.monitoring.samples import SAMPLE_HOLD, Update
from visup.rules.monitoring.vm import Floats


class States(NamedTuple):
    """The states of a program's operators; immutable, shared where unchanged.

    Attributes:
        then: Microseconds of the last sample, or None before the first.
        moments: States of point operators, concatenated.
        windows: States of window operators, one each; None before the first sample.
    """

    then: int | None
    moments: Floats
    windows: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class PointSlot:
    """The position of a point operator's state.

    Attributes:
        operator: The operator.
        axes: Number of axes of its objects.
        begin: Index of its first number.
        fills: Initial value of each part, which has one number per binding of objects.
    """

    operator: PointOperator
    axes: int
    begin: int
    fills: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class WindowSlot:
    """A window operator.

    Attributes:
        operator: The operator.
        step: Its update function.
        axes: Number of axes of its objects.
        reads: Starts of its operands' intervals.
        place: Start of its own intervals.
        cells: Number of intervals of each.
    """

    operator: WindowOperator
    step: Update
    axes: int
    reads: tuple[int, ...]
    place: int
    cells: int

    def update(self, state: Any, now: int, arena: Floats) -> Any:
        """The state after a sample; writes the result to the arena."""
        at, size = self.place, 2 * self.cells
        # Copied, since the arena is overwritten.
        parts = [arena[r : r + size].reshape(2, -1).copy() for r in self.reads]
        state, value = self.step(state, now, *parts)
        arena[at : at + size].reshape(2, -1)[:] = value
        return state


@dataclass(frozen=True, slots=True)
class StateLayout:
    """The layout of the states of a program's operators for a number of objects.

    Attributes:
        n: Number of objects.
        moments: The point operators.
        windows: The window operators, in the order of their states.
    """

    n: int
    moments: tuple[PointSlot, ...]
    windows: tuple[WindowSlot, ...]

    def fresh(self) -> States:
        """The states before the first sample."""
        moments = [np.repeat(m.fills, self.n**m.axes) for m in self.moments]
        return States(None, np.concatenate([np.zeros(0), *moments]), (None,) * len(self.windows))

    def silenced(self, moments: Floats, end: int) -> Floats:
        """The states after an unknown sample.

        Args:
            moments: The states before.
            end: Its time, microseconds.
        """
        moments = moments.copy()
        for m in self.moments:
            width = self.n**m.axes
            first = moments[m.begin : m.begin + width]
            second = moments[m.begin + width : m.begin + 2 * width]
            if isinstance(m.operator, BooleanWindow):
                first[:] = np.inf
                second[second == np.inf] = end
            elif isinstance(m.operator, Unbounded):
                if m.operator.kind != "once":
                    first[:] = -np.inf
                if m.operator.kind != "always":
                    second[:] = np.inf
        return moments

    def rerowed(self, states: States, new: StateLayout, rows: NDArray[np.intp], now: int) -> States:
        """The states re-indexed for other objects.

        Args:
            states: States for the objects of this layout.
            new: Layout for the other objects.
            rows: Former index of each object, or -1 for new ones.
            now: Microseconds of the sample at which they change.
        """
        then, moments, windows = states
        if then is not None and now - then > SAMPLE_HOLD:
            # The gap does not belong to the observed past of new objects.
            moments, then = self.silenced(moments, then + SAMPLE_HOLD), now - SAMPLE_HOLD
        chosen = [_chosen(rows, self.n, axes) for axes in range(4)]
        after = new.fresh().moments
        for m, other in zip(self.moments, new.moments, strict=True):
            old, parts = self.n**m.axes, len(m.fills)
            table = moments[m.begin : m.begin + parts * old].reshape(parts, old)
            place = after[other.begin : other.begin + parts * new.n**m.axes].reshape(parts, -1)
            known = chosen[m.axes] >= 0
            place[:, known] = table[:, chosen[m.axes][known]]
        return States(
            then,
            after,
            tuple(
                s
                if s is None or not w.axes
                else w.operator.rows(s, _picker(chosen[w.axes], self.n**w.axes))
                for s, w in zip(windows, self.windows, strict=True)
            ),
        )


def _chosen(rows: NDArray[np.intp], count: int, axes: int) -> NDArray[np.intp]:
    """Former index of each binding of objects among those of `count` objects, or -1."""
    at = np.zeros((1,) * axes, dtype=np.intp)
    fresh = np.zeros((1,) * axes, dtype=bool)
    for axis in range(axes):
        along = rows.reshape(-1, *(1,) * (axes - axis - 1))
        at, fresh = at * count + np.maximum(along, 0), fresh | (along < 0)
    return np.where(fresh, -1, at).ravel()


def _picker(
    chosen: NDArray[np.intp], cells: int
) -> Callable[[IntervalArray, Interval], IntervalArray]:
    """A function that selects intervals of bindings, with initial values for new ones."""
    fresh = chosen < 0
    at = np.maximum(chosen, 0)

    def pick(value: IntervalArray, fill: Interval) -> IntervalArray:
        out = np.empty((2, len(chosen)))
        if cells:
            out[:] = np.broadcast_to(value, (2, cells))[:, at]
        out[:, fresh] = np.array(fill).reshape(2, 1)
        return out

    return pick
