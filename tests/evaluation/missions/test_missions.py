"""`visup eval missions` on the first seconds of a mission with known truth."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.paths import ROOT
from visup.agent.model.errors import SettingsError
from visup.evaluation.missions.runner import evaluate_missions

MISSIONS = ROOT.parent / "shared" / "data" / "missions"
KEYS = {
    "identity",
    "event_precision",
    "event_recall",
    "event_f1",
    "stage",
    "alerts_found",
    "alerts_expected",
    "false_alerts",
    "false_alerts_per_hour",
    "verdicts_right",
    "verdicts",
    "fps",
}


@pytest.mark.skipif(not MISSIONS.is_dir(), reason="the shared missions are not beside the repo")
def test_an_actor_that_the_database_lacks_is_refused() -> None:
    database = ROOT / "visup" / "data" / "demo.models"
    mission = MISSIONS / "capture_succeeds"
    with pytest.raises(SettingsError, match="not in the model database"):
        evaluate_missions(mission, models=database, limit=5)


def test_a_folder_without_missions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no mission"):
        evaluate_missions(tmp_path)


def test_a_rendered_mission_is_scored_end_to_end(tmp_path: Path) -> None:
    """Truth from the renderer, the clip cut to its first seconds, every fourth frame, the demo's database."""
    from visup.render.output.writer import write_mission
    from visup.render.scenario.library import shipped_scenario

    scenario = shipped_scenario("sts87")
    camera = scenario.camera.model_copy(update={"fps": scenario.camera.fps / 4})
    short = scenario.model_copy(update={"duration_s": 3.6, "camera": camera})
    write_mission(short.resized((320, 240)), tmp_path / "mission")
    figures = evaluate_missions(
        tmp_path / "mission", models=ROOT / "visup" / "data" / "demo.models"
    )
    assert set(figures["items"]) == {"mission"}
    assert set(figures["total"]) >= KEYS
    assert 0.5 < figures["total"]["identity"] <= 1.0
    json.dumps(figures)
