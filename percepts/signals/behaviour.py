"""What signals are at the time of a frame, as one percept."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from visup.agent import Contract, Directive, Frame, Observation, Percept, Stateless

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
"""What rules can write."""

SIGNAL = "signal"
"""Kind of percept; its value maps names of signals to numbers, truths or words."""

Value = float | bool | str


class SignalSource(Protocol):
    """Whoever knows signals."""

    @property
    def names(self) -> frozenset[str]:
        """All signals that it may report; empty if that is not known in advance."""

    def at(self, time: float) -> Mapping[str, Value]:
        """What is known at a time, seconds of the video; what is not known is left out."""


class SignalBehaviour(Stateless):
    """Reports all known signals with each frame.

    Args:
        sources: Whoever knows them; where two tell one name, the later source goes before.
    """

    contract = Contract("signals", gives=(SIGNAL,))

    def __init__(self, sources: Sequence[SignalSource]) -> None:
        self._sources = tuple(sources)

    @property
    def names(self) -> frozenset[str]:
        """All signals that may be reported; empty if some source cannot say."""
        if not all(s.names for s in self._sources):
            return frozenset()
        return frozenset[str]().union(*(s.names for s in self._sources))

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One percept with all that is known now."""
        known: dict[str, Value] = {}
        for source in self._sources:
            known.update(source.at(frame.time))
        yield Percept(SIGNAL, known, frame.time, self.contract.name)
