"""Scenario files and their error messages."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.render.scenes import box_file
from visup.agent.model.errors import ErrorGroup, SettingsError, SourceLocation, VisupError
from visup.render.imaging.renderer import Renderer
from visup.render.scenario.library import find_scenario, shipped_names, shipped_scenario
from visup.render.scenario.scenario import load_scenario, parse_scenario

GOOD = """
name = "small"
duration_s = 2.0

[camera]
size = [64, 48]
fps = 5
track = [{ position = [0, 0, 0], look_at = [1, 0, 0] }]

[light]
sun = [-1, 0, 0]

[[object]]
name = "dog"
mesh = "dog"
label = 3
track = [{ position = [5, 0, 0] }]
"""


def test_a_small_scenario_is_parsed() -> None:
    s = parse_scenario(GOOD)
    assert s.frame_count == 10
    assert s.camera.fov_vertical_deg == 38
    assert [o.name for o in s.labelled] == ["dog"]
    assert s.background.kind == "stars"


FAULTS = [
    ("fps = 5", "fps = 0", "camera.fps", "greater than 0"),
    ("size = [64, 48]", "size = [64]", "camera.size.2", "missing"),
    ("size = [64, 48]", "size = [4, 48]", "camera.size.1", "16"),
    ("duration_s = 2.0", "", "duration_s", "missing"),
    ("duration_s = 2.0", 'duration_s = "long"', "duration_s", "number"),
    ("fps = 5", "fps = 5\nlens = 2", "camera.lens", "no such setting"),
    (
        "fps = 5",
        "fps = 5\nzoom = [{ fov_vertical_deg = 200 }]",
        "camera.zoom.1.fov_vertical_deg",
        "less than 170",
    ),
    (
        "sun = [-1, 0, 0]",
        "sun = [-1, 0, 0]\ntrack = [{ strength = -1 }]",
        "light.track.1.strength",
        "greater",
    ),
    (
        "[light]",
        "[sensor]\ntrack = [{ at_s = 2, exposure = 1 }, { at_s = 1, exposure = 2 }]\n\n[light]",
        "sensor.track",
        "rise",
    ),
    (
        'mesh = "dog"',
        'mesh = "arm"\ntexture = { contrast = 0.5 }\njoints = [{ angles_deg = [0, 0, 0, 0, 0, 0] }]',
        "object.1",
        "rigid",
    ),
    ("sun = [-1, 0, 0]", "sun = [0, 0, 0]", "light.sun", "zero"),
    ("look_at = [1, 0, 0]", "look_at = [0, 0, 0]", "camera.track.1", "line of sight"),
    ("look_at = [1, 0, 0]", "look_at = [0, 0, 3]", "camera.track.1", "line of sight"),
    ("label = 3", "label = 128", "object.1", "not scored"),
    ("label = 3", "label = 300", "object.1.label", "255"),
    ("track = [{ position = [5, 0, 0] }]", "track = []", "object.1.track", "at least 1"),
    ('mesh = "dog"', 'mesh = "arm"', "object.1", "tip or joints"),
    (
        "track = [{ position = [5, 0, 0] }]",
        "track = [{ at_s = 1, position = [5, 0, 0] }, { at_s = 1, position = [5, 0, 0] }]",
        "object.1.track",
        "rise",
    ),
    (
        "track = [{ position = [5, 0, 0] }]",
        "track = [{ position = [5, 0, 0], euler_deg = [0, 0, 0], quat_xyzw = [0, 0, 0, 1] }]",
        "object.1.track.1",
        "not both",
    ),
    (
        "track = [{ position = [5, 0, 0] }]",
        'track = [{ position = [5, 0, 0] }]\nattach = { to = "cat", from_s = 1 }',
        "",
        "no object 'cat'",
    ),
    (
        "track = [{ position = [5, 0, 0] }]",
        'track = [{ position = [5, 0, 0] }]\nattach = { to = "dog", from_s = 1 }',
        "",
        "attached to itself",
    ),
    ('name = "dog"', 'name = ""', "object.1.name", "at least 1"),
    ("[light]", '[background]\nkind = "moon"\n\n[light]', "background", "moon"),
    ("[light]", '[truth]\nverdict = "fine"\n\n[light]', "truth.verdict", "succeeded"),
]


@pytest.mark.parametrize(("old", "new", "where", "words"), FAULTS)
def test_each_error_is_reported_with_its_setting(
    old: str, new: str, where: str, words: str
) -> None:
    assert old in GOOD
    with pytest.raises(SettingsError) as caught:
        parse_scenario(GOOD.replace(old, new, 1), "small.toml")
    text = str(caught.value)
    assert "small.toml" in text
    assert where in text
    assert words in text


def test_names_and_labels_of_objects_are_unique() -> None:
    again = GOOD[GOOD.index("[[object]]") :]
    with pytest.raises(SettingsError, match="name 'dog'"):
        parse_scenario(GOOD + again)
    with pytest.raises(SettingsError, match="label '3'"):
        parse_scenario(GOOD + again.replace('name = "dog"', 'name = "cat"'))


def test_several_errors_are_reported_together() -> None:
    bad = GOOD.replace("fps = 5", "fps = -1").replace("label = 3", "label = -3")
    with pytest.raises(ErrorGroup) as caught:
        parse_scenario(bad, "small.toml")
    assert len(caught.value.errors) == 2


def test_an_error_has_its_line_if_that_is_unique() -> None:
    with pytest.raises(SettingsError) as caught:
        parse_scenario(GOOD.replace("fps = 5", "fps = -1"), "small.toml")
    place = caught.value.where
    assert isinstance(place, SourceLocation)
    assert place.text == "fps = -1"


@pytest.mark.parametrize(
    ("content", "words"), [(b"\xff\xfe\x00", "text file"), (b"fps = = 3", "not TOML")]
)
def test_files_that_are_not_scenarios_are_refused(
    tmp_path: Path, content: bytes, words: str
) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes(content)
    with pytest.raises(SettingsError, match=words):
        load_scenario(path)


@pytest.mark.parametrize("word", ["missing.toml", "no_such_scenario"])
def test_a_missing_scenario_is_reported(word: str) -> None:
    with pytest.raises(VisupError, match=r"cannot be read|there is no scenario"):
        find_scenario(word)


def test_mesh_files_are_relative_to_the_scenario(tmp_path: Path) -> None:
    box_file(tmp_path, (1, 1, 1))
    path = tmp_path / "s.toml"
    path.write_text(GOOD.replace('mesh = "dog"', 'mesh = "box.ply"'))
    assert Renderer(load_scenario(path)).mask(0).any()


@pytest.mark.parametrize("mesh", ["unicorn", "missing.ply"])
def test_a_missing_mesh_is_reported(tmp_path: Path, mesh: str) -> None:
    path = tmp_path / "s.toml"
    path.write_text(GOOD.replace('mesh = "dog"', f'mesh = "{mesh}"'))
    with pytest.raises(SettingsError, match="mesh"):
        Renderer(load_scenario(path))


def test_an_arm_out_of_reach_is_reported_with_name_and_time() -> None:
    far = GOOD.replace(
        'mesh = "dog"',
        'mesh = "arm"\ntip = [{ position = [90, 0, 0], direction = [1, 0, 0] }]',
    )
    with pytest.raises(SettingsError, match=r"dog at 0\.00 s.*cannot reach"):
        Renderer(parse_scenario(far)).render(0)


def test_shipped_scenarios_are_valid() -> None:
    assert {"sts87", "capture_succeeds", "over_earth", "crossing"} <= set(shipped_names())
    for name in shipped_names():
        s = shipped_scenario(name)
        assert s.name == name
        assert any(o.actor for o in s.labelled)
