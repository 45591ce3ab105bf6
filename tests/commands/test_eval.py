"""The table of evaluations: every row can be run as it is written."""

from __future__ import annotations

import json
from functools import partial
from importlib import import_module
from inspect import signature
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.oracles.reasoning import relations
from visup.commands.eval.catalogue import EVALUATIONS
from visup.commands.eval.catalogue import app as eval_app
from visup.commands.eval.evaluation import EvaluationCommand


@pytest.mark.parametrize("evaluation", EVALUATIONS, ids=lambda e: e.name)
def test_each_function_accepts_the_options_of_its_command(evaluation: EvaluationCommand) -> None:
    module, _, name = evaluation.function.partition(":")
    options = [s.name for s in evaluation.settings]
    options += [evaluation.argument.name] if evaluation.argument else []
    signature(getattr(import_module(module), name)).bind(**dict.fromkeys([*options, "progress"]))


def test_figures_are_printed_and_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # How fast it is has the same form after one round of each size, and only that takes long.
    monkeypatch.setattr(relations, "speed", partial(relations.speed, frames=62, rounds=1))
    file = tmp_path / "figures.json"
    arguments = ["relations", "--draws", "5", "--minutes", "0.1", "--json", str(file)]
    done = CliRunner().invoke(eval_app, arguments)
    assert done.exit_code == 0, done.output
    assert "of 5 random pairs, RCC-8 is wrong in 0, QTC in 0" in done.output
    record = json.loads(file.read_text())
    assert (record["settings"]["draws"], record["settings"]["minutes"]) == (5, 0.1)
    assert "noise_px" in record["settings"]
    assert record["items"]


def test_a_missing_folder_is_refused_before_the_evaluation(tmp_path: Path) -> None:
    done = CliRunner().invoke(eval_app, ["motion", str(tmp_path / "nothing")])
    assert "there is no such folder" in str(done.exception)
