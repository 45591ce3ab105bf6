"""A proxy for a behaviour that runs in its own process and is not imported here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from visup.agent.contract.contract import Contract
from visup.agent.model.errors import BehaviourError
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Observation, Percept


@dataclass(slots=True)
class IsolatedBehaviour:
    """A behaviour whose code never runs in this process; give it to an agent like any other.

    Attributes:
        contract: Its contract, as reported by its process.
        where: `FILE.py`, or `package.module:Class`.
        settings: Its settings.
    """

    contract: Contract
    where: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Refuse: it runs only in its own process.

        Raises:
            BehaviourError: Always.
        """
        raise BehaviourError(
            f"'{self.contract.name}' can only run in a process of its own", where=self.where
        )
