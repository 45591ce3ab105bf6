"""`visup eval clips`: rendered clips for cases missing in the shared footage, each with a bar.

The scenarios are in `visup/render/bench`. Their clips are cached, and rendered again when a scenario or the
renderer has changed.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError, SettingsError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.workers import each_in_processes
from visup.render.scenario.library import bench_names, shipped_scenario

DIGEST_FILE = "made-of.txt"
"""File of a cached clip with the digest of its scenario and renderer."""


@dataclass(frozen=True, slots=True)
class Bar:
    """The bar of a clip.

    Attributes:
        j_object: Least mean IoU of each object with its region, in frames with 500 visible pixels, from 2 s
            after the first of these.
        id_switches: Maximum id changes per object.
        ghost: Maximum share of frames with a region where no object is.
    """

    j_object: float = 0.80
    id_switches: int = 0
    ghost: float = 0.01


BARS: Mapping[str, Bar] = {}
"""Bars that differ from the usual one, by clip."""


def evaluate_clips(
    cache: Path,
    names: Sequence[str] = (),
    *,
    workers: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Render missing clips, score the segmenter on them, and compare with the bars.

    Args:
        cache: Folder for the clips; created if missing.
        names: Names of clips; all if empty.
        workers: Worker processes; None for one per core.
        progress: Shows what is being done.

    Returns:
        `items` by clip: the result of `evaluate_motion`, `bar`, and `missed` bars as sentences. `total`:
        means, and how many of all `clips` `passed`.

    Raises:
        SettingsError: There is no clip of a name.
        OutputError: The cache cannot be written.
    """
    chosen = _known_names(names)
    scores: dict[str, dict[str, Any]] = {}
    score = partial(_score, cache=cache)
    for name, clip_scores in each_in_processes(score, chosen, workers or os.cpu_count() or 1):
        scores[name] = clip_scores
        progress(f"{len(scores)} of {len(chosen)} clips")
    items = {name: compare_with_bar(scores[name], bar_of(name)) for name in chosen}
    return {"total": _total(items), "items": items}


def bar_of(name: str) -> Bar:
    """The bar of a clip."""
    return BARS.get(name, Bar())


def compare_with_bar(figures: Mapping[str, Any], bar: Bar) -> dict[str, Any]:
    """Compare the figures of a clip with its bar.

    Args:
        figures: One item of `evaluate_motion`.
        bar: Its bar.

    Returns:
        The figures, `bar`, and `missed`: sentences, empty if passed.
    """
    objects: Mapping[str, Mapping[str, Any]] = figures.get("objects", {})
    missed = [
        f"J of {name} {o['J']:.2f} < {bar.j_object:.2f}"
        for name, o in objects.items()
        if o["J"] < bar.j_object
    ]
    if not objects:
        missed.append("no object was scored")
    switches = figures.get("id_switches", 0)
    if switches > bar.id_switches:
        missed.append(f"{switches} id switches > {bar.id_switches}")
    ghost = figures.get("ghost", 0.0)
    if ghost > bar.ghost:
        missed.append(f"ghosts {ghost:.1%} > {bar.ghost:.0%}")
    return {**figures, "bar": asdict(bar), "missed": missed}


def rendered_clip(name: str, cache: Path) -> Path:
    """The folder of a clip, rendered if missing or outdated.

    Args:
        name: One of `bench_names`.
        cache: Folder for clips.

    Returns:
        A mission folder.

    Raises:
        OutputError: It cannot be written.
    """
    from visup.render.output.writer import write_mission

    folder, digest = cache / name, _render_digest(name)
    digest_file = folder / DIGEST_FILE
    if digest_file.is_file() and digest_file.read_text(encoding="utf-8") == digest:
        return folder
    try:
        if folder.exists():
            shutil.rmtree(folder)
        write_mission(shipped_scenario(f"bench/{name}"), folder)
        # Last, so that a clip whose rendering was interrupted has no mark.
        digest_file.write_text(digest, encoding="utf-8")
    except OSError as error:
        raise OutputError(
            f"the clip cannot be kept: {error.strerror}", where=str(folder)
        ) from error
    return folder


def _render_digest(name: str) -> str:
    """The digest of a scenario and of all rendering code."""
    digest = hashlib.sha256()
    package = resources.files("visup.render")
    folders = (package / folder for folder in ("imaging", "meshes", "scenario"))
    code_files = [f for folder in folders for f in folder.iterdir() if f.name.endswith(".py")]
    code = sorted(code_files, key=str)
    for file in (*code, package / "scenarios" / "bench" / f"{name}.toml"):
        digest.update(file.read_bytes())
    return digest.hexdigest() + "\n"


def _score(name: str, cache: Path) -> dict[str, Any]:
    """The figures of one clip."""
    from visup.evaluation.motion.runner import evaluate_motion

    items: dict[str, dict[str, Any]] = evaluate_motion(rendered_clip(name, cache))["items"]
    return items[name]


def _known_names(names: Sequence[str]) -> tuple[str, ...]:
    known = bench_names()
    for name in names:
        if name not in known:
            raise SettingsError(f"there is no clip {name!r}", expected=f"one of {', '.join(known)}")
    return tuple(dict.fromkeys(names)) or known


def _total(items: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    values = list(items.values())
    total: dict[str, Any] = {}
    for key in ("J", "F", "J_object", "ghost"):
        numbers = [v[key] for v in values if key in v]
        total[key] = sum(numbers) / len(numbers) if numbers else None
    total["id_switches"] = sum(v.get("id_switches", 0) for v in values)
    total["passed"] = sum(not v["missed"] for v in values)
    total["clips"] = len(values)
    return total
