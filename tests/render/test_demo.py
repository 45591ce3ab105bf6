"""The shipped files of the demo agree with the renderer."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import trimesh

from visup.percepts.shape.building.mesh_views import half_sphere_directions, render_views
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.render.imaging.renderer import Renderer
from visup.render.meshes.spacecraft import mesh
from visup.render.output.demo_clip import CLIP, RECORD
from visup.render.output.demo_models import MODELS, rendered_views, view_counts
from visup.render.output.truth import frame_truth, mission
from visup.render.scenario.library import shipped_scenario

DATA = Path(str(resources.files("visup") / "data"))
CHECKED_FRAMES = (0, 137, 300, 431, 549)


@pytest.fixture(scope="module")
def record() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((DATA / RECORD).read_text())
    return loaded


@pytest.fixture(scope="module")
def clip() -> list[np.ndarray]:
    video = cv2.VideoCapture(str(DATA / CLIP))
    frames: list[np.ndarray] = []
    while True:
        ok, frame = video.read()
        if not ok:
            return frames
        frames.append(np.asarray(frame))


def test_shipped_files_are_small() -> None:
    assert (DATA / CLIP).stat().st_size < 3_000_000
    assert (DATA / RECORD).stat().st_size < 300_000
    assert (DATA / MODELS).stat().st_size < 4_000_000


def test_the_shipped_clip_equals_the_rendered_frames(clip: list[np.ndarray]) -> None:
    scenario = shipped_scenario("sts87")
    renderer = Renderer(scenario)
    assert len(clip) == scenario.frame_count
    for index in CHECKED_FRAMES:
        error = renderer.render(index).image.astype(float) - clip[index]
        assert 10 * np.log10(255**2 / np.mean(error**2)) > 34.0
        # Where there is structure a shift of one pixel would stand out far more than the codec does.
        assert np.percentile(abs(error), 99.9) < 30


def test_the_comparison_tells_frames_apart(clip: list[np.ndarray]) -> None:
    picture = Renderer(shipped_scenario("sts87")).render(137).image
    error = picture.astype(float) - clip[187]
    assert 10 * np.log10(255**2 / np.mean(error**2)) < 30.0


def test_the_shipped_truth_equals_the_rendered_truth(record: dict[str, Any]) -> None:
    scenario = shipped_scenario("sts87")
    renderer = Renderer(scenario)
    assert record["mission"] == mission(scenario)
    for index in CHECKED_FRAMES:
        shipped, found = (
            record["truth"]["frames"][index],
            frame_truth(renderer.render(index), record["truth"]["labels"]),
        )
        for name in record["truth"]["labels"]:
            assert shipped[name]["visible_px"] == pytest.approx(
                found[name]["visible_px"], rel=0.005
            )
            np.testing.assert_allclose(shipped[name]["bbox"], found[name]["bbox"], atol=1)
            assert shipped[name].get("range_m") == pytest.approx(
                found[name].get("range_m"), abs=1e-3
            )


def centres(record: dict[str, Any], name: str) -> np.ndarray:
    boxes = np.array([f[name]["bbox"] for f in record["truth"]["frames"]], float)
    return boxes[:, :2] + boxes[:, 2:] / 2


def gaps(record: dict[str, Any]) -> np.ndarray:
    """Columns between the satellite's right side and the arm's left side; negative when they overlap."""
    frames = record["truth"]["frames"]
    return np.array(
        [
            f["arm"]["bbox"][0] - f["satellite"]["bbox"][0] - f["satellite"]["bbox"][2]
            for f in frames
        ]
    )


def test_the_arm_approaches_touches_and_loses_the_satellite(record: dict[str, Any]) -> None:
    truth, gap, fps = record["truth"], gaps(record), 25
    contact = round(truth["stages"][0]["to_s"] * fps)
    assert truth["verdict"] == "failed"
    assert gap[0] > 150
    assert -20 <= gap[contact] <= 0
    assert gap[-1] > 60
    assert (np.diff(gap[: contact + 1 : 25]) < 0).all()
    assert (np.diff(gap[contact + 50 :: 25]) > 0).all()
    hidden = [f["satellite"]["amodal_px"] - f["satellite"]["visible_px"] for f in truth["frames"]]
    assert max(hidden[:contact]) < 0.01 * truth["frames"][0]["satellite"]["amodal_px"]


def test_motion_is_slow_but_visible(record: dict[str, Any]) -> None:
    at = centres(record, "satellite")
    before = np.linalg.norm(at[300] - at[0]) / 300
    after = np.linalg.norm(at[549] - at[325]) / 224
    assert 0.06 < before < 0.1
    assert after > 0.3
    arm_left = np.array([f["arm"]["bbox"][0] for f in record["truth"]["frames"]])
    assert 0.4 < (arm_left[0] - arm_left[300]) / 300 < 1.2


def test_the_database_has_20_models_with_633_views() -> None:
    database = ModelDatabase.open(DATA / MODELS)
    counts = dict.fromkeys(database.names(), 0)
    for view in database.views:
        counts[view.name] += 1
    assert counts == view_counts()
    assert len(counts) == 20
    assert sum(counts.values()) == 633
    assert counts["spartan"] == 22
    assert counts["arm"] == 4


@pytest.mark.parametrize("name", ["spartan", "guitar"])
def test_a_rebuilt_model_has_the_shipped_views(name: str, tmp_path: Path) -> None:
    shipped = ModelDatabase.open(DATA / MODELS)
    old = [v for v in shipped.views if v.name == name]
    anew = ModelDatabase.create(tmp_path / "anew.models", rendered_views(name, len(old)))
    assert len(anew.views) == len(old)
    for a, b in zip(anew.views, old, strict=True):
        assert a.area == pytest.approx(b.area, rel=1e-3)
        assert a.direction == pytest.approx(b.direction, abs=1e-6)


def test_each_shipped_view_is_the_best_match_of_its_silhouette() -> None:
    database = ModelDatabase.open(DATA / MODELS)
    solid = mesh("spartan")
    body = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    views = [v for v in database.views if v.name == "spartan"][::5]
    for view, rendered in zip(
        views, render_views(body, half_sphere_directions(22)[::5]), strict=True
    ):
        best = database.query(rendered.mask, top=1).matches[0]
        assert (best.view.name, best.view.number) == ("spartan", view.number)
        assert best.similarity > 0.99


def test_both_actors_are_recognised_among_twenty_models() -> None:
    database = ModelDatabase.open(DATA / MODELS)
    scenario = shipped_scenario("sts87")
    renderer = Renderer(scenario)
    for index in (45, 333, 505):
        mask = renderer.mask(index)
        for item in scenario.labelled:
            found = database.query(mask == item.label, cut=item.name == "arm", top=1)
            assert found.matches[0].view.name == item.model
