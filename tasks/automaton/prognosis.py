"""Prognosis of a task: the next stages, and the probability of success."""

from __future__ import annotations

import math
from collections.abc import Mapping

from visup.tasks.automaton.automaton import END, Automaton, Transition
from visup.tasks.automaton.stage_hmm import WAITING, StageHmm
from visup.tasks.automaton.states import TaskStep
from visup.tasks.automaton.transitions import HiddenState

MAX_NODES = 1_000  # beyond this number of nodes success counts as impossible
SMALLEST = 1e-9  # less likely paths are not followed
SWEEPS = 500  # most iterations over all nodes


class Prognosis:
    """The model's predictions for the rest of a task.

    The fate of each step, completed or lost, is assumed to be independent of the durations of the others;
    with one active step at a time this is exact.

    Args:
        automaton: The states of the course.
        hmm: The probabilities.
        most: Number of nodes explored for the probability of success, breadth first.
    """

    def __init__(self, automaton: Automaton, hmm: StageHmm, most: int = MAX_NODES) -> None:
        self._automaton = automaton
        self._most = most
        self._process = hmm
        self._hopes: dict[int, float] | None = None
        self._next: dict[int, Mapping[str, float]] = {}

    def success(self, state: HiddenState) -> float:
        """Probability that the course reaches its end from a state.

        A lower bound for tasks with more states than are explored.
        """
        if state.node == END:
            return 1.0
        if self._hopes is None:
            self._hopes = self._solved()
        hope = self._hopes.get(state.node)
        if hope is None:
            # An unexplored node: compute it from its own transitions.
            hope = self._hoped(state.node, self._hopes)
        return hope * self._fate(state)

    def next_stages(self, state: HiddenState) -> Mapping[str, float]:
        """Stage -> probability that it is the next to begin.

        The end of the task has an empty name; the rest of 1 is the probability of being lost before, so that
        success is never more likely than all of them together.
        """
        if state.node == END:
            return {"": 1.0}
        if state.node not in self._next:
            found: dict[str, float] = {}
            here = {s.stage for s in self._automaton.steps(state.node)}
            self._follow(state.node, here, 1.0, found, 0)
            self._next[state.node] = found
        fate = self._fate(state)
        return {stage: fate * chance for stage, chance in self._next[state.node].items()}

    def _fate(self, state: HiddenState) -> float:
        """Probability that all active steps are completed and none is lost."""
        steps = self._automaton.steps(state.node)
        return math.prod(self._process.fate(s, p) for s, p in zip(steps, state.phases, strict=True))

    def _follow(
        self, node: int, here: set[str], chance: float, found: dict[str, float], depth: int
    ) -> None:
        for transition, share in self._shares(node):
            likely = chance * share
            if likely < SMALLEST or depth > 60:
                continue
            entered = [s.stage for s in begun_by(self._automaton, transition)]
            fresh = dict.fromkeys(s for s in entered if s not in here)
            for stage in fresh:
                found[stage] = found.get(stage, 0.0) + likely
            if transition.target == END:
                found[""] = found.get("", 0.0) + likely
            elif not fresh:
                likely *= self._fate_of_begun(transition)
                self._follow(transition.target, here, likely, found, depth + 1)

    def _shares(self, node: int) -> list[tuple[Transition, float]]:
        """The transitions of a node with their shares once its steps may be completed."""
        transitions = self._automaton.transitions(node)
        total = sum(w.share for w in transitions)
        return [(w, w.share / total) for w in transitions]

    def _solved(self) -> dict[int, float]:
        """Node -> probability of reaching the end once its own steps are completed."""
        nodes = self._automaton.explored(self._most)
        hopes = dict.fromkeys(nodes, 0.0)
        for _ in range(SWEEPS):
            change = 0.0
            for node in reversed(nodes):  # end states come last, so that one sweep settles most
                hope = self._hoped(node, hopes)
                change = max(change, abs(hope - hopes[node]))
                hopes[node] = hope
            if change < 1e-12:
                break
        return hopes

    def _hoped(self, node: int, hopes: Mapping[int, float]) -> float:
        """The probability of `_solved` for one node, from those of its successors."""
        return sum(
            share * self._after(transition, hopes) for transition, share in self._shares(node)
        )

    def _after(self, transition: Transition, hopes: Mapping[int, float]) -> float:
        if transition.target == END:
            return 1.0
        return hopes.get(transition.target, 0.0) * self._fate_of_begun(transition)

    def _fate_of_begun(self, transition: Transition) -> float:
        """Probability that all steps begun by a transition are completed and none is lost."""
        begun = begun_by(self._automaton, transition)
        return math.prod(self._process.fate(s, WAITING) for s in begun)


def begun_by(automaton: Automaton, transition: Transition) -> list[TaskStep]:
    """The steps begun by a transition."""
    steps = automaton.steps(transition.target)
    return [steps[i] for i in transition.begun]
