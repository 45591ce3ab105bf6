"""The preflight: checks before the first frame whether a run can succeed."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from visup.agent.model.errors import SettingsError
from visup.redaction import redacted
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent, open_video
from visup.tasks import load_tasks
from visup.tasks.grammar.structure import task_actors

if TYPE_CHECKING:
    from visup.agent.cycle.agent import Agent
    from visup.tasks.grammar.nodes import Task


def preflight(settings: WatchSettings) -> Iterator[str]:
    """Open the source, load everything, and yield a line for each finding; warnings come last.

    Args:
        settings: Settings of the run.

    Yields:
        Findings; warnings begin with `WARNING`.

    Raises:
        VisupError: The run cannot begin.
    """
    with open_video(settings) as video:
        frames = "" if video.frame_count is None else f", {video.frame_count} frames"
        width, height = video.size
        yield f"source {video.name}: {width} x {height} pixels, {video.fps:g} frames per second{frames}"
        notes = video.notes
    agent = build_agent(settings)
    try:
        yield from readiness(settings, agent)
        yield from (f"{WARNING}{text}" for text in (*notes, *check_cast(settings, agent)))
    finally:
        agent.close()


WARNING = "warning: "


def check_cast(settings: WatchSettings, agent: Agent, *, answered: bool = False) -> tuple[str, ...]:
    """Check whether the actors of the tasks can be recognised at all.

    Args:
        settings: Settings of the run.
        agent: The agent built from them.
        answered: Whether the operator has identified objects in advance.

    Returns:
        A sentence on each actor that cannot be recognised; none if a user behaviour or the operator may
        identify it.

    Raises:
        SettingsError: No actor of any task can be recognised.
    """
    tasks = [t for name in settings.tasks for t in load_tasks(name)]
    missing = unrecognisable(tasks, agent.mind.actors, agent.models)
    if not missing or answered or settings.behaviours or settings.plugins:
        return ()
    cast = ((t.actor(a), a) for t in tasks for a in task_actors(t))
    required = {actor.spare or name for actor, name in cast if not actor.optional}
    if required and required <= set(missing):
        raise _actors_unknown(settings, tasks, missing)
    return tuple(
        f"It is not known what the actor '{actor}' looks like: the model database has no "
        f"{' or '.join(repr(m) for m in models)}."
        for actor, models in missing.items()
    )


def unrecognisable(
    tasks: Sequence[Task], actors: Mapping[str, tuple[str, ...]], known: Collection[str]
) -> dict[str, tuple[str, ...]]:
    """Actors that are identified only by models, none of which exists.

    Args:
        tasks: All tasks of a run.
        actors: Actor -> bound models.
        known: Names of all existing models.

    Returns:
        Actor -> the missing models.
    """
    missing: dict[str, tuple[str, ...]] = {}
    for task in tasks:
        for actor in task_actors(task):
            kind = task.actor(actor).spare or actor
            models = actors.get(actor) or actors.get(kind) or task.models(actor)
            if models and not set(models) & set(known):
                missing[kind] = models
    return missing


def readiness(settings: WatchSettings, agent: Agent) -> Iterator[str]:
    """The content of a run, a line each: tasks with their stages and actors, models, zones.

    Args:
        settings: Settings of the run.
        agent: The agent built from them.
    """
    actors = agent.mind.actors
    for task in (t for name in settings.tasks for t in load_tasks(name)):
        cast = [f"{a} is {' or '.join(actors.get(a) or task.models(a))}".removesuffix(" is ")
                for a in task_actors(task)]  # fmt: skip
        yield f"task {task.name}: {', '.join(s.name for s in task.stages)}; {', '.join(cast)}"
    if agent.models:
        yield f"models: {', '.join(agent.models)}"
    if agent.mind.zones:
        yield f"zones: {', '.join(z.name for z in agent.mind.zones)}"


def _actors_unknown(
    settings: WatchSettings, tasks: Sequence[Task], lost: Mapping[str, tuple[str, ...]]
) -> SettingsError:
    names = ", ".join(f"`{t.name}`" for t in tasks)
    quoted = ", ".join(f"'{a}'" for a in lost)
    actor, models = next(iter(lost.items()))
    missing = (
        f"{settings.models} has no model of them" if settings.models else "there are no models"
    )
    return SettingsError(
        f"task {names} cannot be followed: it is not known what its actors look like ({quoted}; {missing})",
        expected="a model database that contains them (--models DB), and --actor NAME=MODEL where the "
        f"names differ; or a task that describes them, such as: actor {actor} is red",
        hint=f"outline them once: visup teach {redacted(settings.source)} --models cell.models"
        if not settings.models
        else f"visup models list {settings.models}; then --actor {actor}=MODEL in place of "
        f"{' or '.join(models)}",
    )


def taught_actor_notes(bound: Collection[str], actors: Collection[str]) -> tuple[str, ...]:
    """A sentence on each actor that is bound to a taught model instead of the declared ones."""
    return tuple(
        f"The actor '{actor}' is what was taught as '{actor}': the model database has none of the "
        "models that its task names."
        for actor in actors
        if actor not in bound
    )
