"""A small campaign of injected faults; `visup eval faults` runs a thousand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.oracles.runtime import behaviour_faults
from tests.oracles.runtime.behaviour_faults import (
    KINDS,
    BehaviourFaultTrial,
    draw,
    evaluate_faults,
    run,
)
from tests.oracles.runtime.fault_injection import DEADLY, FAULTS, WAITING
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.mind import Mind
from visup.agent.model.records import Observation
from visup.rules.language.parser import shipped_rules
from visup.rules.predicates.inputs_missing import inputs_missing, percepts_read

QUICK = sorted(FAULTS.keys() - WAITING - DEADLY)


@pytest.mark.parametrize("fault", QUICK)
def test_a_fault_within_the_process_is_reported_and_nothing_reads_fine(fault: str) -> None:
    trial = BehaviourFaultTrial(
        QUICK.index(fault), fault, KINDS[len(fault) % len(KINDS)], False, 14
    )
    run(trial)
    assert trial.problems == []
    assert trial.recovered


@pytest.mark.parametrize("fault", sorted(WAITING | DEADLY))
def test_a_fault_in_another_process_is_reported_and_nothing_reads_fine(fault: str) -> None:
    trial = BehaviourFaultTrial(0, fault, "region", True, 14)
    run(trial)
    assert trial.problems == []
    assert trial.recovered


@pytest.mark.parametrize("kind", KINDS)
def test_the_campaign_detects_unknown_percepts_taken_for_known(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Let the mind forget what is unknown: then the campaign must find it out."""

    class Careless(Agent):
        def __post_init__(self) -> None:
            def forget(mind: Mind, observation: Observation) -> object:
                from visup.agent import Outcome

                return Outcome(replace(mind, unknown=frozenset()))

            update = (*self.reasoners.update, forget)
            self.reasoners = Reasoners(update, self.reasoners.cogitate)  # type: ignore[arg-type]
            super().__post_init__()

    monkeypatch.setattr(behaviour_faults, "Agent", Careless)
    trial = BehaviourFaultTrial(0, "exception", kind, False, 14)
    run(trial)
    assert any(p.startswith("unknown: ") for p in trial.problems)


def test_the_campaign_detects_rules_that_read_unknown_percepts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("visup.rules.safety.verdicts.inputs_missing", lambda mind, word: False)
    trial = BehaviourFaultTrial(0, "exception", "region", False, 14)
    run(trial)
    assert any(p.startswith("fine: probe_") for p in trial.problems)


def test_every_shipped_rule_reads_words_whose_inputs_are_known() -> None:
    assert shipped_rules()
    assert percepts_read("healthy") == {"health"}
    assert percepts_read("gap") == {"region"}
    assert inputs_missing(Mind(unknown=frozenset({"region"})), "gap")
    assert not inputs_missing(Mind(unknown=frozenset({"lamp"})), "gap")


def test_trials_depend_only_on_the_seed() -> None:
    assert [draw(n, 3) for n in range(40)] == [draw(n, 3) for n in range(40)]
    assert [draw(n, 3) for n in range(40)] != [draw(n, 4) for n in range(40)]
    assert {draw(n, 0).fault for n in range(len(FAULTS))} == set(FAULTS)


def test_the_figures_add_up(tmp_path: Path) -> None:
    figures = evaluate_faults(count=3)
    assert figures["total"]["trials"] == 3
    assert figures["total"]["ended"] == figures["total"]["told"] == 3
    assert figures["total"]["fine"] == 0
    assert figures["failures"] == []
    assert sum(item["trials"] for item in figures["items"].values()) == 3
