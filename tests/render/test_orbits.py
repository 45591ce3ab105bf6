"""Random missions in orbit."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from visup.agent.model.errors import SettingsError

pytest.importorskip("trimesh", reason="the extra visup[render] is not installed")
pytest.importorskip("embreex", reason="the extra visup[render] is not installed")

from visup.cli import app
from visup.render.imaging.renderer import Renderer
from visup.render.imaging.scene_poses import PosedScene
from visup.render.orbits.capture_scripts import OUTCOMES
from visup.render.orbits.random_orbit import ARM, SATELLITE, random_orbit
from visup.render.scenario.scenario import Scenario

VERDICTS = {
    "ok": "succeeded",
    "lost": "failed",
    "aborted": "failed",
    "intruder": "interrupted",
    "crossing": "interrupted",
    "short": "in_progress",
}
SMALL = (96, 72)


def touch_s(scenario: Scenario) -> float:
    return scenario.truth.coupling[0].at_s


def test_equal_seeds_give_equal_missions() -> None:
    assert random_orbit(3) == random_orbit(3)
    assert random_orbit(3) != random_orbit(4)


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_each_outcome_has_its_verdict_and_objects(outcome: str) -> None:
    scenario = random_orbit(11, outcome, SMALL)
    assert scenario.truth.verdict == VERDICTS[outcome]
    assert scenario.name.endswith(outcome)
    names = {o.name for o in scenario.object}
    assert ("intruder" in names) == (outcome in ("intruder", "crossing"))
    first = Renderer(scenario).mask(1)
    assert {ARM, SATELLITE} <= set(np.unique(first).tolist())


def test_a_captured_satellite_is_touched_by_the_tip_and_moves_with_it() -> None:
    scenario = random_orbit(5, "ok", SMALL)
    scene = PosedScene(scenario)
    arm, satellite = scene.objects["arm"], scene.objects["satellite"]

    def relative_pose(time: float) -> np.ndarray:
        return np.linalg.inv(scene.attachment_frame(arm, time)) @ scene.object_pose(satellite, time)

    at = touch_s(scenario)
    np.testing.assert_allclose(
        relative_pose(at + 0.1), relative_pose(scenario.duration_s), atol=1e-6
    )
    tip = scene.attachment_frame(arm, at)[:3, 3]
    pose = scene.object_pose(satellite, at)
    vertices = scene.solids["satellite"].vertices @ pose[:3, :3].T + pose[:3, 3]
    assert np.linalg.norm(vertices - tip, axis=1).min() < 0.02


def test_the_tip_approaches_until_contact() -> None:
    scenario = random_orbit(5, "ok", SMALL)
    scene = PosedScene(scenario)
    distances = [
        np.linalg.norm(
            scene.attachment_frame(scene.objects["arm"], t)[:3, 3]
            - scene.object_pose(scene.objects["satellite"], t)[:3, 3]
        )
        for t in np.linspace(0, touch_s(scenario), 6)
    ]
    assert all(a > b for a, b in pairwise(distances))


def test_an_unknown_outcome_is_refused() -> None:
    with pytest.raises(SettingsError, match="cannot go 'sideways'"):
        random_orbit(1, "sideways")


def test_the_command_writes_a_random_mission(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    out = tmp_path / "mission"
    arguments = ["render", "--random", "orbit", "--seed", "2", "--outcome", "short"]
    result = CliRunner().invoke(app, [*arguments, "--size", "64x48", "--out", str(out)])
    assert result.exit_code == 0, result.output
    record = json.loads((out / "mission.json").read_text())
    truth = json.loads((out / "truth.json").read_text())
    assert (record["task"], truth["verdict"]) == ("dock", "in_progress")
    assert set(record["actors"]) == {"arm", "satellite"}
    assert len(list((out / "masks").iterdir())) == len(truth["frames"])
