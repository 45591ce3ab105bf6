"""Runs of the thinkers over observations, for tests."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from types import MappingProxyType

from visup.agent import Concern, Event, Mind, Observation, Thinker


@dataclass(frozen=True)
class Thought:
    mind: Mind
    events: tuple[Event, ...]
    concerns: tuple[Concern, ...]


def think(
    thinkers: Iterable[Thinker],
    observations: Iterable[Observation],
    actors: dict[str, tuple[str, ...]] | None = None,
) -> Iterator[Thought]:
    """What an agent concludes, step by step, from thinkers alone."""
    mind = Mind(actors=MappingProxyType(actors or {}))
    chain = tuple(thinkers)
    for seen in observations:
        mind = replace(
            mind, time=seen.time, frame_index=seen.frame_index, frame_size=seen.frame_size
        )
        events: tuple[Event, ...] = ()
        concerns: tuple[Concern, ...] = ()
        for thinker in chain:
            outcome = thinker(mind, seen)
            mind, events = outcome.mind, events + outcome.events
            concerns += outcome.concerns
        yield Thought(mind, events, concerns)
