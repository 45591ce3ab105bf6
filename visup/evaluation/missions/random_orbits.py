"""`visup eval orbits`: random missions in orbit are rendered, supervised, scored and discarded.

The models are all generated meshes except those of `UNKNOWN_MESHES` and `SCENERY_MESHES`, which are
correctly identified as unknown. The arm is known by silhouettes from missions that are not scored.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.evaluation.figures import Progress, silent
from visup.evaluation.missions.runner import evaluate_missions, mission_total
from visup.evaluation.workers import each_in_processes

SEED_STRIDE = 10_000
"""Distance between the mission seeds of two evaluation seeds."""

SCENERY_MESHES = ("sill", "slab", "payload_bay")
"""Meshes that are never identified."""

_ARM_SEEDS = range(9_000_000, 9_000_024)
_ARM_FRAME_STEP = 25
_ARM_EXEMPLARS = 32


def evaluate_orbits(
    *,
    count: int = 20,
    seed: int = 0,
    width: int = 480,
    limit: int | None = None,
    workers: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Figures of `evaluate_missions` on random missions in orbit.

    Args:
        count: Number of missions.
        seed: Random seed.
        width: Image width, pixels; the height is three quarters of it.
        limit: Maximum frames of each mission.
        workers: Worker processes; None for one per core.
        progress: Shows what is being done.

    Returns:
        {"total": {...}, "items": {mission: {...}}}, the keys of `evaluate_missions` and the true verdict.

    Raises:
        ExtraMissingError: The renderer is not installed.
    """
    seeds = [seed * SEED_STRIDE + k for k in range(count)]
    items: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory() as scratch:
        progress("building a database")
        models = orbit_models(Path(scratch))
        for name, scores in _scored(seeds, models, (width, limit), workers):
            items[name] = scores
            progress(f"{len(items)} of {count} missions")
    ordered = dict(sorted(items.items()))
    return {"total": mission_total(list(ordered.values())), "items": ordered}


def orbit_models(folder: Path, jobs: int = 1) -> Path:
    """Build the model database for random missions.

    Args:
        folder: Folder for the database and its sources.
        jobs: Number of processes.
    """
    from visup.percepts.shape.building.database_builder import build_database
    from visup.render.meshes.spacecraft import MESHES, write_meshes
    from visup.render.orbits.unexpected_objects import UNKNOWN_MESHES

    files = write_meshes(sorted(set(MESHES) - {*UNKNOWN_MESHES, *SCENERY_MESHES}), folder)
    path = folder / "orbit.models"
    build_database(path, files, {"arm": _arm_masks()}, clusters=_ARM_EXEMPLARS, jobs=jobs)
    return path


def _arm_masks() -> list[NDArray[np.bool_]]:
    """Silhouettes of the arm in missions of other seeds, (H, W) bool each."""
    from visup.render.imaging.renderer import Renderer
    from visup.render.orbits.random_orbit import ARM, random_orbit

    masks = []
    for seed in _ARM_SEEDS:
        renderer = Renderer(random_orbit(seed, "ok", (320, 240)))
        frames = range(0, renderer.scenario.frame_count, _ARM_FRAME_STEP)
        masks += [renderer.mask(frame) == ARM for frame in frames]
    return masks


def _scored(
    seeds: Sequence[int], models: Path, width_and_limit: tuple[int, int | None], workers: int | None
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Names and figures of missions in order of completion."""
    score = partial(
        score_mission, models=models, width=width_and_limit[0], limit=width_and_limit[1]
    )
    for _, result in each_in_processes(score, seeds, workers or os.cpu_count() or 1):
        yield result


def score_mission(
    seed: int, models: Path, width: int = 480, limit: int | None = None
) -> tuple[str, dict[str, Any]]:
    """Render one mission, supervise it, and discard it.

    Args:
        seed: Seed of the mission.
        models: Model database.
        width: Image width, pixels.
        limit: Maximum frames; None for all.

    Returns:
        Its name, and its result of `evaluate_missions` with `verdict_true`.
    """
    from visup.render.orbits.random_orbit import random_orbit
    from visup.render.output.writer import write_mission

    scenario = random_orbit(seed, size=(width, width * 3 // 4))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / scenario.name
        write_mission(scenario, folder)
        figures = evaluate_missions(folder, models=models, limit=limit)
    scores: dict[str, Any] = figures["items"][scenario.name]
    return scenario.name, scores | {"verdict_true": scenario.truth.verdict}
