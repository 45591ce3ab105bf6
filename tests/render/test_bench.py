"""The clips of the bench: they load, move as they are meant to, and are judged by their bars."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from visup.agent.model.errors import SettingsError
from visup.commands.eval.tables import clips_table
from visup.evaluation.motion.rendered_clips import (
    MARK,
    Bar,
    bar_of,
    evaluate_clips,
    judged,
    rendered,
)
from visup.render.imaging.renderer import Renderer
from visup.render.scenario.library import (
    bench_names,
    find_scenario,
    shipped_names,
    shipped_scenario,
)
from visup.render.scenario.scenario import Scenario

SMALL = (120, 90)


def small(name: str) -> Scenario:
    return shipped_scenario(f"bench/{name}").resized(SMALL)


def centres(scenario: Scenario, name: str, frames: range) -> np.ndarray:
    """(N, 2) middle of an object's pixels, in pixels of the full size."""
    label = next(o.label for o in scenario.object if o.name == name)
    renderer = Renderer(scenario)
    found = [np.argwhere(renderer.mask(i) == label).mean(axis=0)[::-1] for i in frames]
    return np.array(found)


@pytest.mark.parametrize("name", bench_names())
def test_a_clip_renders_the_same_each_time_and_shows_what_it_scores(name: str) -> None:
    scenario = small(name)
    assert scenario.name == name
    assert 6 <= scenario.duration_s <= 25
    first, again = Renderer(scenario).picture(3), Renderer(scenario).picture(3)
    assert np.array_equal(first.image, again.image)
    assert np.array_equal(first.mask, again.mask)
    late = Renderer(scenario).mask(scenario.frame_count * 2 // 3)
    shown = 16 * np.bincount(late.ravel(), minlength=256)  # pixels of the full size
    assert any(shown[o.label] >= 500 for o in scenario.labelled)


def test_the_slow_one_is_slow_and_the_fast_one_fast() -> None:
    slow = shipped_scenario("bench/slow")
    a, b = centres(slow, "satellite", range(0, 401, 400))
    assert np.hypot(*(b - a)) / 400 == pytest.approx(0.05, abs=0.01)
    fast = shipped_scenario("bench/fast")
    a, b = centres(fast, "teapot", range(30, 32))
    assert np.hypot(*(b - a)) == pytest.approx(20, abs=3)


def test_the_one_that_stops_stands_for_ten_seconds() -> None:
    scenario = small("stop")
    at = centres(scenario, "horse", range(0, 450, 25))
    moved = np.hypot(*np.diff(at, axis=0).T) > 0.1
    assert moved.tolist() == [True] * 4 + [False] * 10 + [True] * 3


def test_clips_are_found_by_their_folder_and_name() -> None:
    assert not {*bench_names()} & {*shipped_names()}
    assert find_scenario("bench/pan").name == "pan"
    with pytest.raises(SettingsError, match="bench/moon") as caught:
        find_scenario("bench/moon")
    assert "bench/pan" in str(caught.value)


def test_figures_are_judged_by_the_bar() -> None:
    good = {"objects": {"dog": {"J": 0.8, "id_switches": 0}}, "id_switches": 0, "ghost": 0.01}
    assert judged(good, Bar())["missed"] == []
    assert judged({**good, "ghost": 0.011}, Bar())["missed"] == ["ghosts 1.1% > 1%"]
    assert judged({**good, "id_switches": 1}, Bar())["missed"] == ["1 id switches > 0"]
    poor = {**good, "objects": {"dog": {"J": 0.79, "id_switches": 0}}}
    assert judged(poor, Bar())["missed"] == ["J of dog 0.79 < 0.80"]
    assert judged({"ghost": 0.0}, Bar())["missed"] == ["no object was scored"]
    assert all(bar_of(name).id_switches == 0 for name in bench_names())


def test_a_clip_is_rendered_once_and_again_when_it_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tiny = small("slow").model_copy(update={"duration_s": 0.08})
    monkeypatch.setattr("visup.evaluation.motion.rendered_clips.shipped_scenario", lambda _: tiny)
    folder = rendered("slow", tmp_path)
    assert len(list((folder / "masks").iterdir())) == 2
    made = (folder / "truth.json").stat().st_mtime_ns
    assert rendered("slow", tmp_path) == folder
    assert (folder / "truth.json").stat().st_mtime_ns == made
    (folder / MARK).write_text("of another scenario\n")
    rendered("slow", tmp_path)
    assert (folder / "truth.json").stat().st_mtime_ns > made


def test_a_clip_is_scored_from_its_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    camel = shipped_scenario("bench/exposure").resized((160, 120))
    slower = camel.camera.model_copy(update={"fps": camel.camera.fps / 2})
    short = camel.model_copy(update={"duration_s": 2.8, "camera": slower})
    monkeypatch.setattr("visup.evaluation.motion.rendered_clips.shipped_scenario", lambda _: short)
    told: list[str] = []
    figures = evaluate_clips(tmp_path, ["exposure"], workers=1, progress=told.append)
    assert told == ["1 of 1 clips"]
    item = figures["items"]["exposure"]
    assert item["objects"]["camel"]["J"] > 0.5
    assert figures["total"]["clips"] == 1
    assert figures["total"]["passed"] == int(not item["missed"])
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(clips_table(figures["items"]))
    shown = console.export_text()
    assert "camel" in shown
    assert "pass" in shown or item["missed"][0][:10] in shown


def test_an_unknown_clip_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no clip 'moon'"):
        evaluate_clips(tmp_path, ["moon"])
