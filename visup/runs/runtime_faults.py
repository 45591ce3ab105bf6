"""Faults of the agent's environment as percepts: the journal, a sink, a source that dropped.

As percepts they open alerts like anything else, are recorded, and recur when the run is replayed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from visup.agent import (
    AlertCondition,
    Contract,
    Directive,
    Frame,
    Mind,
    Observation,
    Outcome,
    Percept,
    Stateless,
)

RUNTIME_FAULT = "trouble"
FaultSource = Callable[[], Iterable[AlertCondition]]


class RuntimeFaults(Stateless):
    """A behaviour that collects the faults of other components before each step."""

    contract = Contract("runtime_faults", gives=(RUNTIME_FAULT,))

    def __init__(self) -> None:
        self._sources: list[FaultSource] = []

    def add_source(self, source: FaultSource) -> None:
        """Add a source."""
        self._sources.append(source)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One percept of kind 'trouble' for each present fault."""
        conditions = [condition for source in self._sources for condition in source()]
        return [Percept(RUNTIME_FAULT, c, frame.time, self.contract.name) for c in conditions]


def runtime_fault_reasoner(mind: Mind, observation: Observation) -> Outcome:
    """Make every runtime fault an alert condition."""
    return Outcome(mind, conditions=observation.of(RUNTIME_FAULT))
