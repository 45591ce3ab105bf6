"""Windows that slide over samples at a constant cost, in values that are never changed.

What a window holds stands in two linked lists of tuples, the older part with the fold of all that
follows each, the newer part with the fold of all of it ("two stacks"; Tangwongsan, Hirzel and
Schneider, "General incremental sliding-window aggregation", 2015). A sample is pushed once, folded
anew once when the older part has run out, and dropped once: three steps whatever the window. Since
no cell is ever changed, the state before a step stays good after it, and shares all but a few
cells with the state after it: snapshots of a mind cost little, and one may go on from any of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

Fold = Callable[[Any, Any], Any]
"""Joins what is older with what is newer; associative."""
Change = Callable[[Any], Any]
Cell = tuple[Any, ...] | None
"""A linked list: (time, value, rest) or, of the older part, (time, value, fold, rest)."""


class Queue(NamedTuple):
    """First in, first out; immutable.

    Attributes:
        front: The older ones, oldest first.
        back: The newer ones, newest first.
    """

    front: Cell = None
    back: Cell = None

    def push(self, time: int, value: Any) -> Queue:
        """The same queue with one more at its end."""
        return Queue(self.front, (time, value, self.back))

    def advance(self, limit: int, current: Any) -> tuple[Queue, Any]:
        """Take out all that came up to a moment.

        Args:
            limit: The moment; microseconds.
            current: What is returned when none did.

        Returns:
            The rest, and the (time, value) of the last one that was taken out.
        """
        front, back = self
        while True:
            if front is None:
                while back is not None:
                    front, back = (back[0], back[1], front), back[2]
            if front is None or front[0] > limit:
                return Queue(front, back), current
            current, front = (front[0], front[1]), front[2]

    def changed(self, change: Callable[[int, Any], Any]) -> Queue:
        """The same queue with every value changed by its time and value."""
        queue = Queue()
        for time, value in self._cells():
            queue = queue.push(time, change(time, value))
        return queue

    def times(self) -> list[int]:
        """When each came, oldest first; microseconds."""
        return [time for time, _ in self._cells()]

    def _cells(self) -> list[tuple[int, Any]]:
        cells = []
        for part in self:
            while part is not None:
                cells.append((part[0], part[1]))
                part = part[2]
        return sorted(cells, key=lambda c: c[0])


class SlidingState(NamedTuple):
    """The state of a window.

    Attributes:
        then: Time of the last sample, microseconds.
        current: Value of the piece of time in which the window begins.
        front: Older samples: (time, value, fold of it and all newer ones of the front, rest).
        back: Newer samples, newest first: (time, value, rest).
        fold: Fold of all of the back, or None when there are none.
        waiting: Samples that are too new for a window that ends before now.
        head: Fold of the current value and all of the front.
    """

    then: int
    current: Any
    front: Cell
    back: Cell
    fold: Any
    waiting: Queue
    head: Any


def initial(now: int, value: Any) -> SlidingState:
    """The state before any sample, with what is known of the time before."""
    return SlidingState(now, value, None, None, None, Queue(), value)


def slide(
    state: SlidingState, now: int, value: Any, low: int, high: int, fold: Fold
) -> tuple[SlidingState, Any]:
    """Take in one sample.

    Args:
        state: The state before.
        now: Time of the sample, microseconds, later than all before.
        value: Its value, which stands from now to the next sample.
        low: How long before now the window ends, microseconds.
        high: How long before now it begins.
        fold: Joins values.

    Returns:
        The state after, and the fold of all values that stood at any time of the window.
    """
    _, current, front, back, newer, waiting, head = state
    if low:
        waiting = waiting.push(now, value)
        while True:
            waiting, due = _next(waiting, now - low)
            if due is None:
                break
            newer = due[1] if back is None else fold(newer, due[1])
            back = (due[0], due[1], back)
    else:
        newer = value if back is None else fold(newer, value)
        back = (now, value, back)
    limit = now - high
    while True:
        if front is None:
            if back is None:
                break
            front, back, newer = _turned(back, fold), None, None
            head = fold(current, front[2])
        if front[0] > limit:
            break
        # What was folded of it and all that follow it is the fold of all that is left now.
        _, current, head, front = front
    result = head if back is None else fold(head, newer)
    return SlidingState(now, current, front, back, newer, waiting, head), result


def later(state: SlidingState, fold: Fold, nothing: Any) -> Any:
    """The fold of what began after the window did, that is, without what stood where it begins.

    Args:
        state: After a sample.
        fold: Joins values.
        nothing: What it is when nothing began.
    """
    front = None if state.front is None else state.front[2]
    if state.back is None:
        return nothing if state.front is None else front
    return state.fold if state.front is None else fold(front, state.fold)


def _next(queue: Queue, limit: int) -> tuple[Queue, tuple[int, Any] | None]:
    """The oldest one, taken out, when it came up to a moment."""
    front, back = queue
    if front is None:
        while back is not None:
            front, back = (back[0], back[1], front), back[2]
    if front is None or front[0] > limit:
        return Queue(front, back), None
    return Queue(front[2], back), (front[0], front[1])


def _turned(back: Cell, fold: Fold) -> tuple[Any, ...]:
    """The back as a front."""
    assert back is not None
    time, value, back = back
    front: tuple[Any, ...] = (time, value, value, None)
    while back is not None:
        time, value, back = back
        front = (time, value, fold(value, front[2]), front)
    return front


def mapped(state: SlidingState, change: Change) -> SlidingState:
    """The same state with every value changed, as when objects come and go."""
    front: Cell = None
    for time, value, folded in reversed(_listed(state.front, 3)):
        front = (time, change(value), change(folded), front)
    back: Cell = None
    for time, value in reversed(_listed(state.back, 2)):
        back = (time, change(value), back)
    return SlidingState(
        state.then,
        change(state.current),
        front,
        back,
        None if back is None else change(state.fold),
        state.waiting.changed(lambda _, value: change(value)),
        change(state.head),
    )


def _listed(cell: Cell, width: int) -> list[tuple[Any, ...]]:
    found = []
    while cell is not None:
        found.append(cell[:width])
        cell = cell[width]
    return found
