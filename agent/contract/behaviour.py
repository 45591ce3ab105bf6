"""The contracts of what runs inside the cycle: behaviours perceive, reasoners reason."""

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

    A method `start(self)`, if there is one, is called once before the first run, in the process in
    which the behaviour runs: the place to open what cannot be sent to another process, such as a
    model, a socket or a device.
    """

    contract: Contract

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report about one frame.

        Args:
            frame: The frame; its image cannot be written to.
            observation: What behaviours before this one reported of the same frame;
                `observation.past` holds as many earlier frames as the contract's `history` asks for.
            directives: What cogitation asked for after the last step.

        Returns:
            Percepts of the kinds that the contract names.
        """
        ...


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a reasoner concludes.

    Attributes:
        mind: The mind after it.
        events: What happened.
        conditions: Reasons for alerts that hold now; an alert whose condition is not renewed is closed.
        directives: What is asked of behaviours.
    """

    mind: Mind
    events: tuple[Event, ...] = ()
    conditions: tuple[AlertCondition, ...] = ()
    directives: tuple[Directive, ...] = ()


Reasoner = Callable[[Mind, Observation], Outcome]
"""A pure function of the mind and of what was observed. It keeps nothing to itself: what it must
remember goes into the mind under its own `MemoryKey`, so that minds can be saved and restored."""


enable_display(Outcome)
