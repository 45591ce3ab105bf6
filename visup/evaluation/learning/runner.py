"""`visup eval learning`: tasks learned from a few good runs of random missions, judged on others.

Of each kind of world some that go well are watched, a task is learned from them, and it judges further ones,
that go well and that go wrong, none of which it has seen. What is cut short is not judged.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from visup.agent import Verdict
from visup.agent.model.errors import TaskError
from visup.evaluation.figures import Progress, each_in_processes, silent, sums_of
from visup.evaluation.learning.worlds import world_minds
from visup.render.worlds.kinds.catalogue import KINDS, known_kinds, random_world
from visup.tasks import parse_task
from visup.tasks.grammar.conditions import action_of, facts_of
from visup.tasks.grammar.nodes import Action, Actors, Comparison, Conditioned, Task, walk
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.judging import judged
from visup.tasks.learning.traces import trace_of

if TYPE_CHECKING:
    from visup.render.worlds.world import World

MISSIONS = ("pick", "charge", "fetch", "boats", "bench")
"""Kinds in which things meet that a camera sees meet. The others: a parcel is hidden by its bin, a payload
is not told from the hand that holds it, a crane is above its truck from the start in the image, the one who
inspects meets nobody, and who walks is alone."""
SEEDS_APART = 10_000
MOST_DRAWN = 40
"""Worlds of a kind are drawn so many times for each that is wanted, until their actors are the same."""
NOT_OVER = "in_progress"
KEYS = ("accepted", "good", "refused", "bad")


@dataclass(frozen=True, slots=True)
class LearningTrial:
    """One kind of world, and how many of it are watched.

    Attributes:
        kind: Of world.
        seed: Of all that is drawn.
        taught: Good runs that the task is learned from.
        others: Further good runs, and as many bad ones.
    """

    kind: str
    seed: int
    taught: int
    others: int


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
        kinds: Of worlds; `MISSIONS` when empty.
        runs: Good runs that each task is learned from.
        count: Further good runs of each kind, and as many bad ones.
        seed: Of all worlds.
        workers: Processes that share the work; as many as there are cores when None.
        progress: Shows what is being done.

    Returns:
        `items` by kind with `accepted` of `good`, `refused` of `bad`, `unlike`: how many actions one of the
        learned and the written task has and the other not, `task` and the runs that are judged wrong;
        `total`; `missions_held`: kinds in which all good and nine of ten bad runs are judged right.

    Raises:
        SettingsError: There is no kind of a name.
    """
    trials = [LearningTrial(k, seed, runs, count) for k in known_kinds(kinds or MISSIONS)]
    items: dict[str, Any] = {}
    for trial, figures in each_in_processes(evaluate_kind, trials, workers or os.cpu_count() or 1):
        items[trial.kind] = figures
        progress(f"{trial.kind}: {figures['accepted']} of {figures['good']} accepted")
    ordered = {t.kind: items[t.kind] for t in trials}
    held = sum(
        f["accepted"] == f["good"] and f["refused"] >= 0.9 * f["bad"] for f in ordered.values()
    )
    total = {**sums_of(list(ordered.values()), KEYS), "missions": len(ordered), "held": held}
    return {"total": total, "items": ordered}


def evaluate_kind(trial: LearningTrial) -> dict[str, Any]:
    """Learn one task and judge further runs by it."""
    good = worlds_of(trial.kind, trial.seed, ("ok",), trial.taught + trial.others)
    actors = set(good[0].actors)
    bad = worlds_of(trial.kind, trial.seed + 1, bad_outcomes(trial.kind), trial.others, actors)
    taught, others = good[: trial.taught], good[trial.taught :]
    figures: dict[str, Any] = {"good": len(others), "bad": len(bad), "accepted": 0, "refused": 0}
    try:
        learned = learn_task("task", [trace_of(w.name, world_minds(w)) for w in taught])
    except TaskError as fault:
        return {**figures, "failed": str(fault), "wrong": []}
    task = parse_task(learned.text)
    wrong = []
    for world in (*others, *bad):
        success = judged(task, world_minds(world)).verdict is Verdict.SUCCEEDED
        meant = world.course.outcome == "ok"
        figures["accepted" if meant else "refused"] += success == meant
        wrong += [] if success == meant else [world.name]
    unlike = len(actions_of(task) ^ actions_of(parse_task(taught[0].task_text)))
    return {**figures, "unlike": unlike, "task": learned.text, "wrong": wrong}


def bad_outcomes(kind: str) -> tuple[str, ...]:
    """The ways in which a world of a kind goes wrong."""
    found = []
    for outcome in KINDS[kind].outcomes[1:]:
        verdict = random_world(kind, 0, outcome).course.verdict
        found += [outcome] if verdict not in ("succeeded", NOT_OVER) else []
    return tuple(found)


def worlds_of(
    kind: str,
    seed: int,
    outcomes: Sequence[str],
    count: int,
    actors: set[str] | None = None,
) -> list[World]:
    """Worlds of one mission: with the same actors, those of the first one unless they are given.

    Args:
        kind: Of world.
        seed: Each has numbers of its own.
        outcomes: They take turns.
        count: How many.
        actors: Who plays in them.
    """
    found: list[World] = []
    for number in range(MOST_DRAWN * count):
        outcome = outcomes[len(found) % len(outcomes)]
        world = random_world(kind, SEEDS_APART * seed + number, outcome)
        actors = actors or set(world.actors)
        if set(world.actors) == actors:
            found.append(world)
        if len(found) == count:
            break
    return found


def actions_of(task: Task) -> set[tuple[str, frozenset[str]]]:
    """The actions that a task asks for, with their actors."""
    return {(a.name, frozenset(map(str, a.words))) for a in map(action_of, _facts(task))}


def _facts(task: Task) -> Iterator[Any]:
    for stage in task.stages:
        for course in () if isinstance(stage.body, Actors) else walk(stage.body):
            if isinstance(course, Action | Comparison):
                yield course
            elif isinstance(course, Conditioned):
                yield from (f for s in course.conditions for f in facts_of(s.condition))
