"""Supervision agrees with the certified filter on recorded observations, within a stated bound."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tests.rules.percepts_from_truth import MISSIONS
from tests.tasks.scripted import RETRIES, RelationSpan, Script, play
from tests.tasks.supervision.test_missions import NAMES, run
from visup.agent import Mind
from visup.evaluation.reasoning.filter_laws import (
    MAX_DIFFERENCE,
    Observations,
    distance_to_reference,
    random_grammar_distance,
)
from visup.tasks import load_task, parse_task
from visup.tasks.actions.actions import known_actions
from visup.tasks.actions.vocabulary import task_vocabulary
from visup.tasks.grammar.nodes import Task
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.snapshot import TaskSnapshot
from visup.tasks.supervision.supervise import task_reasoner
from visup.tasks.verification.settings import DEFAULT_SETTINGS

DOCKS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 30),
    RelationSpan("coupled", 13.0, 30),
)
FAILS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 12.8),
    RelationSpan("diverging", 12.8, 30),
)
ORDERS = """<t> ::= any order (<s0>, <s1>, <s2>)
<s0> ::= touching(arm, satellite)
<s1> ::= keeping_distance(arm, satellite) for 1 s
<s2> ::= converging(arm, satellite)
"""
MIXED = (
    RelationSpan("keeping_distance", 1.0, 3.5),
    RelationSpan("converging", 4.0, 8.0),
    RelationSpan("touching", 8.0, 10.0),
    RelationSpan("diverging", 12.0, 14.0),
)


def model_of(task: Task) -> MonitoredPhases:
    vocabulary = task_vocabulary(task, known_actions())
    return MonitoredPhases(task, vocabulary.meanings, DEFAULT_SETTINGS, vocabulary.evaluators)


def recorded(model: MonitoredPhases, minds: Sequence[Mind]) -> Observations:
    """What supervision saw of the steps of its task, from where the task begins."""
    followed = [m for m in minds if m.memory["tasks"][0].posterior is not None]
    observations = []
    for mind in followed:
        memory = mind.memory["tasks"][0]
        scene = TaskSnapshot(mind, memory.belief.bindings, model, memory.observations)
        observations.append((mind.time, scene.observe))
    return observations


@pytest.mark.parametrize(
    ("task", "spans"),
    [
        (load_task("dock"), DOCKS),
        (load_task("dock"), FAILS),
        (load_task("dock_with_retry"), RETRIES),
        (parse_task(ORDERS), MIXED),
    ],
)
def test_supervision_is_within_its_error_bound_on_scripted_scenes(
    task: Task, spans: tuple[RelationSpan, ...]
) -> None:
    played = play(task_reasoner([task]), Script(spans), 28.0)
    model = model_of(task)
    distance = distance_to_reference(model, recorded(model, played.minds))
    assert distance.lost < 1e-6
    assert distance.worst <= MAX_DIFFERENCE


@pytest.mark.skipif(
    not (MISSIONS / NAMES[0]).exists(), reason="the shared missions are not beside the repo"
)
@pytest.mark.parametrize("name", NAMES)
def test_supervision_is_within_its_error_bound_on_missions(name: str) -> None:
    model = model_of(load_task("dock"))
    distance = distance_to_reference(model, recorded(model, run(name).minds))
    assert distance.lost < 1e-6
    assert distance.worst <= MAX_DIFFERENCE


def test_without_merging_both_filters_agree() -> None:
    distances = [random_grammar_distance(seed) for seed in (0, 2, 3, 5)]
    assert max(d.worst for d in distances) < 1e-9


def test_merging_different_monitors_causes_an_error() -> None:
    """The law can fail: random observations that follow no course make merging tell."""
    assert (
        random_grammar_distance(9, steps=16).worst > MAX_DIFFERENCE
    )  # the reference has few hypotheses until then
