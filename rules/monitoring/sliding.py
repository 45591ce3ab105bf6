"""Sliding-window aggregation at constant cost per sample, with immutable states.

The content of a window is two linked lists of tuples, the older one with the fold of each element and all
that follow, the newer one with the fold of all of it ("two stacks"; Tangwongsan, Hirzel and Schneider,
"General incremental sliding-window aggregation", 2015). A sample is pushed once, refolded once when the older
list is exhausted, and dropped once: three steps whatever the window. Since no cell is ever modified, the
state before a step stays valid and shares all but a few cells with the state after it: snapshots are cheap,
and one may continue from any of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

Fold = Callable[[Any, Any], Any]
"""Combines an older with a newer value; associative."""
Change = Callable[[Any], Any]
Cell = tuple[Any, ...] | None
"""A linked list: (time, value, rest) or, in the older part, (time, value, fold, rest)."""


class Queue(NamedTuple):
    """An immutable first-in, first-out queue.

    Attributes:
        front: The older ones, oldest first.
        back: The newer ones, newest first.
    """

    front: Cell = None
    back: Cell = None

    def push(self, time: int, value: Any) -> Queue:
        """The queue with an element appended."""
        return Queue(self.front, (time, value, self.back))

    def advance(self, limit: int, current: Any) -> tuple[Queue, Any]:
        """Remove all elements up to a moment.

        Args:
            limit: The moment; microseconds.
            current: Returned when there is none.

        Returns:
            The rest, and the (time, value) of the last removed element.
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
        """The queue with a function of time and value applied to every value."""
        queue = Queue()
        for time, value in self._cells():
            queue = queue.push(time, change(time, value))
        return queue

    def times(self) -> list[int]:
        """Times of the elements, oldest first; microseconds."""
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
        current: Value of the piece of time that contains the start of the window.
        front: Older samples: (time, value, fold from it to the end of the front, rest).
        back: Newer samples, newest first: (time, value, rest).
        fold: Fold of the back, or None if empty.
        waiting: Samples too new for a window that ends before now.
        head: Fold of the current value and the front.
    """

    then: int
    current: Any
    front: Cell
    back: Cell
    fold: Any
    waiting: Queue
    head: Any


def initial(now: int, value: Any) -> SlidingState:
    """The state before any sample, with the value of the time before."""
    return SlidingState(now, value, None, None, None, Queue(), value)


def slide(
    state: SlidingState, now: int, value: Any, low: int, high: int, fold: Fold
) -> tuple[SlidingState, Any]:
    """Process one sample.

    Args:
        state: The state before.
        now: Time of the sample, microseconds, later than all before.
        value: Its value, valid from now to the next sample.
        low: How long before now the window ends, microseconds.
        high: How long before now it begins.
        fold: The fold.

    Returns:
        The state after, and the fold of all values valid at some time of the window.
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
        # The fold stored with it covers exactly the remaining front.
        _, current, head, front = front
    result = head if back is None else fold(head, newer)
    return SlidingState(now, current, front, back, newer, waiting, head), result


def later(state: SlidingState, fold: Fold, nothing: Any) -> Any:
    """The fold of the values that began inside the window, without the one valid at its start.

    Args:
        state: The state after a sample.
        fold: The fold.
        nothing: The result when no value began.
    """
    front = None if state.front is None else state.front[2]
    if state.back is None:
        return nothing if state.front is None else front
    return state.fold if state.front is None else fold(front, state.fold)


def _next(queue: Queue, limit: int) -> tuple[Queue, tuple[int, Any] | None]:
    """Remove the oldest element if it is not after a moment."""
    front, back = queue
    if front is None:
        while back is not None:
            front, back = (back[0], back[1], front), back[2]
    if front is None or front[0] > limit:
        return Queue(front, back), None
    return Queue(front[2], back), (front[0], front[1])


def _turned(back: Cell, fold: Fold) -> tuple[Any, ...]:
    """The back converted to a front."""
    assert back is not None
    time, value, back = back
    front: tuple[Any, ...] = (time, value, value, None)
    while back is not None:
        time, value, back = back
        front = (time, value, fold(value, front[2]), front)
    return front


def mapped(state: SlidingState, change: Change) -> SlidingState:
    """The state with a function applied to every value, as when objects come and go."""
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
