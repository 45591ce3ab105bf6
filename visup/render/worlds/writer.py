"""Writing a random world: video, masks, task file, ``brief.json``, ``truth.json``."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.render.output.clip_folder import (
    ClipWriter,
    make_clip_folder,
    write_file,
    write_mask,
)
from visup.render.output.truth import frame_truth
from visup.render.worlds.frames import WorldRenderer
from visup.render.worlds.lesson import lesson
from visup.render.worlds.truth import outline, well_seen, world_brief, world_truth
from visup.render.worlds.world import FPS, World

Masks = list[NDArray[np.uint8]]
LEAST_PX = 60
"""A thing with fewer visible pixels in the second clip is outlined in the clip itself."""


def write_world(
    world: World, out: Path, progress: Callable[[int, int], None] | None = None
) -> dict[str, Any]:
    """Render a world into a folder.

    Args:
        world: What to render.
        out: Folder, new or empty: ``video.mp4``, ``masks/00000.png``, the task file, ``brief.json``,
            ``truth.json``. A second clip, for outlines, is written next to it.
        progress: Told frames done and frames in all.

    Returns:
        The content of ``truth.json``.

    Raises:
        OutputError: The folder cannot be written, or is not empty.
    """
    make_clip_folder(out)
    # Outlines refer to their clip by its folder.
    world = replace(world, name=out.resolve().name)
    renderer = WorldRenderer(world)
    frames, masks = [], []
    with ClipWriter(out / "video.mp4", FPS, world.size) as video:
        for index in range(world.frames):
            picture = renderer.picture(index)
            video.write(picture.image)
            write_mask(out, index, picture.mask)
            frames.append(frame_truth(picture, world.labels))
            masks.append(picture.mask)
            if progress is not None:
                progress(index + 1, world.frames)
    truth = world_truth(world, frames)
    brief = world_brief(world, _teach(world, out, frames, masks))
    write_file(out / f"{world.task}.task", world.task_text.encode())
    write_file(out / "truth.json", json.dumps(truth).encode())
    write_file(out / "brief.json", (json.dumps(brief) + "\n").encode())
    return truth


def _teach(world: World, out: Path, frames: list[dict[str, Any]], masks: Masks) -> dict[str, Any]:
    """For each actor the clip, the frame and the outline that a user would draw."""
    best = {a: well_seen(name, frames, world.size) for a, name in world.actors.items()}
    teach = {a: _shown(world, a, at, masks[at]) for a, at in best.items()}
    other = lesson(world)
    return teach if other is None else _lesson(other, out, best) or teach


def _shown(world: World, actor: str, at: int, mask: NDArray[np.uint8]) -> dict[str, Any]:
    label = world.labels[world.actors[actor]]
    rng = np.random.default_rng([world.seed, 1, label])
    return {"clip": world.name, "frame": at, "polygon": outline(mask == label, rng)}


def _lesson(world: World, out: Path, best: dict[str, int]) -> dict[str, Any]:
    """Write a clip of only the frames in which things are well visible; nothing if one of them never is."""
    renderer = WorldRenderer(world)
    pictures = [renderer.picture(at) for at in best.values()]
    pairs = list(zip(best, pictures, strict=True))
    labels = {actor: world.labels[name] for actor, name in world.actors.items()}
    if any(np.count_nonzero(p.mask == labels[a]) < LEAST_PX for a, p in pairs):
        return {}
    folder = out.resolve().parent / world.name
    make_clip_folder(folder)
    with ClipWriter(folder / "video.mp4", FPS, world.size) as video:
        for index, picture in enumerate(pictures):
            video.write(picture.image)
            write_mask(folder, index, picture.mask)
    return {a: _shown(world, a, index, p.mask) for index, (a, p) in enumerate(pairs)}
