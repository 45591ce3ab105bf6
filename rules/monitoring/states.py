"""What operators remember of the objects of a sample, and of other ones when these come and go."""

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
    """What the operators of a program remember; never changed, shared where nothing changes.

    Attributes:
        then: Microseconds of the last sample, or None before the first.
        moments: Of those that keep but a moment, one after the other.
        windows: Of those that keep windows, one each; None before the first sample.
    """

    then: int | None
    moments: Floats
    windows: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class PointSlot:
    """Where the state of an operator stands that keeps but a moment.

    Attributes:
        operator: The operator.
        axes: How many axes its objects have.
        begin: Its first number.
        fills: What each of its parts, one number for each choice of objects, is before the first sample.
    """

    operator: PointOperator
    axes: int
    begin: int
    fills: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class WindowSlot:
    """An operator that keeps a window.

    Attributes:
        operator: The operator.
        step: How it takes in a sample.
        axes: How many axes its objects have.
        reads: Where the intervals of its parts begin.
        place: Where its own begin.
        cells: How many intervals each of these has.
    """

    operator: WindowOperator
    step: Update
    axes: int
    reads: tuple[int, ...]
    place: int
    cells: int

    def update(self, state: Any, now: int, arena: Floats) -> Any:
        """The state after a sample, whose intervals it writes."""
        at, size = self.place, 2 * self.cells
        # What is retained must not change when the arena does.
        parts = [arena[r : r + size].reshape(2, -1).copy() for r in self.reads]
        state, value = self.step(state, now, *parts)
        arena[at : at + size].reshape(2, -1)[:] = value
        return state


@dataclass(frozen=True, slots=True)
class StateLayout:
    """Where the states of a program's operators stand for a number of objects.

    Attributes:
        n: Number of objects.
        moments: What keeps but a moment.
        windows: What keeps windows, in the order of their states.
    """

    n: int
    moments: tuple[PointSlot, ...]
    windows: tuple[WindowSlot, ...]

    def fresh(self) -> States:
        """The states before the first sample."""
        moments = [np.repeat(m.fills, self.n**m.axes) for m in self.moments]
        return States(None, np.concatenate([np.zeros(0), *moments]), (None,) * len(self.windows))

    def silenced(self, moments: Floats, end: int) -> Floats:
        """The states after a sample of which nothing is known.

        Args:
            moments: The states before.
            end: Microseconds of it.
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
        """The states for other objects.

        Args:
            states: States for the objects of this one.
            new: Where the states of the other ones stand.
            rows: Where each of these stood before, or -1: nothing is known of its past.
            now: Microseconds of the sample at which they change.
        """
        then, moments, windows = states
        if then is not None and now - then > SAMPLE_HOLD:
            # The silence is not part of what was watched of those that are new.
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
    """Where each choice of objects stood before among those of `count` objects, or -1."""
    at = np.zeros((1,) * axes, dtype=np.intp)
    fresh = np.zeros((1,) * axes, dtype=bool)
    for axis in range(axes):
        along = rows.reshape(-1, *(1,) * (axes - axis - 1))
        at, fresh = at * count + np.maximum(along, 0), fresh | (along < 0)
    return np.where(fresh, -1, at).ravel()


def _picker(
    chosen: NDArray[np.intp], cells: int
) -> Callable[[IntervalArray, Interval], IntervalArray]:
    """Takes the intervals of some choices of objects, of the new ones what they are before all samples."""
    fresh = chosen < 0
    at = np.maximum(chosen, 0)

    def pick(value: IntervalArray, fill: Interval) -> IntervalArray:
        out = np.empty((2, len(chosen)))
        if cells:
            out[:] = np.broadcast_to(value, (2, cells))[:, at]
        out[:, fresh] = np.array(fill).reshape(2, 1)
        return out

    return pick
