"""The clips of the bench: loading, motion, and evaluation against their limits."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from visup.agent.model.errors import SettingsError
from visup.commands.eval.tables import clips_table
from visup.evaluation.motion.rendered_clips import (
    DIGEST_FILE,
    Bar,
    bar_of,
    compare_with_bar,
    evaluate_clips,
    rendered_clip,
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
    """(N, 2) centroids of an object, pixels."""
    label = next(o.label for o in scenario.object if o.name == name)
    renderer = Renderer(scenario)
    found = [np.argwhere(renderer.mask(i) == label).mean(axis=0)[::-1] for i in frames]
    return np.array(found)


@pytest.mark.parametrize("name", bench_names())
def test_clips_are_deterministic_and_show_a_scored_object(name: str) -> None:
    scenario = small(name)
    assert scenario.name == name
    assert 6 <= scenario.duration_s <= 25
    first, again = Renderer(scenario).render(3), Renderer(scenario).render(3)
    assert np.array_equal(first.image, again.image)
    assert np.array_equal(first.mask, again.mask)
    late = Renderer(scenario).mask(scenario.frame_count * 2 // 3)
    pixel_counts = 16 * np.bincount(late.ravel(), minlength=256)  # pixels of the full size
    assert any(pixel_counts[o.label] >= 500 for o in scenario.labelled)


def test_slow_and_fast_clips_have_their_speeds() -> None:
    slow = shipped_scenario("bench/slow")
    a, b = centres(slow, "satellite", range(0, 401, 400))
    assert np.hypot(*(b - a)) / 400 == pytest.approx(0.05, abs=0.01)
    fast = shipped_scenario("bench/fast")
    a, b = centres(fast, "teapot", range(30, 32))
    assert np.hypot(*(b - a)) == pytest.approx(20, abs=3)


def test_the_horse_of_the_stop_clip_rests_for_ten_seconds() -> None:
    scenario = small("stop")
    at = centres(scenario, "horse", range(0, 450, 25))
    moved = np.hypot(*np.diff(at, axis=0).T) > 0.1
    assert moved.tolist() == [True] * 4 + [False] * 10 + [True] * 3


def test_bench_clips_are_found_by_folder_and_name() -> None:
    assert not {*bench_names()} & {*shipped_names()}
    assert find_scenario("bench/pan").name == "pan"
    with pytest.raises(SettingsError, match="bench/moon") as caught:
        find_scenario("bench/moon")
    assert "bench/pan" in str(caught.value)


def test_figures_are_compared_with_the_limits() -> None:
    good = {"objects": {"dog": {"J": 0.8, "id_switches": 0}}, "id_switches": 0, "ghost": 0.01}
    assert compare_with_bar(good, Bar())["missed"] == []
    assert compare_with_bar({**good, "ghost": 0.011}, Bar())["missed"] == ["ghosts 1.1% > 1%"]
    assert compare_with_bar({**good, "id_switches": 1}, Bar())["missed"] == ["1 id switches > 0"]
    poor = {**good, "objects": {"dog": {"J": 0.79, "id_switches": 0}}}
    assert compare_with_bar(poor, Bar())["missed"] == ["J of dog 0.79 < 0.80"]
    assert compare_with_bar({"ghost": 0.0}, Bar())["missed"] == ["no object was scored"]
    assert all(bar_of(name).id_switches == 0 for name in bench_names())


def test_a_clip_is_rendered_again_only_if_its_scenario_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tiny = small("slow").model_copy(update={"duration_s": 0.08})
    monkeypatch.setattr("visup.evaluation.motion.rendered_clips.shipped_scenario", lambda _: tiny)
    folder = rendered_clip("slow", tmp_path)
    assert len(list((folder / "masks").iterdir())) == 2
    modified = (folder / "truth.json").stat().st_mtime_ns
    assert rendered_clip("slow", tmp_path) == folder
    assert (folder / "truth.json").stat().st_mtime_ns == modified
    (folder / DIGEST_FILE).write_text("of another scenario\n")
    rendered_clip("slow", tmp_path)
    assert (folder / "truth.json").stat().st_mtime_ns > modified


def test_a_clip_is_scored_against_its_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    camel = shipped_scenario("bench/exposure").resized((160, 120))
    slower = camel.camera.model_copy(update={"fps": camel.camera.fps / 2})
    short = camel.model_copy(update={"duration_s": 2.8, "camera": slower})
    monkeypatch.setattr("visup.evaluation.motion.rendered_clips.shipped_scenario", lambda _: short)
    messages: list[str] = []
    figures = evaluate_clips(tmp_path, ["exposure"], workers=1, progress=messages.append)
    assert messages == ["1 of 1 clips"]
    item = figures["items"]["exposure"]
    assert item["objects"]["camel"]["J"] > 0.5
    assert figures["total"]["clips"] == 1
    assert figures["total"]["passed"] == int(not item["missed"])
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(clips_table(figures["items"]))
    pixel_counts = console.export_text()
    assert "camel" in pixel_counts
    assert "pass" in pixel_counts or item["missed"][0][:10] in pixel_counts


def test_an_unknown_clip_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no clip 'moon'"):
        evaluate_clips(tmp_path, ["moon"])
