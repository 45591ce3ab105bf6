"""`visup task learn`, `fit`, `coverage` and `diff` as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli import Call
from tests.commands.test_cli import visup
from tests.tasks.learning.test_learning import ARM, NAMES, PART, pick_run
from visup.agent import Mind
from visup.runs import learning_runs
from visup.tasks.learning.traces import RunTrace

__all__ = ["visup"]  # the fixture
assert {ARM, PART} <= set(NAMES)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Runs `1` to `3` that went well and `spoilt`, in the place of journals."""
    traces = {str(k): pick_run(str(k), k) for k in (1, 2, 3)} | {
        "spoilt": pick_run("spoilt", 9, "drop")
    }

    def trace(run: Path) -> RunTrace:
        return traces[run.name]

    def minds(run: Path) -> tuple[Mind, ...]:
        return traces[run.name].minds

    monkeypatch.setattr(learning_runs, "run_trace", trace)
    monkeypatch.setattr(learning_runs, "run_minds", minds)
    monkeypatch.setattr(learning_runs, "declared_actors", lambda run: {})
    return ["1", "2", "3"]


def test_a_task_is_learned_fitted_covered_and_compared(
    visup: Call, runs: list[str], tmp_path: Path
) -> None:
    file = tmp_path / "bring.task"
    result = visup("task", "learn", *runs, "--bad", "spoilt", "--out", file)
    assert result.code == 0
    assert "<bring> ::=" in result.out
    assert "in 3 of 3 runs" in file.read_text()
    assert "spoilt: failed" in result.out or "spoilt: in progress" in result.out
    assert visup("task", "check", file).code == 0
    covered = visup("task", "coverage", file, "spoilt", "--json")
    assert (covered.code, json.loads(covered.out)["covered"] < 1.0) == (1, True)
    assert visup("task", "coverage", file, *runs).code == 0
    text = file.read_text()
    assert visup("task", "fit", file, *runs, "--dry-run").code == 0
    assert file.read_text() == text
    assert visup("task", "diff", file, file).code == 0
    other = visup("task", "diff", "dock", "dock_with_retry")
    assert other.code == 1
    assert "only `dock_with_retry` allows" in other.out


def test_unwritable_and_unreadable_paths_are_reported(visup: Call, tmp_path: Path) -> None:
    nowhere = visup("task", "learn", tmp_path, "--out", tmp_path / "none" / "x.task")
    assert (nowhere.code, "no such folder" in nowhere.err) == (2, True)
    nothing = visup("task", "learn", tmp_path, "--out", tmp_path / "x.task")
    assert (nothing.code, "no recorded run" in nothing.err) == (2, True)
