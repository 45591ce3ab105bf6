"""Measures the approximation error of the task filter of supervision.

The filter merges hypotheses at the same node, although their monitors may differ, and keeps only a few. The
reference posterior uses the same model and evidence without merging histories
(`tests/oracles/unmerged_filter.py`).
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from visup.agent import Relation, Truth
from visup.evaluation.oracles import oracle
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.automaton.stage_hmm import ActionStatus
from visup.tasks.automaton.task_filter import TaskFilter
from visup.tasks.grammar.parser import read
from visup.tasks.supervision.hypotheses import TaskHypothesis
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.settings import DEFAULT_SETTINGS
from visup.tasks.verification.step_model import Observe

recognition_tasks = oracle("recognition_tasks")
unmerged_filter = oracle("unmerged_filter").unmerged_filter

MAX_DIFFERENCE = 0.01
"""Maximum difference of stage probabilities from the reference on observations of a mission."""
MAX_MEAN_DIFFERENCE = 0.05
"""Maximum mean difference for random grammars with random observations."""
STEPS = 40
FRAME_S = 0.2
STATUS_DURATION_S = (0.4, 4.0)  # range of the time for which an action keeps one observed status

Observations = Sequence[tuple[float, Observe]]
"""Times in seconds, and observations of steps."""


@dataclass(frozen=True, slots=True)
class FilterDistance:
    """The distance of two stage posteriors over time.

    Attributes:
        worst: Greatest difference of the probabilities of a stage.
        mean: Mean over steps of the greatest difference.
        lost: Upper bound of the mass dropped by the reference filter.
    """

    worst: float
    mean: float
    lost: float = 0.0


def distance_to_reference(model: MonitoredPhases, observations: Observations) -> FilterDistance:
    """The distance of supervision from the reference posterior.

    Args:
        model: The supervised task.
        observations: Times and observations, the first where the task begins.
    """
    reference: TaskFilter[int, TaskHypothesis, Observe] = unmerged_filter(model)
    state = model.filter.start(observations[0][0])
    reference_state = reference.start(state.time)
    differences = []
    for now, observe in observations:
        state = model.filter.step(state, observe, now - state.time, now)
        reference_state = reference.step(reference_state, observe, now - reference_state.time, now)
        differences.append(
            _max_difference(
                dict(model.filter.ranking(state)), dict(reference.ranking(reference_state))
            )
        )
    return FilterDistance(
        max(differences), sum(differences) / len(differences), reference_state.lost
    )


def _max_difference(one: Mapping[str, float], other: Mapping[str, float]) -> float:
    """The greatest difference of stage probabilities, including the end."""
    return max(abs(one.get(k, 0.0) - other.get(k, 0.0)) for k in {*one, *other})


def random_grammar_distance(seed: int, steps: int = STEPS) -> FilterDistance:
    """The distance of supervision from the reference on a random grammar with random observations.

    Args:
        seed: Of the grammar and of the observations.
        steps: Steps that are compared; the draw does not depend on them.
    """
    rng = random.Random(seed)
    task = read(recognition_tasks.text_of(recognition_tasks.Draw(rng).rules()))
    keys = recognition_tasks.KEYS
    actions = {k: ActionDefinition(k, (k,), contrary=(f"not {k}",), text=k) for k in keys}
    statuses = {k: random_statuses(rng) for k in keys}
    times = [FRAME_S * i for i in range(steps)]
    observations = [(now, _observe_at(now, statuses)) for now in times]
    return distance_to_reference(MonitoredPhases(task, actions, DEFAULT_SETTINGS), observations)


StatusIntervals = Sequence[tuple[float, ActionStatus]]
"""Start times of the observed statuses of an action, seconds."""


def random_statuses(rng: random.Random) -> StatusIntervals:
    """A random sequence of observed statuses of an action."""
    intervals, now = [], 0.0
    while now < FRAME_S * STEPS:
        intervals.append((now, rng.choice(tuple(ActionStatus))))
        now += rng.uniform(*STATUS_DURATION_S)
    return intervals


def _observe_at(now: float, statuses: Mapping[str, StatusIntervals]) -> Observe:
    @cache  # hundreds of hypotheses ask for the same few actions
    def observed(action: str) -> ActionObservation:
        since, status = max(s for s in statuses[action] if s[0] <= now)
        relation = Relation(action, (1,), Truth.TRUE, since)
        holds = relation if status is ActionStatus.HOLDS else None
        return ActionObservation(
            holds=Truth.TRUE if holds else Truth.FALSE,
            held_by=holds,
            helps=holds,
            entry=holds,
            contrary=relation if status is ActionStatus.CONTRARY else None,
            observed=status is not ActionStatus.UNKNOWN,
        )

    return lambda step: observed(step.action)
