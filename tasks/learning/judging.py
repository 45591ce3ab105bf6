"""A task on a run that is kept: its verdict, and how each stage went."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from visup.agent import Event, Mind, Observation, Status, TaskBelief, Verdict
from visup.tasks.grammar.nodes import Task
from visup.tasks.supervision.supervise import MEMORY, finish, task_reasoner


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """How a task went in a run.

    Attributes:
        verdict: At the end.
        events: What was told of it.
        statuses: How each stage stood at the end.
    """

    verdict: Verdict
    events: tuple[Event, ...]
    statuses: Mapping[str, Status]

    def spans(self) -> Mapping[str, tuple[float, float]]:
        """When each stage that was done began and ended, seconds."""
        begun: dict[str, float] = {}
        found: dict[str, tuple[float, float]] = {}
        for event in self.events:
            stage = event.data.get("stage")
            if not isinstance(stage, str):
                continue
            if event.kind == "stage_started":
                begun.setdefault(stage, event.time)
            elif event.kind == "stage_done" and stage in begun:
                found[stage] = begun[stage], event.time
        return found

    def paused_s(self) -> Mapping[str, float]:
        """For how long the work on each stage was paused before it was done, seconds."""
        since: dict[str, float] = {}
        found: dict[str, float] = {}
        for event in self.events:
            stage = str(event.data.get("stage", ""))
            if event.kind == "stage_paused":
                since[stage] = event.time
            elif event.kind.startswith("stage_") and stage in since:
                found[stage] = found.get(stage, 0.0) + event.time - since.pop(stage)
        return found


def judged(task: Task, minds: Sequence[Mind]) -> JudgedRun:
    """A task followed through what was believed in a run, whatever tasks were followed then.

    Args:
        task: Checked.
        minds: In the order of time.
    """
    reasoner = task_reasoner([task])
    memory, events = MEMORY.default, list[Event]()
    beliefs: tuple[TaskBelief, ...] = ()
    for number, mind in enumerate(minds):
        blank = mind.remember(MEMORY, memory, tasks=beliefs, alerts=())
        outcome = reasoner(blank, Observation(number, mind.time, mind.frame_size))
        memory, beliefs = outcome.mind.recall(MEMORY), outcome.mind.tasks
        events += outcome.events
    if not beliefs:
        return JudgedRun(Verdict.UNKNOWN, (), {})
    statuses = {s.stage: s.status for s in beliefs[0].stages}
    return JudgedRun(finish(beliefs[0]), tuple(events), statuses)
