from __future__ import annotations

import json

from typer.testing import CliRunner

from tests.paths import ROOT
from visup.agent.model.errors import ErrorGroup, TaskError
from visup.commands.task.task import app
from visup.tasks import shipped_tasks

BAD = ROOT / "tests/tasks/bad"
runner = CliRunner()


def test_check_confirms_valid_files() -> None:
    result = runner.invoke(app, ["check", *shipped_tasks()])
    assert result.exit_code == 0
    assert result.output.splitlines() == [f"{n}: ok" for n in shipped_tasks()]


def test_check_reports_every_mistake_of_every_file() -> None:
    files = [str(BAD / "three_mistakes.task"), "dock", str(BAD / "tabs.task")]
    result = runner.invoke(app, ["check", *files])
    assert isinstance(result.exception, ErrorGroup)
    assert len(result.exception.errors) == 4
    assert result.output.strip() == "dock: ok"
    single = runner.invoke(app, ["check", str(BAD / "tabs.task")])
    assert isinstance(single.exception, TaskError)


def test_check_gives_json_with_positions_and_exit_code_2() -> None:
    path = str(BAD / "three_mistakes.task")
    result = runner.invoke(app, ["check", "--json", path, "dock"])
    assert result.exit_code == 2
    errors = json.loads(result.output)
    assert errors["dock"] == []
    assert [(f["code"], f["line"]) for f in errors[path]] == [("E102", 2), ("E201", 3), ("E117", 4)]
    missing = json.loads(runner.invoke(app, ["check", "--json", "nothing"]).output)
    assert missing["nothing"][0]["code"] is None


def test_show_draws_the_tree_with_actors_and_invariants() -> None:
    output = runner.invoke(app, ["show", "inspect"]).output
    for text in ("inspect", "<fly_around>", "for 20 s", "perhaps", "never touching", "mir"):
        assert text in output
    retry = runner.invoke(app, ["show", "dock_with_retry"]).output
    assert "one of" in retry
    assert "(see above)" in retry


def test_list_names_every_shipped_task() -> None:
    output = runner.invoke(app, ["list"]).output
    assert [line.split()[0] for line in output.splitlines()] == list(shipped_tasks())
    assert set(json.loads(runner.invoke(app, ["list", "--json"]).output)) == set(shipped_tasks())
