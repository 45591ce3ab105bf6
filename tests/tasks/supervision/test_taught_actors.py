"""Actors that are what was taught under their name, and those that are not."""

from __future__ import annotations

from pathlib import Path

import pytest

import visup
from tests.teaching.clips import corners, frame, write_clip
from visup.percepts.shape.building.database_builder import silhouette_views
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.tasks import load_tasks
from visup.tasks.grammar.structure import with_taught_actors

TASK = """{declared}
<inspect> ::= <approach>
<approach> ::= converging(inspector, station)
"""


@pytest.fixture
def database(tmp_path: Path) -> ModelDatabase:
    """Knows 'station' and 'inspector' by outlines, 'hubble' by a silhouette."""
    models = visup.teach(
        frame(0), {"station": corners(0), "inspector": corners(50)}, models=tmp_path / "a.models"
    )
    mask = frame(0)[:, :, 2] > 200
    return models.add(silhouette_views("hubble", [mask], 1))


@pytest.mark.parametrize(
    ("declared", "given", "expected"),
    [
        ("", {}, {}),
        ("actor station is trex", {}, {"station": ("station",)}),
        ("actor station is trex or hubble", {}, {}),
        ("actor station is hubble", {}, {}),
        ("actor station is station", {}, {}),
        ("actor station is trex", {"station": ("hubble",)}, {"station": ("hubble",)}),
        ("actor station size 2 m", {}, {}),
        ("actor station is red", {}, {}),
        ("actor station at (410, 160)", {}, {}),
        (
            "actor station is trex\nactor inspector is helicopter",
            {},
            {"station": ("station",), "inspector": ("inspector",)},
        ),
    ],
)
def test_an_actor_is_the_taught_object_of_its_name_by_default(
    database: ModelDatabase,
    tmp_path: Path,
    declared: str,
    given: dict[str, tuple[str, ...]],
    expected: dict[str, tuple[str, ...]],
) -> None:
    path = tmp_path / "inspect.task"
    path.write_text(TASK.format(declared=declared))
    tasks, taught = load_tasks(str(path)), {v.name for v in database.taught}
    assert with_taught_actors(tasks, given, database.names(), taught) == expected
    assert with_taught_actors(tasks, given, (), ()) == given


def test_the_default_model_is_reported_and_recorded(
    database: ModelDatabase, tmp_path: Path
) -> None:
    task = tmp_path / "inspect.task"
    task.write_text(TASK.format(declared="actor station is trex"))
    clip = write_clip(tmp_path / "clip.avi", 3)
    run = visup.watch(clip, task=task, models=database, out=tmp_path / "run").finish()
    assert run.result is not None
    assert any("'station' is what was taught" in note for note in run.result.notes)
    assert visup.open_run(tmp_path / "run").settings.actors == {"station": ("station",)}
