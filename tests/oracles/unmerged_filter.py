"""The model of supervision with each history followed by itself: what merging is measured against."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import count

from visup.agent import Status
from visup.tasks.automaton.automaton import Automaton
from visup.tasks.automaton.task_filter import TaskFilter
from visup.tasks.supervision.hypotheses import TaskHypotheses, TaskHypothesis
from visup.tasks.supervision.monitored_phases import MonitoredPhases, SupervisionFilter
from visup.tasks.verification.step_model import Observe

MAX_HISTORIES = 4_000
LEAST = 1e-9  # histories with less of the mass are dropped, which the posterior accounts for


class Unmerged:
    """The model of supervision with each history of its own; see `TaskModel`.

    Args:
        model: The model.
    """

    def __init__(self, model: MonitoredPhases) -> None:
        self._model = model
        self._numbers = count()

    @property
    def automaton(self) -> Automaton:
        """The states of the course."""
        return self._model.automaton

    def begin(self, now: float) -> Iterator[tuple[int, TaskHypothesis, float]]:
        """See `TaskModel`."""
        for _, hypothesis, share in self._model.begin(now):
            yield next(self._numbers), hypothesis, share

    def extended(
        self, posterior: TaskHypotheses, evidence: Observe, now: float, dt: float
    ) -> Iterator[tuple[int, TaskHypothesis, float, float]]:
        """See `TaskModel`."""
        for _, made, mass, best in self._model.paths(posterior, evidence, now, dt):
            yield next(self._numbers), made(), mass, best

    def stage_statuses(
        self, key: int, hypothesis: TaskHypothesis
    ) -> Collection[tuple[str, Status]]:
        """See `TaskModel`."""
        return self._model.stage_statuses(key, hypothesis)

    def next_stages(self, key: int, hypothesis: TaskHypothesis) -> Mapping[str, float]:
        """See `TaskModel`."""
        return self._model.next_stages(key, hypothesis)

    def success(self, key: int, hypothesis: TaskHypothesis) -> float:
        """See `TaskModel`."""
        return self._model.success(key, hypothesis)


def unmerged_filter(model: MonitoredPhases) -> SupervisionFilter:
    """The task filter of a model in which no two histories are merged."""
    return TaskFilter(Unmerged(model), MAX_HISTORIES, LEAST)
