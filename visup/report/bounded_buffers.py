"""Containers that summarise a whole run in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from visup.report.records import StateSpan

T = TypeVar("T")


@dataclass(slots=True)
class Thinned(Generic[T]):
    """An evenly spaced selection of a stream of unknown length.

    When it is full, every other item is dropped and the sampling interval doubles, so that between half of
    `most` and `most` items are kept, however long the stream is.

    Attributes:
        most: Maximum number of items, at least 2.
    """

    most: int
    _stride: int = field(default=1, init=False)
    _count: int = field(default=0, init=False)
    _items: list[T] = field(default_factory=list, init=False)

    def offer(self, make: Callable[[], T]) -> None:
        """Count one more item of the stream; it is created only if it is kept."""
        if self._count % self._stride == 0:
            if len(self._items) >= self.most:
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
        most: Maximum number of closed spans; later ones are dropped.
    """

    most: int
    _open: dict[tuple[str, ...], tuple[str, float]] = field(default_factory=dict, init=False)
    _closed: list[StateSpan] = field(default_factory=list, init=False)

    def note(self, time: float, values: Mapping[tuple[str, ...], str]) -> None:
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
        still = [StateSpan(s, v, start, end) for s, (v, start) in self._open.items()]
        return tuple(sorted([*self._closed, *still], key=lambda s: (s.subject, s.start)))

    def _close(self, subject: tuple[str, ...], value: str, start: float, end: float) -> None:
        if len(self._closed) < self.most:
            self._closed.append(StateSpan(subject, value, start, end))


@dataclass(slots=True)
class Heaviest(Generic[T]):
    """The items of greatest weight; among equals the earlier ones.

    Attributes:
        most: Maximum number of items.
        weight: Weight of an item.
    """

    most: int
    weight: Callable[[T], int]
    _items: list[T] = field(default_factory=list, init=False)

    def has_room_for(self, weight: int) -> bool:
        """Whether an item of this weight would be kept."""
        return len(self._items) < self.most or weight > min(map(self.weight, self._items))

    def add(self, item: T) -> None:
        """Add an item; if full, the lightest (the latest of these) is dropped."""
        self._items.append(item)
        if len(self._items) > self.most:
            lightest = min(map(self.weight, self._items))
            last = max(i for i, x in enumerate(self._items) if self.weight(x) == lightest)
            del self._items[last]

    def items(self) -> tuple[T, ...]:
        """The kept items in order of arrival."""
        return tuple(self._items)
