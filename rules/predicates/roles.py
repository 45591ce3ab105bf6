"""Who takes part in the tasks: actors and bystanders."""

from __future__ import annotations

from visup.rules.predicates.snapshot import Codes, Snapshot


def is_actor(facts: Snapshot) -> Codes:
    """Whether an object plays an actor of an active task."""
    bound = {b.object_id for task in facts.mind.tasks for b in task.bindings}
    return facts.codes_of_ids(bound)


def is_bystander(facts: Snapshot) -> Codes:
    """Whether a task tolerates an object, and none uses it as an actor."""
    tasks = facts.mind.tasks
    actors = {b.object_id for task in tasks for b in task.bindings}
    return facts.codes_of_ids({i for task in tasks for i in task.bystanders} - actors)
