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

SEED_STRIDE = 10_000
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
    trials = plan_trials(kinds, count, seed, RandomTrial("", 0, eyes, baseline, limit))
    worlds: dict[str, dict[str, Any]] = {}
    processes = workers or os.cpu_count() or 1
    for _, (name, scores) in each_in_processes(score_world, trials, processes):
        worlds[name] = scores
        progress(f"{len(worlds)} of {count} worlds")
    ordered = dict(sorted(worlds.items()))
    tried_kinds = dict.fromkeys(t.kind for t in trials)
    by_kind = {kind: [w for w in ordered.values() if w["kind"] == kind] for kind in tried_kinds}
    items = {
        kind: machine_total(scores_of_kind)
        for kind, scores_of_kind in by_kind.items()
        if scores_of_kind
    }
    figures = {"total": machine_total(list(ordered.values())), "items": items, "worlds": ordered}
    baselines = [w["baseline"] for w in ordered.values() if "baseline" in w]
    return figures | ({"baseline": machine_total(baselines)} if baselines else {})


def plan_trials(
    kinds: Sequence[str], count: int, seed: int, template: RandomTrial
) -> tuple[RandomTrial, ...]:
    """The planned trials: kinds in turn, each world with its own seed.

    Args:
        kinds: Kinds of worlds; all if empty.
        count: Number of worlds.
        seed: Random seed.
        template: Template of the trials.
    """
    from visup.render.worlds.kinds.catalogue import known_kinds

    known = known_kinds(kinds)
    return tuple(
        RandomTrial(
            known[number % len(known)],
            seed * SEED_STRIDE + number,
            template.eyes,
            template.baseline,
            template.limit,
        )
        for number in range(count)
    )


def score_world(trial: RandomTrial) -> tuple[str, dict[str, Any]]:
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
    scores: dict[str, Any] = figures["items"][world.name]
    truth_keys = {"kind": trial.kind, "outcome": truth["outcome"], "accept": truth["accept"]}
    return world.name, scores | truth_keys
