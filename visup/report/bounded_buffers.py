"""Containers that summarise a whole run in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from visup.report.records import StateSpan

T = TypeVar("T")


@dataclass(slots=True)
class EvenSample(Generic[T]):
    """An evenly spaced selection of a stream of unknown length.

    When it is full, every other item is dropped and the sampling interval doubles, so that between half of
    `max_items` and `max_items` items are kept, however long the stream is.

    Attributes:
        max_items: Maximum number of items, at least 2.
    """

    max_items: int
    _stride: int = field(default=1, init=False)
    _count: int = field(default=0, init=False)
    _items: list[T] = field(default_factory=list, init=False)

    def offer(self, make: Callable[[], T]) -> None:
        """Count one more item of the stream; it is created only if it is kept."""
        if self._count % self._stride == 0:
            if len(self._items) >= self.max_items:
                self._items = self._items[::2]
                self._stride *= 2
            if self._count % self._stride == 0:
                self._items.append(make())
        self._count += 1

    def items(self) -> tuple[T, ...]:
        """The kept items, in order."""
        return tuple(self._items)


@dataclass(slots=True)
class SpanRecorder:
    """Converts values reported step by step into spans of time.

    Attributes:
        max_items: Maximum number of closed spans; later ones are dropped.
    """

    max_items: int
    _open: dict[tuple[str, ...], tuple[str, float]] = field(default_factory=dict, init=False)
    _closed: list[StateSpan] = field(default_factory=list, init=False)

    def record(self, time: float, values: Mapping[tuple[str, ...], str]) -> None:
        """Record the present values; a missing subject has no value.

        Args:
            time: Seconds.
            values: Subject -> value.
        """
        for subject, (value, start) in list(self._open.items()):
            if values.get(subject) != value:
                self._close(subject, value, start, time)
                del self._open[subject]
        for subject, value in values.items():
            self._open.setdefault(subject, (value, time))

    def spans(self, end: float) -> tuple[StateSpan, ...]:
        """All spans by subject and time; those still open end at `end`."""
        open_spans = [StateSpan(s, v, start, end) for s, (v, start) in self._open.items()]
        return tuple(sorted([*self._closed, *open_spans], key=lambda s: (s.subject, s.start)))

    def _close(self, subject: tuple[str, ...], value: str, start: float, end: float) -> None:
        if len(self._closed) < self.max_items:
            self._closed.append(StateSpan(subject, value, start, end))


@dataclass(slots=True)
class TopWeighted(Generic[T]):
    """The items of greatest weight; among equals the earlier ones.

    Attributes:
        max_items: Maximum number of items.
        weight: Weight of an item.
    """

    max_items: int
    weight: Callable[[T], int]
    _items: list[T] = field(default_factory=list, init=False)

    def would_keep(self, weight: int) -> bool:
        """Whether an item of this weight would be kept."""
        return len(self._items) < self.max_items or weight > min(map(self.weight, self._items))

    def add(self, item: T) -> None:
        """Add an item; if full, the lightest (the latest of these) is dropped."""
        self._items.append(item)
        if len(self._items) > self.max_items:
            lightest = min(map(self.weight, self._items))
            last = max(i for i, x in enumerate(self._items) if self.weight(x) == lightest)
            del self._items[last]

    def items(self) -> tuple[T, ...]:
        """The kept items in order of arrival."""
        return tuple(self._items)
