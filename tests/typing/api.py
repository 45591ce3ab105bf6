"""User code that must type-check: mypy reads it with the tests; it is not run."""

from __future__ import annotations

from pathlib import Path
from typing import assert_type

import numpy as np
from numpy.typing import NDArray

import visup


def watching() -> visup.Verdict | None:
    database = visup.ModelDatabase.open("things.models")
    task = visup.load_task("dock")
    assert_type(task, visup.Task)
    run = visup.watch(
        Path("clip.mp4"), task=task, models=database, actors={"arm": "arm"}, every=2, out="run"
    )
    assert_type(run, visup.Run)
    for step in run:
        assert_type(step, visup.Step)
        assert_type(step.draw(), NDArray[np.uint8])
        for event in step.events:
            assert_type(event, visup.Event)
            assert_type(event.severity >= visup.Severity.WARNING, bool)
        for concern in step.alerts:
            assert_type(concern, visup.Alert)
    assert_type(next(run.narrate()), visup.Event)
    assert_type(run.events[0], visup.Event)
    assert_type([s.mind for s in run.steps], list[visup.Mind])
    assert_type(run.alerts[-1].cause, str)
    return run.verdict


def teaching(picture: NDArray[np.uint8], mask: NDArray[np.bool_]) -> visup.ModelDatabase:
    models = visup.teach("clip.mp4", {"part": [(1, 2), (3, 4), (5, 0)]}, models="a.models", frame=9)
    return visup.teach(picture, {"tray": mask}, models=models)


def settings() -> visup.Run:
    return visup.watch(visup.Settings("clip.mp4", tasks=("dock",)), out=Path("run"))


def recorded() -> None:
    run = visup.open_run("run")
    assert_type(run, visup.RecordedRun)
    assert_type(run.verdict, visup.Verdict | None)
    assert_type(run.events[:3][0].text, str)
    assert_type(run.objects[0].share, float)
    assert_type(run.steps[0].time, float)
    run.events.to_pandas()
    run.objects.to_arrow()


def agent(frames: list[visup.Frame], own: visup.Behaviour) -> None:
    mind = visup.Agent([own])
    for step in mind.steps(frames):
        assert_type(step, visup.Step)
    assert_type(visup.__version__, str)


def mistakes() -> None:
    visup.watch("clip.mp4", evry=2)  # type: ignore[call-arg]
    visup.watch("clip.mp4", task=3)  # type: ignore[arg-type]
    visup.watch("clip.mp4", actors={"arm": 3})  # type: ignore[dict-item]
    visup.open_run(3)  # type: ignore[arg-type]
