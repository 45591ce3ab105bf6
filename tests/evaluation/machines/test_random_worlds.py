"""Worlds of an evaluation: kinds take turns, seeds do not meet, unknown kinds are refused."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest
from typer.testing import CliRunner

from visup.agent.model.errors import SettingsError
from visup.cli import app
from visup.evaluation.machines.random_worlds import RandomTrial, plan_trials
from visup.render.worlds.kinds.catalogue import KINDS

TEMPLATE = RandomTrial("", 0)


@pytest.mark.parametrize("count", [1, 7, 60])
def test_kinds_are_spread_evenly(count: int) -> None:
    counts = Counter(t.kind for t in plan_trials((), count, 3, TEMPLATE))
    assert sum(counts.values()) == count
    assert max(counts.values()) - min(counts[k] for k in KINDS) <= 1


def test_no_two_evaluations_share_a_world() -> None:
    first, second = (
        {(t.kind, t.seed) for t in plan_trials((), 60, seed, TEMPLATE)} for seed in (0, 1)
    )
    assert len(first) == len(second) == 60
    assert not first & second


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(SettingsError, match="knitting"):
        plan_trials(("pick", "knitting"), 2, 0, TEMPLATE)


def test_the_command_reports_by_kind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def scored(**_: object) -> dict[str, object]:
        row = {"verdicts_right": 0, "verdicts": 1, "stage_f1": 0.5}
        world = {**row, "verdict": "failed", "accept": ["succeeded"]}
        return {"items": {"pick": row}, "total": row, "worlds": {"pick_0001_ok": world}}

    monkeypatch.setattr("visup.evaluation.machines.random_worlds.evaluate_random", scored)
    json_path = tmp_path / "figures.json"
    result = CliRunner().invoke(
        app, ["eval", "random", "--kind", "pick", "--count", "1", "--json", str(json_path)]
    )
    assert result.exit_code == 0
    assert "pick_0001_ok: failed, not succeeded" in result.output
    assert "0 of 1 verdicts are right" in result.output
    assert json.loads(json_path.read_text(encoding="utf-8"))["items"]["pick"]["verdicts"] == 1
