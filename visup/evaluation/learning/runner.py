"""`visup eval learning`: tasks learned from a few good runs of random missions, judged on others.

For each kind of world a task is learned from a few good runs and judges further good and bad runs, none of
which it has seen. Interrupted runs are excluded.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from visup.agent import Verdict
from visup.agent.model.errors import TaskError
from visup.evaluation.figures import Progress, silent, sums_of
from visup.evaluation.learning.worlds import world_minds
from visup.evaluation.workers import each_in_processes
from visup.render.worlds.kinds.catalogue import KINDS, known_kinds, random_world
from visup.rules.predicates.vocabulary import IMPLIED_BY
from visup.tasks import parse_task
from visup.tasks.analysis.judging import judged
from visup.tasks.analysis.languages import ActorsAction, actions_of
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.traces import trace_of

if TYPE_CHECKING:
    from visup.render.worlds.world import World

MISSIONS = ("pick", "charge", "fetch", "boats", "bench")
"""Kinds whose meetings are visible to a camera. In the others a parcel is hidden by its bin, a payload
cannot be told from the hand that holds it, a crane is above its truck in the image from the start, an
inspector meets nobody, and a walker is alone."""
SEED_STRIDE = 10_000
"""Offset between the seeds of two draws, so that their worlds differ."""
MAX_DRAWS = 40
"""Most draws for each world wanted, until enough have the same actors."""
IN_PROGRESS = "in_progress"
COUNT_KEYS = ("accepted", "good", "refused", "bad")


@dataclass(frozen=True, slots=True)
class LearningTrial:
    """One kind of world, and its numbers of runs.

    Attributes:
        kind: Kind of world.
        seed: Seed of all draws.
        training_runs: Good runs that the task is learned from.
        test_runs: Further good runs, and as many bad ones.
    """

    kind: str
    seed: int
    training_runs: int
    test_runs: int


def evaluate_learning(
    *,
    kinds: Sequence[str] = (),
    runs: int = 3,
    count: int = 10,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Learn tasks and judge further runs by them.

    Args:
        kinds: Kinds of worlds; `MISSIONS` when empty.
        runs: Good runs that each task is learned from.
        count: Further good runs of each kind, and as many bad ones.
        seed: Seed of all worlds.
        workers: Processes that share the work; as many as there are cores when None.
        progress: Receives progress messages.

    Returns:
        `items` by kind with `accepted` of `good`, `refused` of `bad`, `unlike`: number of actions in which
        the learned and the written task differ, `unlike_in_meaning`: of these, those that no action of the
        other task implies, `task`, and `wrong`: runs that are misjudged; `total`, with
        `held` of `missions`: kinds in which all good and at least nine of ten bad runs are judged right.

    Raises:
        SettingsError: A kind is unknown.
    """
    trials = [LearningTrial(k, seed, runs, count) for k in known_kinds(kinds or MISSIONS)]
    items: dict[str, Any] = {}
    for trial, figures in each_in_processes(evaluate_kind, trials, workers or os.cpu_count() or 1):
        items[trial.kind] = figures
        progress(f"{trial.kind}: {figures['accepted']} of {figures['good']} accepted")
    ordered = {t.kind: items[t.kind] for t in trials}
    passed = sum(
        f["accepted"] == f["good"] and f["refused"] >= 0.9 * f["bad"] for f in ordered.values()
    )
    total = {
        **sums_of(list(ordered.values()), COUNT_KEYS),
        "missions": len(ordered),
        "held": passed,
    }
    return {"total": total, "items": ordered}


def evaluate_kind(trial: LearningTrial) -> dict[str, Any]:
    """Learn one task and judge further runs by it."""
    good = worlds_of(trial.kind, trial.seed, ("ok",), trial.training_runs + trial.test_runs)
    actors = set(good[0].actors)
    test_bad = worlds_of(
        trial.kind, trial.seed + 1, bad_outcomes(trial.kind), trial.test_runs, actors
    )
    training, test_good = good[: trial.training_runs], good[trial.training_runs :]
    figures: dict[str, Any] = {
        "good": len(test_good),
        "bad": len(test_bad),
        "accepted": 0,
        "refused": 0,
    }
    try:
        learned = learn_task("task", [trace_of(w.name, world_minds(w)) for w in training])
    except TaskError as error:
        return {**figures, "failed": str(error), "wrong": []}
    task = parse_task(learned.text)
    wrong = []
    for world in (*test_good, *test_bad):
        success = judged(task, world_minds(world)).verdict is Verdict.SUCCEEDED
        should_succeed = world.truth.outcome == "ok"
        figures["accepted" if should_succeed else "refused"] += success == should_succeed
        wrong += [] if success == should_succeed else [world.name]
    actions, written = actions_of(task), actions_of(parse_task(training[0].task_text))
    differences = {
        "unlike": len(actions ^ written),
        "unlike_in_meaning": len(not_implied(actions, written) | not_implied(written, actions)),
    }
    return {**figures, **differences, "task": learned.text, "wrong": wrong}


def bad_outcomes(kind: str) -> tuple[str, ...]:
    """The outcomes with which a world of a kind fails."""
    outcomes = []
    for outcome in KINDS[kind].outcomes[1:]:
        verdict = random_world(kind, 0, outcome).truth.verdict
        outcomes += [outcome] if verdict not in ("succeeded", IN_PROGRESS) else []
    return tuple(outcomes)


def worlds_of(
    kind: str,
    seed: int,
    outcomes: Sequence[str],
    count: int,
    actors: set[str] | None = None,
) -> list[World]:
    """Worlds of one mission, all with the same actors: the given ones or those of the first world.

    Args:
        kind: Kind of world.
        seed: Different seeds give different worlds.
        outcomes: Outcomes, used in turn, without those that these actors cannot have.
        count: How many.
        actors: Actors of the worlds.
    """
    worlds: list[World] = []
    remaining, failed_draws = list(outcomes), 0
    for number in range(MAX_DRAWS * count):
        if (
            failed_draws == MAX_DRAWS and len(remaining) > 1
        ):  # this outcome only comes with other actors
            remaining.remove(remaining[len(worlds) % len(remaining)])
            failed_draws = 0
        outcome = remaining[len(worlds) % len(remaining)]
        world = random_world(kind, SEED_STRIDE * seed + number, outcome)
        actors = actors or set(world.actors)
        failed_draws += 1
        if set(world.actors) == actors:
            worlds.append(world)
            failed_draws = 0
        if len(worlds) == count:
            break
    return worlds


def not_implied(actions: set[ActorsAction], others: set[ActorsAction]) -> set[ActorsAction]:
    """The actions that none of the others is or implies: who is coupled touches and moves together.

    >>> pair = frozenset({"gripper", "part"})
    >>> not_implied({("touching", pair), ("diverging", pair)}, {("coupled", pair)}) == {("diverging", pair)}
    True
    """
    return {
        (name, actors)
        for name, actors in actions
        if not any((n, actors) in others for n in IMPLIED_BY.get(name, frozenset({name})))
    }
