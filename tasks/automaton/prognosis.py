"""What comes next in a task, and whether it can still end well, from where it is."""

from __future__ import annotations

import math
from collections.abc import Mapping

from visup.tasks.automaton.automaton import END, Automaton, Way
from visup.tasks.automaton.derivatives import Step
from visup.tasks.automaton.stage_hmm import WAITING, Process
from visup.tasks.automaton.transitions import Place

MOST_NODES = 1_000  # beyond so many nodes success is counted as none
SMALLEST = 1e-9  # ways less likely than this are not followed
SWEEPS = 500


class Foresight:
    """What the model expects of the rest of a task.

    The fate of each step, whether it is left at last or lost, is taken to be independent of how
    long the others take; where one step is under way at a time, that is exact.

    Args:
        automaton: The states of the course.
        process: The probabilities.
        most: So many nodes are looked at to tell success, breadth first.
    """

    def __init__(self, automaton: Automaton, process: Process, most: int = MOST_NODES) -> None:
        self._automaton = automaton
        self._most = most
        self._process = process
        self._hopes: dict[int, float] | None = None
        self._next: dict[int, Mapping[str, float]] = {}

    def success(self, place: Place) -> float:
        """Probability that the course reaches its end from a place.

        Of a task with more states than are looked at it is a lower bound: beyond them nothing is
        counted.
        """
        if place.node == END:
            return 1.0
        if self._hopes is None:
            self._hopes = self._solved()
        steps = self._automaton.steps(place.node)
        hope = self._hopes.get(place.node)
        if hope is None:
            # Come to only by following the task far: as from the state itself, looked at anew.
            hope = self._hoped(place.node, self._hopes)
        fates = (self._process.fate(s, p) for s, p in zip(steps, place.phases, strict=True))
        return hope * math.prod(fates)

    def next_stages(self, node: int) -> Mapping[str, float]:
        """For each stage the probability that it is the next to begin; the rest is for the end."""
        if node not in self._next:
            found: dict[str, float] = {}
            self._follow(node, {s.stage for s in self._automaton.steps(node)}, 1.0, found, 0)
            self._next[node] = found
        return self._next[node]

    def _follow(
        self, node: int, here: set[str], chance: float, found: dict[str, float], depth: int
    ) -> None:
        for way, share in self._shares(node):
            likely = chance * share
            if likely < SMALLEST or depth > 60:
                continue
            entered = [s.stage for s in begun_by(self._automaton, way)]
            fresh = dict.fromkeys(s for s in entered if s not in here)
            for stage in fresh:
                found[stage] = found.get(stage, 0.0) + likely
            if not fresh and way.target != END:
                self._follow(way.target, here, likely, found, depth + 1)

    def _shares(self, node: int) -> list[tuple[Way, float]]:
        """The ways on from a node, each with its share once its steps may be left."""
        ways = self._automaton.ways(node)
        total = sum(w.share for w in ways)
        return [(w, w.share / total) for w in ways]

    def _solved(self) -> dict[int, float]:
        """For each node the probability to reach the end, apart from the fates of its own steps."""
        nodes = self._automaton.explored(self._most)
        hopes = dict.fromkeys(nodes, 0.0)
        for _ in range(SWEEPS):
            change = 0.0
            for node in reversed(nodes):  # ends come last, so that most is settled in one sweep
                hope = self._hoped(node, hopes)
                change = max(change, abs(hope - hopes[node]))
                hopes[node] = hope
            if change < 1e-12:
                break
        return hopes

    def _hoped(self, node: int, hopes: Mapping[int, float]) -> float:
        return sum(share * self._after(way, hopes) for way, share in self._shares(node))

    def _after(self, way: Way, hopes: Mapping[int, float]) -> float:
        if way.target == END:
            return 1.0
        fates = (self._process.fate(s, WAITING) for s in begun_by(self._automaton, way))
        return hopes.get(way.target, 0.0) * math.prod(fates)


def begun_by(automaton: Automaton, way: Way) -> list[Step]:
    """The steps that begin by a way."""
    steps = automaton.steps(way.target)
    return [s for s, c in zip(steps, way.carried, strict=True) if c < 0]
