"""The contracts of what runs inside the cycle: behaviours perceive, thinkers reason."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from visup.agent.mind import Mind
from visup.agent.records import Concern, Directive, Event, Frame, Observation, Percept


@dataclass(frozen=True, slots=True)
class Contract:
    """What a behaviour declares of itself.

    Attributes:
        name: Its name, unique within an agent.
        gives: Kinds of percept that it reports.
        needs: Kinds of percept that must be there before it runs in a step.
        every_s: Least time between two runs, seconds; 0 for every frame.
    """

    name: str
    gives: tuple[str, ...]
    needs: tuple[str, ...] = ()
    every_s: float = 0.0


@runtime_checkable
class Behaviour(Protocol):
    """A perception routine: frames in, percepts out. May keep state between frames."""

    contract: Contract

    def perceive(
        self, frame: Frame, seen: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report about one frame.

        Args:
            frame: The frame; its image must not be written to.
            seen: What behaviours before this one reported of the same frame.
            directives: What cogitation asked for after the last step.

        Returns:
            Percepts of the kinds that the contract names.
        """
        ...


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a thinker concludes.

    Attributes:
        mind: The mind after it.
        events: What happened.
        concerns: Reasons for alerts that hold now; an alert whose concern is not renewed is closed.
        directives: What is asked of behaviours.
    """

    mind: Mind
    events: tuple[Event, ...] = ()
    concerns: tuple[Concern, ...] = ()
    directives: tuple[Directive, ...] = ()


Thinker = Callable[[Mind, Observation], Outcome]
"""A pure function of the mind and of what was observed. It keeps nothing to itself: what it must
remember goes into `Mind.memory` under its own name, so that minds can be kept and restored."""
