"""`visup eval random`: random worlds are rendered, watched, scored and discarded."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.evaluation.figures import Progress, silent
from visup.evaluation.machines.runner import evaluate_machines
from visup.evaluation.machines.scores import machine_total
from visup.evaluation.workers import each_in_processes

SEEDS_APART = 10_000
"""Distance between the world seeds of two evaluation seeds."""


@dataclass(frozen=True, slots=True)
class RandomTrial:
    """One world and how it is watched.

    Attributes:
        kind: Kind of world.
        seed: Seed of the world.
        eyes: Whether masks replace perception.
        baseline: Whether to evaluate CSRT, too.
        limit: Maximum frames; None for all.
    """

    kind: str
    seed: int
    eyes: bool = False
    baseline: bool = False
    limit: int | None = None


def evaluate_random(
    *,
    kinds: Sequence[str] = (),
    count: int = 60,
    seed: int = 0,
    eyes: bool = False,
    baseline: bool = False,
    limit: int | None = None,
    workers: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Figures of `evaluate_machines` on random worlds.

    Args:
        kinds: Kinds of worlds, evenly distributed; all if empty.
        count: Number of worlds.
        seed: Random seed.
        eyes: Whether masks replace perception.
        baseline: Whether to evaluate CSRT, too.
        limit: Maximum frames of each world.
        workers: Worker processes; None for one per core.
        progress: Shows what is being done.

    Returns:
        `items` by kind, `total`, and `worlds` by name: the result of each.

    Raises:
        SettingsError: There is no kind of a name.
    """
    trials = planned(kinds, count, seed, RandomTrial("", 0, eyes, baseline, limit))
    worlds: dict[str, dict[str, Any]] = {}
    shares = workers or os.cpu_count() or 1
    for _, (name, scores) in each_in_processes(score, trials, shares):
        worlds[name] = scores
        progress(f"{len(worlds)} of {count} worlds")
    ordered = dict(sorted(worlds.items()))
    watched = dict.fromkeys(t.kind for t in trials)
    by_kind = {kind: [w for w in ordered.values() if w["kind"] == kind] for kind in watched}
    items = {kind: machine_total(found) for kind, found in by_kind.items() if found}
    figures = {"total": machine_total(list(ordered.values())), "items": items, "worlds": ordered}
    rivals = [w["baseline"] for w in ordered.values() if "baseline" in w]
    return figures | ({"baseline": machine_total(rivals)} if rivals else {})


def planned(
    kinds: Sequence[str], count: int, seed: int, like: RandomTrial
) -> tuple[RandomTrial, ...]:
    """The planned trials: kinds in turn, each world with its own seed.

    Args:
        kinds: Kinds of worlds; all if empty.
        count: Number of worlds.
        seed: Random seed.
        like: Template of the trials.
    """
    from visup.render.worlds.kinds.catalogue import known_kinds

    known = known_kinds(kinds)
    return tuple(
        RandomTrial(
            known[number % len(known)],
            seed * SEEDS_APART + number,
            like.eyes,
            like.baseline,
            like.limit,
        )
        for number in range(count)
    )


def score(trial: RandomTrial) -> tuple[str, dict[str, Any]]:
    """Render one world, watch it, and discard it.

    Returns:
        Its name, and its result of `evaluate_machines` with `kind`, `outcome` and the true `verdict_true`.
    """
    from visup.render.worlds.kinds.catalogue import random_world
    from visup.render.worlds.writer import write_world

    world = random_world(trial.kind, trial.seed)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / world.name
        truth = write_world(world, folder)
        figures = evaluate_machines(
            folder, eyes=trial.eyes, baseline=trial.baseline, limit=trial.limit
        )
    told: dict[str, Any] = figures["items"][world.name]
    extra = {"kind": trial.kind, "outcome": truth["outcome"], "accept": truth["accept"]}
    return world.name, told | extra
