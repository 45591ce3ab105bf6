"""Stretches: run-length encoding of values over steps."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value", bound=Hashable)


@dataclass(frozen=True, slots=True)
class StepTime:
    """The time of a step.

    Attributes:
        number: Its index, from 0.
        frame: Number of its frame.
        time: Seconds.
    """

    number: int
    frame: int
    time: float


@dataclass(frozen=True, slots=True)
class ValueInterval(Generic[Key, Value]):
    """An interval in which a key had one value.

    Attributes:
        key: The key.
        value: The value.
        begin: First step with the value.
        end: First step without it; the last step of the run if `open`.
        open: Whether the run ended meanwhile.
    """

    key: Key
    value: Value
    begin: StepTime
    end: StepTime
    open: bool

    @property
    def columns(self) -> tuple[float, float, int, int, bool]:
        """Begin, end, first frame, number of steps, open: the columns of the tables of a lake."""
        return interval_columns(self.begin, self.end, self.open)


def interval_columns(
    begin: StepTime, end: StepTime, open_stretches: bool
) -> tuple[float, float, int, int, bool]:
    """Begin, end, first frame, number of steps, open: the columns of the tables of a lake."""
    return (
        begin.time,
        end.time,
        begin.frame,
        end.number - begin.number + open_stretches,
        open_stretches,
    )


@dataclass(slots=True)
class IntervalCollector(Generic[Key, Value]):
    """Collects values step by step into intervals.

    Attributes:
        closed: The finished intervals.
    """

    closed: list[ValueInterval[Key, Value]] = field(default_factory=list)
    _open: dict[Key, tuple[Value, StepTime]] = field(default_factory=dict)

    def add(self, at: StepTime, values: Mapping[Key, Value]) -> None:
        """Add the values of one step; a key that is missing has none."""
        for key, (value, begin) in list(self._open.items()):
            if values.get(key) != value:
                self.closed.append(ValueInterval(key, value, begin, at, False))
                del self._open[key]
        for key, value in values.items():
            if key not in self._open:
                self._open[key] = value, at

    def finish(self, last: StepTime) -> list[ValueInterval[Key, Value]]:
        """All intervals, the open ones last."""
        open_stretches = [
            ValueInterval(k, v, begin, last, True) for k, (v, begin) in self._open.items()
        ]
        return [*self.closed, *open_stretches]
