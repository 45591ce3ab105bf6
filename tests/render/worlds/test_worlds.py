"""Random worlds: they are deterministic, and their files are readable and consistent."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.evaluation.machines.clips import clip_folders, read_brief, read_truth
from visup.render.worlds.kinds.catalogue import KINDS, random_world
from visup.render.worlds.teaching_clip import teaching_world
from visup.render.worlds.viewpoint import first_in_view, fixed_camera, project, sees_all
from visup.render.worlds.world import FPS, SIZE, World
from visup.render.worlds.world_renderer import WorldRenderer
from visup.render.worlds.writer import write_world
from visup.tasks import load_tasks
from visup.tasks.grammar.structure import task_actors

SMALL = (96, 72)
BAD = ("failing", "unsafe")
OUTCOMES = [(kind.name, outcome) for kind in KINDS.values() for outcome in kind.outcomes]


def small(world: World) -> World:
    """The world at every 15th frame, with few pixels."""
    indices = list(range(0, world.frames, FPS))
    view = world.viewpoint
    viewpoint = replace(view, rotations_deg=view.rotations_deg[indices], zoom=view.zoom[indices])
    bodies = [replace(t, poses=t.poses[indices]) if t.moves else t for t in world.bodies]
    return replace(
        world, size=SMALL, viewpoint=viewpoint, bodies=tuple(bodies), frames=len(indices)
    )


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


def test_frames_of_worlds_do_not_depend_on_earlier_ones() -> None:
    world = small(random_world("charge", 2))
    renderer = WorldRenderer(world)
    renderer.render(0)
    assert (renderer.render(4).image == WorldRenderer(world).render(4).image).all()


def test_a_world_can_be_read_as_an_evaluation_clip(folder: Path) -> None:
    brief, truth = read_brief(folder), read_truth(folder)
    assert {o.name for o in brief.actors} == set(read(folder / "truth.json")["roles"])
    assert truth.stages
    tasks = load_tasks(brief.task)
    assert {a for t in tasks for a in task_actors(t)} <= {o.name for o in brief.actors}


def test_video_and_masks_have_every_frame(folder: Path) -> None:
    count = len(read(folder / "truth.json")["frames"])
    video = cv2.VideoCapture(str(folder / "video.mp4"))
    read_back = 0
    while video.read()[0]:
        read_back += 1
    assert (read_back, len(masks(folder))) == (count, count)


def test_masks_have_only_labels_and_not_the_unscored_value(folder: Path) -> None:
    labels = set(read(folder / "truth.json")["labels"].values())
    assert 128 not in labels
    assert all(set(np.unique(m)) <= labels | {0} for m in masks(folder))


def test_outlines_are_within_the_image_and_on_their_object(folder: Path) -> None:
    truth = read(folder / "truth.json")
    for actor, outline in read(folder / "brief.json")["teach"].items():
        corners = np.array(outline["polygon"])
        assert (corners >= 0).all()
        assert (corners < SMALL).all()
        drawn = cv2.fillPoly(np.zeros(SMALL[::-1], np.uint8), [corners], 1) > 0
        seen = masks(folder.parent / outline["clip"])
        thing = seen[outline["frame"]] == truth["labels"][truth["roles"][actor]]
        assert np.count_nonzero(drawn & thing) > 0.5 * np.count_nonzero(drawn)


@pytest.mark.parametrize(("kind", "outcome"), OUTCOMES)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_truth_of_every_outcome_is_consistent(kind: str, outcome: str, seed: int) -> None:
    world = random_world(kind, seed, outcome)
    truth, end = world.truth, world.frames / FPS
    begins = [s.from_s for s in truth.stages]
    assert begins == sorted(begins)
    assert all(s.from_s <= s.to_s for s in truth.stages)
    assert begins[-1] < end
    bad = [s.outcome in BAD for s in truth.stages]
    assert any(bad) == (truth.verdict in ("failed", "interrupted"))
    assert not any(bad[:-1])
    assert truth.verdict in (truth.accept or (truth.verdict,))
    assert 8 <= end <= 15 or outcome == "in_progress"
    actors = set(world.actors)
    assert {c for contact in truth.contacts for c in (contact.a, contact.b)} <= actors
    assert all(len(t.poses) in (1, *range(world.frames, 400)) for t in world.bodies)


@pytest.mark.parametrize("seed", [12, 32, 42, 97000012, 97000032])
def test_an_approach_begins_when_it_can_be_seen(seed: int) -> None:
    world = random_world("inspect", seed)
    approach, flight = world.truth.stages[:2]
    craft = next(body for body in world.bodies if body.name == "inspector")
    at = round(approach.from_s * FPS)
    position = project(world.viewpoint, craft.poses[at, :3, 3], SIZE)
    assert ((position > 0) & (position < np.array(SIZE))).all()
    assert approach.from_s < flight.from_s


@given(arrays(float, st.tuples(st.integers(1, 12), st.just(2)), elements=st.floats(-9, 9)))
def test_the_first_frame_in_view_is_found(path: NDArray[np.float64]) -> None:
    view = fixed_camera((0, -10, 0), (0, 0, 0), 40.0, len(path))
    points = np.column_stack([path[:, 0], np.zeros(len(path)), path[:, 1]])
    seen = [k for k, p in enumerate(points) if sees_all(view, [p], SIZE, margin=0.0)]
    assert first_in_view(view, points, SIZE) == (seen[0] if seen else None)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_stage_of_the_truth_is_in_the_task_file(kind: str) -> None:
    for outcome in KINDS[kind].outcomes:
        world = random_world(kind, 7, outcome)
        assert all(f"<{s.stage}>" in world.task_text for s in world.truth.stages)


def test_objects_may_be_outlined_in_another_clip(tmp_path: Path) -> None:
    worlds = (small(random_world("conveyor", seed, "ok")) for seed in range(20))
    world = next(w for w in worlds if teaching_world(w) is not None)
    write_world(replace(world, size=(240, 180)), tmp_path / "w")
    outlines = read(tmp_path / "w" / "brief.json")["teach"]
    assert {outline["clip"] for outline in outlines.values()} == {"w-shown"}
    frames = masks(tmp_path / "w-shown")
    assert len(frames) == len(outlines)
    assert len(clip_folders(tmp_path)) == 1


def test_unknown_kinds_and_outcomes_are_refused() -> None:
    with pytest.raises(SettingsError, match="no kind"):
        random_world("knitting", 0)
    with pytest.raises(SettingsError, match="cannot go"):
        random_world("pick", 0, "explode")
