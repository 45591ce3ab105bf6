"""The interfaces of the parts of the cycle: behaviours perceive, reasoners reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from visup.agent.contract.contract import Contract
from visup.agent.model.display import enable_display
from visup.agent.model.events import AlertCondition, Directive, Event
from visup.agent.model.mind import Mind
from visup.agent.model.records import Frame, Observation, Percept

__all__ = ["Behaviour", "Contract", "Outcome", "Reasoner"]


@runtime_checkable
class Behaviour(Protocol):
    """A perception routine: frames in, percepts out. May keep state between frames.

    A method `start(self)`, if it exists, is called once before the first run, in the process in
    which the behaviour runs: the place to open resources that cannot be sent to another process, such as a
    model, a socket or a device.
    """

    contract: Contract

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report about one frame.

        Args:
            frame: The frame; its image cannot be written to.
            observation: What earlier behaviours reported about the same frame;
                `observation.past` holds as many past frames as the contract's `history` requests.
            directives: Requests from reasoning after the last step.

        Returns:
            Percepts of the kinds in the contract's `gives`.
        """
        ...


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a reasoner concludes.

    Attributes:
        mind: The mind after this reasoner.
        events: What happened.
        conditions: Reasons for alerts that hold now; an alert whose condition is not renewed is closed.
        directives: Requests to behaviours.
    """

    mind: Mind
    events: tuple[Event, ...] = ()
    conditions: tuple[AlertCondition, ...] = ()
    directives: tuple[Directive, ...] = ()


Reasoner = Callable[[Mind, Observation], Outcome]
"""A pure function of the mind and the observation. It has no state of its own: what it must
remember is stored in the mind under its own `MemoryKey`, so that minds can be saved and restored."""


enable_display(Outcome)
