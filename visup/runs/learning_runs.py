"""Recorded runs as training data for tasks: the minds of a run, replayed from its journal."""

from __future__ import annotations

from pathlib import Path

from visup.agent import Mind
from visup.agent.storage.journal_reader import Recording
from visup.runs.replay import replay, settings_for
from visup.tasks import load_tasks
from visup.tasks.analysis.judging import JudgedRun, judged
from visup.tasks.grammar.nodes import Actor, Task
from visup.tasks.learning.traces import RunTrace, trace_of


def run_minds(run: Path) -> tuple[Mind, ...]:
    """The minds of a recorded run, moment by moment.

    Args:
        run: A run folder of `visup watch`, or its journal.

    Raises:
        VisupError: There is no run, or it cannot be read.
    """
    recording = Recording.open(run)
    minds: list[Mind] = []
    replay(recording, settings_for(recording), None, lambda step: minds.append(step.mind))
    return tuple(minds)


def run_trace(run: Path) -> RunTrace:
    """The trace of a recorded run; raises like `run_minds`."""
    return trace_of(run.name if run.is_dir() else run.parent.name, run_minds(run))


def run_judged(task: Task, run: Path) -> JudgedRun:
    """A task evaluated on a recorded run; raises like `run_minds`."""
    return judged(task, run_minds(run))


def declared_actors(run: Path) -> dict[str, Actor]:
    """The actors declared by the tasks of a run, by name; none without a task."""
    settings = settings_for(Recording.open(run))
    tasks = [t for name in settings.tasks for t in load_tasks(name)]
    return {a.name: a for t in tasks for a in t.actors}
