"""The model with hidden phases of steps, which is verified against an enumerating oracle.

Hypotheses are the hidden states of a task (`transitions.py`) with the best path to each; their
probabilities are those of `stage_hmm.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple, TypeAlias

from visup.agent import Status
from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.backpointers import Backpointer, extended
from visup.tasks.automaton.prognosis import Prognosis
from visup.tasks.automaton.stage_hmm import DEFAULT_HMM, ActionStatus, PhaseKind, StageHmm
from visup.tasks.automaton.task_filter import TaskFilter, TaskPosterior
from visup.tasks.automaton.transitions import HiddenState, HiddenTransition, HiddenTransitions
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
    """The observed status of an action between its actors, and its confidence, 0 to 1."""

    seen: ActionStatus
    confidence: float = 1.0


Evidence: TypeAlias = Mapping[ActionKey, ActionEvidence]
"""Action -> evidence; actions without an entry are unobserved."""

HiddenPosterior: TypeAlias = TaskPosterior[HiddenState, Backpointer | None]


class HiddenPhases:
    """A task whose phases are hidden; see `TaskModel`.

    Args:
        task: The task, checked.
        hmm: The probabilities.
    """

    def __init__(self, task: Task, hmm: StageHmm = DEFAULT_HMM) -> None:
        self.automaton = Automaton(task)
        self.hmm = hmm
        self.prognosis = Prognosis(self.automaton, hmm)
        self.transitions = HiddenTransitions(self.automaton, hmm)

    def begin(self, now: float) -> Iterator[tuple[HiddenState, Backpointer | None, float]]:
        """See `TaskModel`."""
        for state, share in self.transitions.begin():
            yield state, None, share

    def extended(
        self, posterior: HiddenPosterior, evidence: Evidence, now: float, dt: float
    ) -> Iterator[tuple[HiddenState, Backpointer | None, float, float]]:
        """See `TaskModel`."""
        fits: dict[HiddenState, float] = {}
        for state, weighted in posterior.hypotheses.items():
            for transition in self._after(state, dt):
                to, behind = transition.to, weighted.value
                fit = fits.get(to)
                if fit is None:
                    fit = fits[to] = self._likelihood(to, evidence)
                if transition.left:
                    behind = extended(behind, ((s, None) for s in transition.left), now)
                chance = transition.chance * fit
                yield to, behind, weighted.mass * chance, weighted.best * chance

    def stage_statuses(
        self, key: HiddenState, hypothesis: Backpointer | None
    ) -> set[tuple[str, Status]]:
        """See `TaskModel`."""
        if key.node == END:
            return {("", Status.DONE)}
        pairs = zip(self.automaton.steps(key.node), key.phases, strict=True)
        return {(step.stage, STATUSES[self.hmm.kind(step, phase)]) for step, phase in pairs}

    def next_stages(self, key: HiddenState, hypothesis: Backpointer | None) -> Mapping[str, float]:
        """See `TaskModel`."""
        return self.prognosis.next_stages(key)

    def success(self, key: HiddenState, hypothesis: Backpointer | None) -> float:
        """See `TaskModel`."""
        return self.prognosis.success(key)

    def _after(self, state: HiddenState, dt: float) -> tuple[HiddenTransition, ...]:
        if dt <= 0.0:
            return (HiddenTransition(state, 1.0),)
        return self.transitions.transitions(state, dt)

    def _likelihood(self, state: HiddenState, evidence: Evidence) -> float:
        """Likelihood ratio of the evidence in a state to an idle scene."""
        fit = 1.0
        for key, kind in self.transitions.required(state):
            if key in evidence:
                fit *= self.hmm.likelihood(kind, *evidence[key])
        return fit


HiddenFilter: TypeAlias = TaskFilter[HiddenState, Backpointer | None, Evidence]


def hidden_filter(
    task: Task, hmm: StageHmm = DEFAULT_HMM, most: int = 1_000, least: float = 1e-6
) -> HiddenFilter:
    """The task filter with hidden phases."""
    return TaskFilter(HiddenPhases(task, hmm), most, least)
