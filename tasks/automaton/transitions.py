"""How likely each place in a task leads to each other in some seconds, worked out when needed.

A place is a node of the automaton with the phase of each step under way (`Place`). What leads from
one to the next is the product of the phases' changes, and then the choice of a way on, or of none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

from visup.tasks.automaton.automaton import END, NEW, Automaton, Way
from visup.tasks.automaton.derivatives import Step
from visup.tasks.automaton.stage_hmm import WAITING, Kind, Process

MOST_SPANS = 64  # so many different times between frames are remembered
SPAN_DIGITS = 4  # times between frames are told apart to a tenth of a millisecond


class Place(NamedTuple):
    """Where a task may be: a node, and the phase of each of its steps."""

    node: int
    phases: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Passage:
    """One way from a place to the next.

    Attributes:
        to: Where it leads.
        chance: Its probability.
        left: The steps that are over by it.
    """

    to: Place
    chance: float
    left: tuple[Step, ...] = ()


Asked = tuple[tuple[tuple[str, tuple[str, ...]], Kind], ...]
"""What is to be seen at a place: each action with its actors, and how it stands."""


class Transitions:
    """Passages between the places of a task.

    Args:
        automaton: The states of its course.
        process: The probabilities.
    """

    def __init__(self, automaton: Automaton, process: Process) -> None:
        self.automaton = automaton
        self.process = process
        self._passages: dict[float, dict[Place, tuple[Passage, ...]]] = {}
        self._asked: dict[Place, Asked] = {}

    def begin(self) -> Iterator[tuple[Place, float]]:
        """Places in which the task may begin, each with its probability."""
        for node, share in self.automaton.start:
            yield Place(node, (WAITING,) * len(self.automaton.steps(node))), share

    def after(self, dt: float) -> dict[Place, tuple[Passage, ...]]:
        """The passages that are known for a time between frames; `passages` adds to them."""
        span = round(dt, SPAN_DIGITS)
        if span not in self._passages:
            if len(self._passages) >= MOST_SPANS:
                self._passages.clear()
            self._passages[span] = {}
        return self._passages[span]

    def passages(self, place: Place, dt: float) -> tuple[Passage, ...]:
        """All passages from a place in `dt` seconds; their probabilities sum to 1."""
        known = self.after(dt)
        if place not in known:
            known[place] = _merged(self._passed(place, round(dt, SPAN_DIGITS)))
        return known[place]

    def asked(self, place: Place) -> Asked:
        """What is to be seen at a place; an action that several steps ask for is told once."""
        if place not in self._asked:
            found: dict[tuple[str, tuple[str, ...]], Kind] = {}
            for step, phase in zip(self.automaton.steps(place.node), place.phases, strict=True):
                kind, key = self.process.kind(step, phase), (step.action, step.actors)
                found[key] = min(kind, found.get(key, kind), key=CLEAREST.index)
            told = tuple((k, kind) for k, kind in found.items() if kind is not Kind.WAITING)
            self._asked[place] = told
        return self._asked[place]

    def _passed(self, place: Place, dt: float) -> Iterator[Passage]:
        steps = self.automaton.steps(place.node)
        changes = [
            tuple(self.process.changes(s, p, dt)) for s, p in zip(steps, place.phases, strict=True)
        ]
        for changed in product(*changes):
            phases = tuple(phase for phase, _ in changed)
            chance = math.prod(p for _, p in changed)
            yield from self._gone_on(Place(place.node, phases), chance, dt)

    def _gone_on(self, place: Place, chance: float, dt: float) -> Iterator[Passage]:
        """A place where phases have changed already, and the ways on from it."""
        node, phases = place
        ways = self.automaton.ways(node)
        rates = [self.rate(node, phases, w) for w in ways]
        total = sum(rates)
        gone = -math.expm1(-total * dt)
        yield Passage(place, chance * (1.0 - gone))
        if gone > 0.0:
            steps = self.automaton.steps(node)
            for way, rate in zip(ways, rates, strict=True):
                if rate > 0.0:
                    left = tuple(steps[i] for i in way.left)
                    yield Passage(_target(way, phases), chance * gone * rate / total, left)

    def rate(self, node: int, phases: tuple[int, ...], way: Way) -> float:
        """Rate of a way on: as slow as the slowest step that it leaves."""
        steps = self.automaton.steps(node)
        return way.share * min(self.process.leaving(steps[i], phases[i]) for i in way.left)


CLEAREST = (Kind.GOING, Kind.FAILING, Kind.LOST, Kind.WAITING)


def _target(way: Way, phases: tuple[int, ...]) -> Place:
    if way.target == END:
        return Place(END, ())
    return Place(way.target, tuple(WAITING if c == NEW else phases[c] for c in way.carried))


def _merged(passages: Iterator[Passage]) -> tuple[Passage, ...]:
    found: dict[tuple[Place, tuple[Step, ...]], float] = {}
    for passage in passages:
        if passage.chance > 0.0:
            key = (passage.to, passage.left)
            found[key] = found.get(key, 0.0) + passage.chance
    return tuple(Passage(to, chance, left) for (to, left), chance in found.items())
