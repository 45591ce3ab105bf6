"""Searches for a task: in which runs it was carried out, and when."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from visup.agent import TaskBelief, Truth, Verdict
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.archive.finding.pattern_evaluator import Hit
from visup.archive.querying.database import LakeDatabase
from visup.runs.replay import changed_settings, replay
from visup.runs.settings import WatchSettings


@dataclass(frozen=True, slots=True)
class TaskSearch:
    """Searches for the runs in which a task succeeded.

    Attributes:
        file: A task file.
    """

    file: Path
    quick: bool = False

    def possible_runs(self, database: LakeDatabase) -> list[str]:
        """See `Search`: any run is possible, with any objects as its actors."""
        found: list[str] = database.ask("SELECT run FROM lake.runs ORDER BY run")["run"].to_pylist()
        return found

    def hits(self, recording: Recording, settings: WatchSettings) -> tuple[Hit, ...]:
        """See `Search`: from the first active stage to success."""
        watch = _TaskTimes()
        replay(recording, changed_settings(settings, tasks=(str(self.file),)), on_step=watch)
        return tuple(sorted(watch.done.values(), key=lambda hit: (hit.end, hit.rule)))


@dataclass(slots=True)
class _TaskTimes:
    """Collects when each task began and succeeded."""

    begun: dict[str, float] = field(default_factory=dict)
    done: dict[str, Hit] = field(default_factory=dict)

    def __call__(self, step: Step) -> None:
        """Add one step."""
        for task in step.mind.tasks:
            if task.current is not None:
                self.begun.setdefault(task.task, step.time)
            if task.verdict is Verdict.SUCCEEDED and task.task not in self.done:
                begin = self.begun.get(task.task, step.time)
                self.done[task.task] = _hit(task, begin, step)
            elif task.verdict is not Verdict.SUCCEEDED:
                self.done.pop(task.task, None)  # the success was withdrawn


def _hit(task: TaskBelief, begin: float, step: Step) -> Hit:
    objects = tuple(b.object_id for b in task.bindings if b.object_id is not None)
    names = tuple(
        step.mind.objects[i].name if i in step.mind.objects else f"object {i}" for i in objects
    )
    sure = round(task.confidence, 6)
    return Hit(objects, names, Truth.TRUE.value, begin, step.time, False, sure, rule=task.task)
