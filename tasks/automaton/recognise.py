"""Recognition: where a task is, from verdicts on its actions that may be wrong or missing.

The forward algorithm (`forward.py`) over the places of a task (`transitions.py`), whose
probabilities the model gives (`process.py`). It is a probabilistic parser: the mass of what is
followed is the prefix probability of what was seen, the states of the automaton are the parser's
stacks, and equal ones are merged. Work per step is bounded by the number of places kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import log
from typing import NamedTuple

from visup.agent import Status
from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.backpointers import Revision, Trail, longer, revised
from visup.tasks.automaton.forward import Weighed, merged, settled
from visup.tasks.automaton.prognosis import Foresight
from visup.tasks.automaton.stage_hmm import DEFAULT_PROCESS, Kind, Process, Seen
from visup.tasks.automaton.transitions import Place, Transitions
from visup.tasks.grammar.nodes import Task

Key = tuple[str, tuple[str, ...]]
"""An action and its actors."""

STATUSES = {
    Kind.WAITING: Status.ACTIVE,
    Kind.GOING: Status.PROGRESSING,
    Kind.FAILING: Status.FAILING,
    Kind.LOST: Status.FAILED,
}


class Evidence(NamedTuple):
    """What is seen of an action between its actors, and how sure that is, 0 to 1."""

    seen: Seen
    confidence: float = 1.0


@dataclass(frozen=True, slots=True)
class Belief:
    """Where a task may be.

    Attributes:
        time: Seconds.
        places: Each with its probability and the best way to it.
        lost: How likely it is that the truth was dropped on the way: one minus the product of what
            was kept at each step, each judged by what had been seen until then.
        evidence: Logarithm of how likely all that was seen is, against seeing an idle scene.
        revised: What was taken back in the last step.
    """

    time: float
    places: Mapping[Place, Weighed[Trail | None]]
    lost: float = 0.0
    evidence: float = 0.0
    revised: tuple[Revision, ...] = field(default=())

    @property
    def best(self) -> Place:
        """The most likely place."""
        return max(self.places.items(), key=lambda item: item[1].mass)[0]

    @property
    def trail(self) -> Trail | None:
        """The best way to the most likely place."""
        return self.places[self.best].what


class Recogniser:
    """Follows one task.

    Args:
        task: The task, checked.
        process: The probabilities of the model.
        most: How many places are kept at most.
        least: Places with a smaller probability are dropped; 0 for the exact posterior.
    """

    def __init__(
        self,
        task: Task,
        process: Process = DEFAULT_PROCESS,
        most: int = 1_000,
        least: float = 1e-6,
    ) -> None:
        self.automaton = Automaton(task)
        self.process = process
        self.foresight = Foresight(self.automaton, process)
        self._transitions = Transitions(self.automaton, process)
        self._most, self._least = most, least

    def start(self, now: float = 0.0) -> Belief:
        """The belief before anything was seen."""
        nothing: Trail | None = None
        begun = self._transitions.begin()
        return Belief(now, merged((place, nothing, share, share) for place, share in begun))

    def step(self, belief: Belief, seen: Mapping[Key, Evidence], dt: float) -> Belief:
        """Take in what is seen.

        Args:
            belief: What was believed.
            seen: What is seen of actions; of those that are not in it nothing is.
            dt: Seconds since the belief; 0 for the first observation.

        Returns:
            The belief `dt` seconds later; the one given stays as it is.
        """
        now = belief.time + dt
        found = merged(self._grown(belief, dt, now))
        weighed = {p: self._weighed(p, w, seen) for p, w in found.items()}
        new = settled(weighed, self._most, self._least)
        lost = 1.0 - (1.0 - belief.lost) * (1.0 - new.dropped)
        evidence = belief.evidence + log(new.evidence)
        after = Belief(now, new.kept, lost, evidence)
        taken_back = revised(belief.trail, after.trail, now)
        return Belief(now, new.kept, lost, evidence, tuple(taken_back))

    def stages(self, belief: Belief) -> dict[tuple[str, Status], float]:
        """For each stage and status the probability that a step of it is under way and stands so.

        With steps under way at the same time they sum to more than 1. The end has no stage: it is
        told by an empty name, done.
        """
        found: dict[tuple[str, Status], float] = {}
        for place, weighed in belief.places.items():
            for told in self._told(place):
                found[told] = found.get(told, 0.0) + weighed.mass
        return found

    def most_likely(self, belief: Belief) -> tuple[str, Status]:
        """The most likely stage and status."""
        found = self.stages(belief)
        return max(found, key=lambda k: found[k])

    def ranking(self, belief: Belief) -> list[tuple[str, float]]:
        """Stages by the probability that they are under way, the likeliest first."""
        found: dict[str, float] = {}
        for place, weighed in belief.places.items():
            for stage in {stage for stage, _ in self._told(place)}:
                found[stage] = found.get(stage, 0.0) + weighed.mass
        return sorted(found.items(), key=lambda item: -item[1])

    def next_stages(self, belief: Belief) -> list[tuple[str, float]]:
        """Stages by the probability that they are the next to begin; the rest is for the end."""
        found: dict[str, float] = {}
        for place, weighed in belief.places.items():
            for stage, chance in self.foresight.next_stages(place.node).items():
                found[stage] = found.get(stage, 0.0) + weighed.mass * chance
        return sorted(found.items(), key=lambda item: -item[1])

    def success(self, belief: Belief) -> float:
        """Probability that the course as followed reaches its end under the model."""
        weights = belief.places.items()
        return sum(w.mass * self.foresight.success(place) for place, w in weights)

    def _told(self, place: Place) -> set[tuple[str, Status]]:
        if place.node == END:
            return {("", Status.DONE)}
        steps = self.automaton.steps(place.node)
        kind = self.process.kind
        pairs = zip(steps, place.phases, strict=True)
        return {(step.stage, STATUSES[kind(step, phase)]) for step, phase in pairs}

    def _grown(
        self, belief: Belief, dt: float, now: float
    ) -> Iterator[tuple[Place, Trail | None, float, float]]:
        for place, weighed in belief.places.items():
            if dt <= 0.0:
                yield place, weighed.what, weighed.mass, weighed.best
                continue
            trail, mass, best = weighed.what, weighed.mass, weighed.best
            for passage in self._transitions.passages(place, dt):
                new = longer(trail, passage.left, now) if passage.left else trail
                yield passage.to, new, mass * passage.chance, best * passage.chance

    def _weighed(
        self, place: Place, weighed: Weighed[Trail | None], seen: Mapping[Key, Evidence]
    ) -> Weighed[Trail | None]:
        factor = 1.0
        for key, kind in self._transitions.asked(place):
            if key in seen:
                factor *= self.process.likelihood(kind, *seen[key])
        if factor == 1.0:
            return weighed
        return Weighed(weighed.what, weighed.mass * factor, weighed.best * factor)
