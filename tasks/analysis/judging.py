"""Offline judging of a recorded run by a task: the verdict and the status of each stage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from visup.agent import Event, Mind, Observation, Status, TaskBelief, Verdict
from visup.tasks.grammar.nodes import Task
from visup.tasks.supervision.supervise import MEMORY, finish, task_reasoner


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """The result of a task on a run.

    Attributes:
        verdict: At the end.
        events: Reported events of the task.
        statuses: Final status of each stage.
    """

    verdict: Verdict
    events: tuple[Event, ...]
    statuses: Mapping[str, Status]

    def spans(self) -> Mapping[str, tuple[float, float]]:
        """Begin and end of each completed stage, seconds."""
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
        """Total paused time of each stage, seconds."""
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
    """Supervise a task over the recorded minds of a run, whatever tasks were supervised then.

    Args:
        task: A checked task.
        minds: In chronological order.
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
