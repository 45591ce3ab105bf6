"""Stretches: from values step by step to how long each of them stood."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value", bound=Hashable)


@dataclass(frozen=True, slots=True)
class StepTime:
    """When a step was.

    Attributes:
        number: Its place among the steps, from 0.
        frame: Number of its frame.
        time: Seconds.
    """

    number: int
    frame: int
    time: float


@dataclass(frozen=True, slots=True)
class Stretch(Generic[Key, Value]):
    """A time in which something had one value.

    Attributes:
        key: What had it.
        value: The value.
        begin: First step at which it had it.
        end: First step at which it had it no more; the last step of the run, where `open`.
        open: Whether it still had it when the run ended.
    """

    key: Key
    value: Value
    begin: StepTime
    end: StepTime
    open: bool

    @property
    def columns(self) -> tuple[float, float, int, int, bool]:
        """Begin, end, first frame, number of steps, open: as they stand in the tables of a lake."""
        return stretch_columns(self.begin, self.end, self.open)


def stretch_columns(
    begin: StepTime, end: StepTime, still: bool
) -> tuple[float, float, int, int, bool]:
    """Begin, end, first frame, number of steps, open: as they stand in the tables of a lake."""
    return begin.time, end.time, begin.frame, end.number - begin.number + still, still


@dataclass(slots=True)
class Stretches(Generic[Key, Value]):
    """Takes values step by step and gives the stretches in which each stood.

    Attributes:
        closed: Those that are over.
    """

    closed: list[Stretch[Key, Value]] = field(default_factory=list)
    _open: dict[Key, tuple[Value, StepTime]] = field(default_factory=dict)

    def add(self, at: StepTime, values: Mapping[Key, Value]) -> None:
        """Take the values of one step; a key that is not among them has none."""
        for key, (value, begin) in list(self._open.items()):
            if values.get(key) != value:
                self.closed.append(Stretch(key, value, begin, at, False))
                del self._open[key]
        for key, value in values.items():
            if key not in self._open:
                self._open[key] = value, at

    def finish(self, last: StepTime) -> list[Stretch[Key, Value]]:
        """All stretches, those that are open at the last step last."""
        still = [Stretch(k, v, begin, last, True) for k, (v, begin) in self._open.items()]
        return [*self.closed, *still]
