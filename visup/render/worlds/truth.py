"""`truth.json` and `brief.json` of a random world, in the format of the shared worlds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.render.output.truth import presence_events
from visup.render.worlds.world import FPS, World

BOX_INTERVAL = 10
"""Frames from one set of boxes to the next."""

TOLERANCE_S = 0.7
MIN_VISIBLE_SHARE = 0.3
"""A object of which less than this share is visible has no box."""

Mask = NDArray[np.uint8]


def world_truth(world: World, frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The content of ``truth.json``; frames from `frame_truth`."""
    truth = world.truth
    return {
        "mission": world.name,
        "name": world.name,
        "world": world.kind,
        "outcome": truth.outcome,
        "camera": world.viewpoint.style,
        "verdict": truth.verdict,
        "accept": list(truth.accept or (truth.verdict,)),
        "task": world.task,
        "stages": [_rounded(asdict(s)) for s in truth.stages],
        "contacts": [_rounded(asdict(c)) for c in truth.contacts],
        "moves": [_rounded(asdict(m)) for m in truth.moves],
        "alerts": [{"kind": k, "from_s": round(s, 2)} for k, s in truth.alerts.items()],
        "fps": FPS,
        "size": list(world.size),
        "duration_s": round(world.frames / FPS, 3),
        "labels": world.labels,
        "roles": dict(world.actors),
        "tolerance_s": TOLERANCE_S,
        "events": [
            e
            for name in world.labels
            if _ever_in_view(name, frames)
            for e in presence_events(name, frames)
        ],
        "boxes": [_boxes(world, f) for f in frames[::BOX_INTERVAL]],
        "frames": list(frames),
    }


def world_brief(world: World, teach: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """The content of ``brief.json``: what a supervisor may know."""
    return {
        "name": world.name,
        "family": f"random_{world.kind}",
        "task": f"{world.task}.task",
        "fov_vertical_deg": round(world.viewpoint.fov_vertical_deg, 3),
        "teach": dict(teach),
    }


def outline(mask: NDArray[np.bool_], rng: np.random.Generator) -> list[list[int]]:
    """The outline that a user would draw around the largest component of a mask.

    Args:
        mask: (H, W); not empty.
        rng: Draws the inaccuracy of the outline.

    Returns:
        Corners [x, y] in pixels, within the image.
    """
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = max(found, key=cv2.contourArea)
    smooth = cv2.approxPolyDP(largest, 1.0, True).reshape(-1, 2)
    drawn = smooth + rng.uniform(-0.8, 0.8, smooth.shape)
    limit = np.array(mask.shape[::-1]) - 1
    return [[int(x), int(y)] for x, y in np.clip(np.rint(drawn), 0, limit)]


def best_visible_frame(
    name: str, frames: Sequence[Mapping[str, Any]], size: tuple[int, int]
) -> int:
    """The first frame in which a object is about as visible as it ever is.

    Args:
        name: The object.
        frames: From `frame_truth`.
        size: Width and height.

    Returns:
        Index of the frame; the one that shows most of it if it is always truncated or hidden.
    """
    score = np.array([_visibility_score(f[name], size) for f in frames])
    return int(np.flatnonzero(score >= 0.9 * score.max())[0])


def _visibility_score(record: Mapping[str, Any], size: tuple[int, int]) -> float:
    """Visible pixels, with a penalty for occlusion and truncation."""
    visible = float(record["visible_px"])
    if not visible:
        return 0.0
    x, y, w, h = record["bbox"]
    cut = x <= 0 or y <= 0 or x + w >= size[0] or y + h >= size[1]
    return visible * (visible / max(float(record["amodal_px"]), 1.0)) ** 2 * (0.5 if cut else 1.0)


def _ever_in_view(name: str, frames: Sequence[Mapping[str, Any]]) -> bool:
    return any(f[name]["amodal_px"] for f in frames)


def _boxes(world: World, frame: Mapping[str, Any]) -> dict[str, Any]:
    """Boxes of actors in a frame: null when out of view, absent when hidden."""
    out: dict[str, Any] = {"frame": frame["index"]}
    for actor, name in world.actors.items():
        record = frame[name]
        if not record["amodal_px"]:
            out[actor] = None
        elif record["visible_px"] > MIN_VISIBLE_SHARE * record["amodal_px"]:
            out[actor] = record["bbox"]
    return out


def _rounded(record: dict[str, Any]) -> dict[str, Any]:
    return {k: round(v, 2) if isinstance(v, float) else v for k, v in record.items()}
