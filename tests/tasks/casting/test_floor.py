"""Zones and distances on the floor, in a task and in a zones file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.rules.scenes import Rect, box_region, seen
from visup.agent import Mind, TaskBelief, Verdict, Zone
from visup.agent.model.errors import SettingsError
from visup.rules.reasoners import default_reasoners
from visup.rules.relations.zones import inside, reaching
from visup.runs.inputs.zones import load_ground, load_zones
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import task_reasoner

GROUND = (
    "ground is (80, 400) = (0 m, 0 m), (560, 400) = (2 m, 0 m), "
    "(420, 200) = (2 m, 3 m), (200, 200) = (0 m, 3 m)\n"
)
BAY = "zone bay is (0.5 m, 0 m) (1.5 m, 0 m) (1.5 m, 3 m) (0.5 m, 3 m)\n"
FILE = """[ground]
image = [[80, 400], [560, 400], [420, 200], [200, 200]]
floor = [[0, 0], [2, 0], [2, 3], [0, 3]]
[[zone]]
name = "bay"
floor = [[0.5, 0], [1.5, 0], [1.5, 3], [0.5, 3]]
"""
# One stands in the bay; the other, as tall, before it: its outline lies over the bay, its feet do not.
WITHIN: Rect = (300, 150, 40, 150)
BEFORE: Rect = (300, 200, 40, 230)


def final_mind(text: str, *rects: Rect, zones: tuple[Zone, ...] = (), seconds: float = 4.0) -> Mind:
    rules, task = default_reasoners(), task_reasoner([parse_task(text)])
    names = {i: [(n, 0.9)] for i, n in enumerate(("truck", "dock"), 1)}
    mind = Mind(zones=zones)
    for i in range(round(seconds * 25)):
        regions = [box_region(n, r) for n, r in enumerate(rects, 1)]
        observation = seen(i, regions, names={r.id: names[r.id] for r in regions if r is not None})
        for reasoner in (*rules.update, *rules.cogitate, task):
            mind = reasoner(mind, observation).mind
    return mind


def task_belief(mind: Mind) -> TaskBelief:
    return mind.tasks[0]


def test_a_body_is_in_a_zone_of_the_floor_where_it_stands() -> None:
    text = GROUND + BAY + "<park> ::= inside(truck, bay)"
    assert task_belief(final_mind(text, WITHIN)).verdict is Verdict.SUCCEEDED
    assert task_belief(final_mind(text, BEFORE)).verdict is not Verdict.SUCCEEDED
    image = "zone bay is (200, 200) (440, 200) (440, 420) (200, 420)\n<park> ::= inside(truck, bay)"
    assert (
        task_belief(final_mind(image, BEFORE)).verdict is Verdict.SUCCEEDED
    )  # by its outline it is


@pytest.mark.parametrize(
    ("limit", "verdict"), [("1.3 m", True), ("120 cm", True), ("0.5 m", False)]
)
def test_gaps_are_compared_in_metres(limit: str, verdict: bool) -> None:
    text = f"{GROUND}<t> ::= gap(truck, dock) < {limit}"
    mind = final_mind(text, (150, 300, 40, 100), (450, 350, 40, 50))
    assert (task_belief(mind).verdict is Verdict.SUCCEEDED) is verdict


def test_a_zones_file_gives_the_same_ground(tmp_path: Path) -> None:
    path = tmp_path / "zones.toml"
    path.write_text(FILE, "utf-8")
    (zone,) = load_zones(path)
    assert zone.on_floor
    mind = final_mind("<t> ::= seen(truck)", WITHIN, zones=(zone,))
    assert inside(mind, 1, "bay") == "true"
    mind = final_mind("<t> ::= seen(truck)", BEFORE, zones=(zone,))
    assert inside(mind, 1, "bay") == reaching(mind, 1, "bay") == "false"
    assert load_ground(path) is not None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FILE.replace("[560, 400]", "[320, 400]").replace("[420, 200]", "[560, 400]"), "line"),
        (FILE.replace("[2, 0], ", ""), "the ground is invalid"),
        (FILE[FILE.index("[[zone") :], "where the floor is"),
        (FILE.replace("floor = [[0.5, 0], ", "floor = [[0.5, 0]]#"), "corners"),
    ],
)
def test_errors_of_a_ground_are_reported(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "zones.toml"
    path.write_text(text, "utf-8")
    with pytest.raises(SettingsError, match=message):
        load_zones(path)


def test_metres_require_a_ground(tmp_path: Path) -> None:
    task, zones = tmp_path / "park.task", tmp_path / "zones.toml"
    task.write_text("<park> ::= gap(truck, dock) < 1 m", "utf-8")
    zones.write_text(FILE, "utf-8")
    with pytest.raises(SettingsError, match="where the floor is"):
        reasoning_agent(WatchSettings("none", tasks=(str(task),)))
    assert reasoning_agent(WatchSettings("none", tasks=(str(task),), zones=zones)).cast == {
        "truck": ("truck",),
        "dock": ("dock",),
    }
