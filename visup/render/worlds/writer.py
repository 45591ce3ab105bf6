"""Writing a random world: video, masks, task file, ``brief.json``, ``truth.json``."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import OutputError
from visup.render.output.truth import frame_truth
from visup.render.output.writer import ClipWriter
from visup.render.worlds.frames import WorldRenderer
from visup.render.worlds.truth import outline, well_seen, world_brief, world_truth
from visup.render.worlds.world import FPS, World

Masks = list[NDArray[np.uint8]]


def write_world(
    world: World, out: Path, progress: Callable[[int, int], None] | None = None
) -> dict[str, Any]:
    """Render a world into a folder.

    Args:
        world: What to render.
        out: Folder, new or empty: ``video.mp4``, ``masks/00000.png``, the task file, ``brief.json``,
            ``truth.json``.
        progress: Told frames done and frames in all.

    Returns:
        What stands in ``truth.json``.

    Raises:
        OutputError: The folder cannot be written, or something is in it already.
    """
    _make_folder(out)
    # Outlines name the clip that they are drawn in by its folder.
    world = replace(world, name=out.resolve().name)
    renderer = WorldRenderer(world)
    frames, masks = [], []
    with ClipWriter(out / "video.mp4", FPS, world.size) as video:
        for index in range(world.frames):
            picture = renderer.picture(index)
            video.write(picture.image)
            _write(
                out / "masks" / f"{index:05d}.png", cv2.imencode(".png", picture.mask)[1].tobytes()
            )
            frames.append(frame_truth(picture, world.labels))
            masks.append(picture.mask)
            if progress is not None:
                progress(index + 1, world.frames)
    truth = world_truth(world, frames)
    brief = world_brief(world, _teach(world, frames, masks))
    _write(out / f"{world.task}.task", world.task_text.encode())
    _write(out / "truth.json", json.dumps(truth).encode())
    _write(out / "brief.json", (json.dumps(brief) + "\n").encode())
    return truth


def _teach(world: World, frames: list[dict[str, Any]], masks: Masks) -> dict[str, Any]:
    """For each actor the clip, the frame and the outline that a user would draw."""
    rng = np.random.default_rng([world.seed, 1])
    teach = {}
    for actor, name in world.actors.items():
        at = well_seen(name, frames, world.size)
        polygon = outline(masks[at] == world.labels[name], rng)
        teach[actor] = {"clip": world.name, "frame": at, "polygon": polygon}
    return teach


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            raise OutputError(
                "the folder is not empty", where=str(out), expected="a new or an empty folder"
            )
        (out / "masks").mkdir()
    except OSError as error:
        raise OutputError(f"the folder cannot be made: {error.strerror}", where=str(out)) from error


def _write(path: Path, data: bytes) -> None:
    try:
        path.write_bytes(data)
    except OSError as error:
        raise OutputError(
            f"the file cannot be written: {error.strerror}", where=str(path)
        ) from error
