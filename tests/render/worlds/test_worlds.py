"""Random worlds: the same seed gives the same bytes, and every file can be read back and holds together."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.evaluation.machines.clips import clip_folders, read_brief, read_truth
from visup.render.worlds.frames import WorldRenderer
from visup.render.worlds.kinds.catalogue import KINDS, random_world
from visup.render.worlds.lesson import lesson
from visup.render.worlds.world import FPS, World
from visup.render.worlds.writer import write_world
from visup.tasks import load_tasks
from visup.tasks.grammar.structure import task_actors

SMALL = (96, 72)
BAD = ("failing", "unsafe")
WAYS = [(kind.name, way) for kind in KINDS.values() for way in kind.outcomes]


def small(world: World) -> World:
    """The world at every 15th of its frames, and few pixels."""
    kept = list(range(0, world.frames, FPS))
    view = world.viewpoint
    turned = replace(view, turns=view.turns[kept], zoom=view.zoom[kept])
    things = [replace(t, poses=t.poses[kept]) if t.moves else t for t in world.things]
    return replace(world, size=SMALL, viewpoint=turned, things=tuple(things), frames=len(kept))


@pytest.fixture(scope="module", params=sorted(KINDS))
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("worlds") / f"{request.param}_world"
    write_world(small(random_world(request.param, 3)), out)
    return out


def read(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def masks(folder: Path) -> list[NDArray[np.uint8]]:
    files = sorted((folder / "masks").glob("*.png"))
    return [np.asarray(cv2.imread(str(f), cv2.IMREAD_GRAYSCALE), np.uint8) for f in files]


def files(folder: Path) -> Iterator[tuple[str, bytes]]:
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        yield path.relative_to(folder).as_posix(), path.read_bytes()


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    first, second = tmp_path / "a" / "world", tmp_path / "b" / "world"
    for out in (first, second):
        world = small(random_world("pick", 5, "drop"))
        write_world(replace(world, frames=3), out)
    assert dict(files(first)) == dict(files(second))


def test_frames_do_not_depend_on_those_before() -> None:
    world = small(random_world("charge", 2))
    forth = WorldRenderer(world)
    forth.picture(0)
    assert (forth.picture(4).image == WorldRenderer(world).picture(4).image).all()


def test_a_world_is_read_as_shared_ones_are(folder: Path) -> None:
    brief, truth = read_brief(folder), read_truth(folder)
    assert {o.name for o in brief.actors} == set(read(folder / "truth.json")["roles"])
    assert truth.stages
    tasks = load_tasks(brief.task)
    assert {a for t in tasks for a in task_actors(t)} <= {o.name for o in brief.actors}


def test_the_video_and_the_masks_have_a_picture_for_each_frame(folder: Path) -> None:
    count = len(read(folder / "truth.json")["frames"])
    video = cv2.VideoCapture(str(folder / "video.mp4"))
    read_back = 0
    while video.read()[0]:
        read_back += 1
    assert (read_back, len(masks(folder))) == (count, count)


def test_masks_hold_labels_alone_and_none_that_means_unscored(folder: Path) -> None:
    labels = set(read(folder / "truth.json")["labels"].values())
    assert 128 not in labels
    assert all(set(np.unique(m)) <= labels | {0} for m in masks(folder))


def test_outlines_lie_in_the_picture_and_on_their_thing(folder: Path) -> None:
    truth = read(folder / "truth.json")
    for actor, shown in read(folder / "brief.json")["teach"].items():
        corners = np.array(shown["polygon"])
        assert (corners >= 0).all()
        assert (corners < SMALL).all()
        drawn = cv2.fillPoly(np.zeros(SMALL[::-1], np.uint8), [corners], 1) > 0
        seen = masks(folder.parent / shown["clip"])
        thing = seen[shown["frame"]] == truth["labels"][truth["roles"][actor]]
        assert np.count_nonzero(drawn & thing) > 0.5 * np.count_nonzero(drawn)


@pytest.mark.parametrize(("kind", "way"), WAYS)
@pytest.mark.parametrize("seed", [0, 1])
def test_truth_holds_together(kind: str, way: str, seed: int) -> None:
    world = random_world(kind, seed, way)
    course, end = world.course, world.frames / FPS
    begins = [s.from_s for s in course.stages]
    assert begins == sorted(begins)
    assert all(s.from_s <= s.to_s for s in course.stages)
    assert begins[-1] < end
    bad = [s.outcome in BAD for s in course.stages]
    assert any(bad) == (course.verdict in ("failed", "interrupted"))
    assert not any(bad[:-1])
    assert course.verdict in (course.accept or (course.verdict,))
    assert 8 <= end <= 15 or way == "in_progress"
    actors = set(world.actors)
    assert {c for contact in course.contacts for c in (contact.a, contact.b)} <= actors
    assert all(len(t.poses) in (1, *range(world.frames, 400)) for t in world.things)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_stage_of_the_truth_is_in_the_task_file(kind: str) -> None:
    for way in KINDS[kind].outcomes:
        world = random_world(kind, 7, way)
        assert all(f"<{s.stage}>" in world.task_text for s in world.course.stages)


def test_things_may_be_shown_on_another_day(tmp_path: Path) -> None:
    worlds = (small(random_world("conveyor", seed, "ok")) for seed in range(20))
    world = next(w for w in worlds if lesson(w) is not None)
    write_world(replace(world, size=(240, 180)), tmp_path / "w")
    taught = read(tmp_path / "w" / "brief.json")["teach"]
    assert {shown["clip"] for shown in taught.values()} == {"w-shown"}
    frames = masks(tmp_path / "w-shown")
    assert len(frames) == len(taught)
    assert len(clip_folders(tmp_path)) == 1


def test_what_does_not_exist_is_refused() -> None:
    with pytest.raises(SettingsError, match="no kind"):
        random_world("knitting", 0)
    with pytest.raises(SettingsError, match="cannot go"):
        random_world("pick", 0, "explode")
