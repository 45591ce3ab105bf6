"""The arguments of `visup.watch`, checked and converted to settings."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, TypedDict

from pydantic import TypeAdapter, ValidationError

from visup.agent.model.errors import SettingsError
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.runs.settings import WatchSettings
from visup.tasks.grammar.nodes import Task

TaskLike = str | os.PathLike[str] | Task
"""A task file, the name of a shipped task, or a task from `visup.load_task`."""


class WatchOptions(TypedDict, total=False):
    """Further settings of `visup.watch`; `visup.Settings` documents each."""

    rules: Sequence[str | os.PathLike[str]]
    behaviours: Sequence[str | os.PathLike[str]]
    plugins: Sequence[str]
    early: bool
    at_end: str
    plugin_settings: Mapping[str, Mapping[str, Any]]
    isolate: Sequence[str]
    budgets: bool
    realtime: bool | None
    every: int
    pace: float | None
    fps: float | None
    fov_vertical_deg: float | None
    zones: str | os.PathLike[str] | None
    signals: Sequence[str | os.PathLike[str]]
    patience_s: float
    detections: str | os.PathLike[str] | None
    motion: bool
    preset: str | None
    attention: bool


def settings_from(
    source: str | int | os.PathLike[str],
    task: TaskLike | Sequence[TaskLike] | None,
    models: str | os.PathLike[str] | ModelDatabase | None,
    actors: Mapping[str, str | Sequence[str]] | None,
    options: WatchOptions,
) -> WatchSettings:
    """The settings of a run.

    Args:
        source: As of `visup.watch`, like the three that follow.
        task: See there.
        models: See there.
        actors: See there.
        options: Further settings.

    Raises:
        SettingsError: An argument has the wrong type or is out of range.
    """
    arguments: dict[str, Any] = {**options}
    _check_names(arguments)
    arguments |= {
        "source": _source(source),
        "tasks": _tasks(task),
        "models": _models(models),
        "actors": _actors(actors or {}),
    }
    try:
        return TypeAdapter(WatchSettings).validate_python(arguments)
    except ValidationError as error:
        raise _settings_error(error) from error


def _check_names(arguments: Mapping[str, Any]) -> None:
    known = [f.name for f in fields(WatchSettings) if f.name in WatchOptions.__annotations__]
    for name in arguments:
        if name not in known:
            raise SettingsError(
                f"there is no setting called '{name}'", expected=f"one of: {', '.join(known)}"
            )


def _source(source: object) -> str:
    if isinstance(source, int) and not isinstance(source, bool) and source >= 0:
        return str(source)
    if isinstance(source, str | os.PathLike) and str(source):
        return source if isinstance(source, str) else str(Path(source))
    raise SettingsError(
        f"a source cannot be {source!r}",
        expected="a video file, a folder of images, a URL, or the number of a camera",
    )


def _models(models: object) -> Path | None:
    if isinstance(models, ModelDatabase):
        return models.path
    if models is None or isinstance(models, str | os.PathLike):
        return None if models is None else Path(models)
    raise SettingsError(
        f"the model database cannot be {models!r}",
        expected="its file, or a visup.ModelDatabase",
    )


def _tasks(task: object) -> tuple[str, ...]:
    if task is None:
        return ()
    if isinstance(task, str | os.PathLike | Task):
        return (_task(task),)
    if isinstance(task, Sequence):
        return tuple(_task(t) for t in task)
    return (_task(task),)


def _task(task: object) -> str:
    if isinstance(task, Task) and task.file != "<text>":
        return f"{task.file}:{task.name}"
    if isinstance(task, str | os.PathLike):
        return task if isinstance(task, str) else str(Path(task))
    description = "a task made from text" if isinstance(task, Task) else repr(task)
    raise SettingsError(
        f"the task to verify cannot be {description}",
        expected="a task file, the name of a shipped task, or a task from visup.load_task",
    )


def _actors(actors: object) -> dict[str, tuple[str, ...]]:
    if not isinstance(actors, Mapping):
        raise SettingsError(
            f"actors cannot be {actors!r}",
            expected="a mapping of actors to models, such as {'satellite': 'spartan'}",
        )
    return {str(actor): _model_names(str(actor), models) for actor, models in actors.items()}


def _model_names(actor: str, models: object) -> tuple[str, ...]:
    names = (models,) if isinstance(models, str) else models
    if isinstance(names, Sequence) and names and all(isinstance(n, str) and n for n in names):
        return tuple(names)
    raise SettingsError(
        f"the actor '{actor}' cannot stand for {models!r}",
        expected="the name of a model, or several names",
    )


def _settings_error(error: ValidationError) -> SettingsError:
    """The first thing that is wrong, in one sentence."""
    first = error.errors()[0]
    name = ".".join(str(part) for part in first["loc"][:1])
    expected = first["msg"].removeprefix("Input should be ").partition(",")[0]
    return SettingsError(f"the setting '{name}' cannot be {first['input']!r}", expected=expected)
