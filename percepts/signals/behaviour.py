"""Signals as a behaviour: their values at the time of a frame, as one percept."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from visup.agent import Contract, Directive, Frame, Observation, Percept, Stateless

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
"""Names that rules can refer to."""

SIGNAL = "signal"
"""Kind of percept; its value maps names of signals to numbers, booleans or words."""

Value = float | bool | str


class SignalSource(Protocol):
    """A source of signals."""

    @property
    def names(self) -> frozenset[str]:
        """All signals that it may report; empty if unknown in advance."""

    def at(self, time: float) -> Mapping[str, Value]:
        """Values at a time, seconds of the video; unknown ones are left out."""


class SignalBehaviour(Stateless):
    """Reports all known signals with each frame.

    Args:
        sources: The sources; for the same name, the later source wins.
    """

    contract = Contract("signals", gives=(SIGNAL,))

    def __init__(self, sources: Sequence[SignalSource]) -> None:
        self._sources = tuple(sources)

    @property
    def names(self) -> frozenset[str]:
        """All signals that may be reported; empty if some source does not know."""
        if not all(s.names for s in self._sources):
            return frozenset()
        return frozenset[str]().union(*(s.names for s in self._sources))

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One percept with all current values."""
        known: dict[str, Value] = {}
        for source in self._sources:
            known.update(source.at(frame.time))
        yield Percept(SIGNAL, known, frame.time, self.contract.name)
