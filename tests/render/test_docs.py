"""The example in the documentation is a scenario, and the list of meshes is complete."""

from __future__ import annotations

from tests.paths import ROOT
from visup.render.imaging.renderer import Renderer
from visup.render.meshes.spacecraft import MESHES
from visup.render.scenario.scenario import parse_scenario

PAGE = (ROOT / "docs" / "scenarios.md").read_text(encoding="utf-8")


def test_the_example_of_the_documentation_renders() -> None:
    example = PAGE.split("```toml\n")[1].split("```")[0]
    scenario = parse_scenario(example).resized((96, 72))
    mask = Renderer(scenario).mask(100)
    assert {o.label for o in scenario.labelled} <= set(mask.ravel().tolist())


def test_every_mesh_is_documented() -> None:
    listed = PAGE.split("Meshes: ")[1].split("\n\n")[0].replace("\n", " ")
    words = {w.strip(",.` ") for w in listed.split()}
    assert set(MESHES) | {"arm"} <= words
