from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import NamedTuple, cast

import pytest

from tests.agent.scripted import Scripted, frames
from visup.agent import ReportState
from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import BehaviourError
from visup.agent.plugins.factory import load_behaviours
from visup.agent.plugins.registry import Registry, discover_behaviours

PLUGIN = """
from visup.agent import Contract, Percept

class Brightness:
    contract = Contract("brightness", gives=("brightness",))

    def perceive(self, frame, observation, directives):
        yield Percept("brightness", float(frame.image.mean()), frame.time, "brightness")
"""


def test_a_behaviour_in_a_file_runs(tmp_path: Path) -> None:
    path = tmp_path / "brightness.py"
    path.write_text(PLUGIN)
    last = Agent(load_behaviours(str(path))).run(frames(4))
    assert last is not None
    assert last.reports[0].state is ReportState.RAN
    assert last.observation.of("brightness") == (3.0,)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "there is no such file"),
        ("x = 1", "holds no behaviour"),
        ("import nonsense_that_is_not_there", "does not run: ModuleNotFoundError"),
        ("def f(:", "does not run: SyntaxError"),
        ("class A:\n    contract = 3\n", "has no contract"),
        (
            "from visup.agent import Contract\nclass A:\n    contract = Contract('a', ('x',))\n",
            "has no method `perceive`",
        ),
        (
            "from visup.agent import Contract\nclass A:\n    contract = Contract('a', ('x',))\n"
            "    def __init__(self, n): pass\n    def perceive(self, *_): return ()\n",
            "missing 1 required positional argument",
        ),
    ],
)
def test_a_file_without_a_plug_in_is_refused_with_a_message(
    tmp_path: Path, text: str | None, message: str
) -> None:
    path = tmp_path / "plugin.py"
    if text is not None:
        path.write_text(text)
    with pytest.raises(BehaviourError, match=message):
        load_behaviours(str(path))


def test_installed_behaviours_are_found_by_entry_point() -> None:
    assert {"motion", "shape", "depth", "health"} <= set(discover_behaviours().names())


def test_an_unknown_name_lists_the_known_ones() -> None:
    registry = Registry()
    registry.add("eye", lambda: Scripted("eye", ("x",)))
    with pytest.raises(BehaviourError) as caught:
        registry.make("nose")
    assert "eye" in str(caught.value)
    with pytest.raises(BehaviourError, match="already"):
        registry.add("eye", lambda: Scripted("eye", ("x",)))


def test_entry_points_of_another_class_are_loaded_too() -> None:
    """Any package that imports the backport `importlib_metadata` changes the class of all entry points."""

    class BackportPoint(NamedTuple):
        name: str
        value: str

        def load(self) -> Callable[[], Scripted]:
            return lambda: Scripted("eye", ("x",))

    registry = Registry()
    registry.add_entry_point(cast("EntryPoint", BackportPoint("eye", "eyes:Eye")))
    assert registry.where("eye") == "eyes:Eye"
    assert registry.make("eye").contract.name == "eye"
