"""Actors that are what was taught under their own name.

An actor that nothing is declared of stands for the model of its own name anyway. One that a task declares
to look like models which the database does not have (`actor station is trex`, written for another scene)
is what was taught as `station`, where something was.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from visup.percepts.shape.database.model_database import ModelDatabase
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import task_actors

Actors = Mapping[str, tuple[str, ...]]


def with_taught_actors(
    tasks: Sequence[Task], given: Actors, database: ModelDatabase | None
) -> dict[str, tuple[str, ...]]:
    """Actors as they were given, and those that are what was taught under their name.

    Args:
        tasks: All tasks of a run.
        given: Actor -> models, as the user bound them; it goes before everything else.
        database: The models, or None.
    """
    actors = dict(given)
    if database is None:
        return actors
    known = set(database.names())
    taught = {view.name for view in database.taught}
    for actor in dict.fromkeys(a for task in tasks for a in task_actors(task)):
        declared = {m for task in tasks if actor in task_actors(task) for m in task.models(actor)}
        if actor not in actors and actor in taught and not declared & known:
            actors[actor] = (actor,)
    return actors


def told_of_taught_actors(given: Actors, actors: Actors) -> tuple[str, ...]:
    """A sentence on each actor that is what was taught, other than its task declares."""
    return tuple(
        f"The actor '{actor}' is what was taught as '{actor}': the model database has none of the "
        "models that its task names."
        for actor in actors
        if actor not in given
    )
