"""Recognition: where a task is, from verdicts on its actions that may be wrong or missing.

The forward algorithm (`forward.py`) over the places of a task (`transitions.py`), whose
probabilities the model gives (`hmm.py`). It is a probabilistic parser: the mass of what is
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
from visup.tasks.automaton.backpointers import Backpointer, Revision, extended, revisions
from visup.tasks.automaton.forward import Weighted, merged, pruned
from visup.tasks.automaton.prognosis import Prognosis
from visup.tasks.automaton.stage_hmm import DEFAULT_HMM, ActionStatus, PhaseKind, StageHmm
from visup.tasks.automaton.transitions import HiddenState, HiddenTransitions
from visup.tasks.grammar.nodes import Task

ActionKey = tuple[str, tuple[str, ...]]
"""An action and its actors."""

STATUSES = {
    PhaseKind.WAITING: Status.ACTIVE,
    PhaseKind.GOING: Status.PROGRESSING,
    PhaseKind.FAILING: Status.FAILING,
    PhaseKind.LOST: Status.FAILED,
}


class ActionEvidence(NamedTuple):
    """What is seen of an action between its actors, and how sure that is, 0 to 1."""

    seen: ActionStatus
    confidence: float = 1.0


@dataclass(frozen=True, slots=True)
class TaskPosterior:
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
    states: Mapping[HiddenState, Weighted[Backpointer | None]]
    lost: float = 0.0
    evidence: float = 0.0
    revised: tuple[Revision, ...] = field(default=())

    @property
    def best(self) -> HiddenState:
        """The most likely place."""
        return max(self.states.items(), key=lambda item: item[1].mass)[0]

    @property
    def backpointer(self) -> Backpointer | None:
        """The best way to the most likely place."""
        return self.states[self.best].value


class TaskFilter:
    """Follows one task.

    Args:
        task: The task, checked.
        hmm: The probabilities of the model.
        most: How many places are kept at most.
        least: Places with a smaller probability are dropped; 0 for the exact posterior.
    """

    def __init__(
        self,
        task: Task,
        hmm: StageHmm = DEFAULT_HMM,
        most: int = 1_000,
        least: float = 1e-6,
    ) -> None:
        self.automaton = Automaton(task)
        self.hmm = hmm
        self.prognosis = Prognosis(self.automaton, hmm)
        self._transitions = HiddenTransitions(self.automaton, hmm)
        self._most, self._least = most, least

    def start(self, now: float = 0.0) -> TaskPosterior:
        """The belief before anything was seen."""
        nothing: Backpointer | None = None
        begun = self._transitions.begin()
        return TaskPosterior(now, merged((state, nothing, share, share) for state, share in begun))

    def step(
        self, belief: TaskPosterior, seen: Mapping[ActionKey, ActionEvidence], dt: float
    ) -> TaskPosterior:
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
        weighted = {p: self._weighed(p, w, seen) for p, w in found.items()}
        new = pruned(weighted, self._most, self._least)
        lost = 1.0 - (1.0 - belief.lost) * (1.0 - new.dropped)
        evidence = belief.evidence + log(new.evidence)
        after = TaskPosterior(now, new.retained, lost, evidence)
        taken_back = revisions(belief.backpointer, after.backpointer, now)
        return TaskPosterior(now, new.retained, lost, evidence, tuple(taken_back))

    def stages(self, belief: TaskPosterior) -> dict[tuple[str, Status], float]:
        """For each stage and status the probability that a step of it is under way and stands so.

        With steps under way at the same time they sum to more than 1. The end has no stage: it is
        told by an empty name, done.
        """
        found: dict[tuple[str, Status], float] = {}
        for state, weighted in belief.states.items():
            for told in self._told(state):
                found[told] = found.get(told, 0.0) + weighted.mass
        return found

    def most_likely(self, belief: TaskPosterior) -> tuple[str, Status]:
        """The most likely stage and status."""
        found = self.stages(belief)
        return max(found, key=lambda k: found[k])

    def ranking(self, belief: TaskPosterior) -> list[tuple[str, float]]:
        """Stages by the probability that they are under way, the likeliest first."""
        found: dict[str, float] = {}
        for state, weighted in belief.states.items():
            for stage in {stage for stage, _ in self._told(state)}:
                found[stage] = found.get(stage, 0.0) + weighted.mass
        return sorted(found.items(), key=lambda item: -item[1])

    def next_stages(self, belief: TaskPosterior) -> list[tuple[str, float]]:
        """Stages by the probability that they are the next to begin; the rest is for the end."""
        found: dict[str, float] = {}
        for state, weighted in belief.states.items():
            for stage, chance in self.prognosis.next_stages(state.node).items():
                found[stage] = found.get(stage, 0.0) + weighted.mass * chance
        return sorted(found.items(), key=lambda item: -item[1])

    def success(self, belief: TaskPosterior) -> float:
        """Probability that the course as followed reaches its end under the model."""
        weights = belief.states.items()
        return sum(w.mass * self.prognosis.success(state) for state, w in weights)

    def _told(self, state: HiddenState) -> set[tuple[str, Status]]:
        if state.node == END:
            return {("", Status.DONE)}
        steps = self.automaton.steps(state.node)
        kind = self.hmm.kind
        pairs = zip(steps, state.phases, strict=True)
        return {(step.stage, STATUSES[kind(step, phase)]) for step, phase in pairs}

    def _grown(
        self, belief: TaskPosterior, dt: float, now: float
    ) -> Iterator[tuple[HiddenState, Backpointer | None, float, float]]:
        for state, weighted in belief.states.items():
            if dt <= 0.0:
                yield state, weighted.value, weighted.mass, weighted.best
                continue
            backpointer, mass, best = weighted.value, weighted.mass, weighted.best
            for transition in self._transitions.transitions(state, dt):
                new = (
                    extended(backpointer, transition.left, now) if transition.left else backpointer
                )
                yield transition.to, new, mass * transition.chance, best * transition.chance

    def _weighed(
        self,
        state: HiddenState,
        weighted: Weighted[Backpointer | None],
        seen: Mapping[ActionKey, ActionEvidence],
    ) -> Weighted[Backpointer | None]:
        factor = 1.0
        for key, kind in self._transitions.required(state):
            if key in seen:
                factor *= self.hmm.likelihood(kind, *seen[key])
        if factor == 1.0:
            return weighted
        return Weighted(weighted.value, weighted.mass * factor, weighted.best * factor)
