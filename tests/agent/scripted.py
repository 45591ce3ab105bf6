"""Scripted behaviours, frames and reasoners for tests of the cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from visup.agent import (
    AlertCondition,
    Contract,
    Directive,
    Event,
    Frame,
    MemoryKey,
    Mind,
    Observation,
    Outcome,
    Percept,
    Severity,
)


def frames(count: int, fps: float = 10.0) -> Iterator[Frame]:
    for i in range(count):
        yield Frame(i, i / fps, np.full((4, 6, 3), i % 256, np.uint8))


class Scripted:
    """A behaviour that runs a function of the frame's index."""

    def __init__(
        self,
        name: str,
        gives: tuple[str, ...],
        says: Callable[[int], object] = lambda i: i,
        needs: tuple[str, ...] = (),
        every_s: float = 0.0,
    ) -> None:
        self.contract = Contract(name, gives, needs, every_s)
        self.says = says
        self.directives: list[tuple[Directive, ...]] = []

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        self.directives.append(tuple(directives))
        value = self.says(frame.index)
        return [Percept(self.contract.gives[0], value, frame.time, self.contract.name)]


COUNTING = MemoryKey("counting", 0)
EXPLODING = MemoryKey("exploding", -1)


def counting(mind: Mind, observation: Observation) -> Outcome:
    """Remembers how often it thought and tells an event each time."""
    count = mind.recall(COUNTING) + 1
    event = Event("counted", observation.time, observation.frame_index, f"I counted {count}.")
    return Outcome(mind.remember(COUNTING, count), (event,))


def alert_while(holds: Callable[[float], bool]) -> Callable[[Mind, Observation], Outcome]:
    """A reasoner with one concern while a predicate of time holds."""

    def think(mind: Mind, observation: Observation) -> Outcome:
        concern = AlertCondition("worry", (1,), Severity.WARNING, "This is a worry.", ("because",))
        return Outcome(mind, conditions=(concern,) if holds(observation.time) else ())

    return think


def exploding_at(index: int) -> Callable[[Mind, Observation], Outcome]:
    """A reasoner that raises at one frame, after having half-made a mind."""

    def think(mind: Mind, observation: Observation) -> Outcome:
        if observation.frame_index == index:
            raise RuntimeError("the fuse blew")
        return Outcome(mind.remember(EXPLODING, observation.frame_index))

    return think
