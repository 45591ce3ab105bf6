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
from visup.render.worlds.teaching_clip import teaching_world
from visup.render.worlds.truth import best_visible_frame, outline, world_brief, world_truth
from visup.render.worlds.world import FPS, World
from visup.render.worlds.world_renderer import WorldRenderer

Masks = list[NDArray[np.uint8]]
MIN_VISIBLE_PX = 60
"""A object with fewer visible pixels in the second clip is outlined in the clip itself."""


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
            frame = renderer.render(index)
            video.write(frame.image)
            write_mask(out, index, frame.mask)
            frames.append(frame_truth(frame, world.labels))
            masks.append(frame.mask)
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
    best_frames = {
        a: best_visible_frame(name, frames, world.size) for a, name in world.actors.items()
    }
    teach = {a: _outline_record(world, a, index, masks[index]) for a, index in best_frames.items()}
    other = teaching_world(world)
    return teach if other is None else _write_teaching_clip(other, out, best_frames) or teach


def _outline_record(
    world: World, actor: str, index: int, mask: NDArray[np.uint8]
) -> dict[str, Any]:
    label = world.labels[world.actors[actor]]
    rng = np.random.default_rng([world.seed, 1, label])
    return {"clip": world.name, "frame": index, "polygon": outline(mask == label, rng)}


def _write_teaching_clip(world: World, out: Path, best_frames: dict[str, int]) -> dict[str, Any]:
    """Write a clip of only the frames in which objects are well visible; nothing if one of them never is."""
    renderer = WorldRenderer(world)
    rendered = [renderer.render(index) for index in best_frames.values()]
    pairs = list(zip(best_frames, rendered, strict=True))
    labels = {actor: world.labels[name] for actor, name in world.actors.items()}
    if any(np.count_nonzero(p.mask == labels[a]) < MIN_VISIBLE_PX for a, p in pairs):
        return {}
    folder = out.resolve().parent / world.name
    make_clip_folder(folder)
    with ClipWriter(folder / "video.mp4", FPS, world.size) as video:
        for index, frame in enumerate(rendered):
            video.write(frame.image)
            write_mask(folder, index, frame.mask)
    return {a: _outline_record(world, a, index, p.mask) for index, (a, p) in enumerate(pairs)}
