"""Records the reports of the supervisor for a mission, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, field

from visup.agent import Frame, Mind, Pose, Region, Severity, Status, TaskBelief, Verdict
from visup.agent.model.step import Step
from visup.evaluation.missions.scores import StageSample


@dataclass(frozen=True, slots=True)
class ObservedObject:
    """A believed object at one frame."""

    id: int
    name: str
    region: Region
    pose: Pose | None


@dataclass(slots=True)
class MissionRecorder:
    """The reports of the supervisor for one mission."""

    objects_by_frame: dict[int, tuple[ObservedObject, ...]] = field(default_factory=dict)
    events: list[tuple[str, tuple[int, ...], float]] = field(default_factory=list)
    alerts: list[tuple[str, tuple[int, ...], float, bool]] = field(default_factory=list)
    stages: list[StageSample] = field(default_factory=list)
    last: Mind | None = None
    seconds: float = 0.0

    def __call__(self, step: Step, frame: Frame) -> None:
        """Add one step; an observer."""
        self.objects_by_frame[step.frame_index] = tuple(
            ObservedObject(b.id, b.name, b.region, b.pose)
            for b in step.mind.objects.values()
            if b.last_seen == step.time
        )
        self.events += [(e.kind, e.objects, e.time) for e in step.events]
        self.alerts += [
            (a.kind, a.objects, a.opened, a.severity >= Severity.WARNING)
            for a in step.alerts
            if a.closed is None
        ]
        self.stages.append(_sample(step.mind))
        self.last = step.mind


def _sample(mind: Mind) -> StageSample:
    """The reported stage and its outcome so far.

    A completed stage counts as progressing until the next begins: its outcome so far is good, and in the
    truth a mission stays in its last stage until it ends.
    """
    task = mind.tasks[0] if mind.tasks else None
    done = [s.stage for s in task.stages if s.status is Status.DONE] if task else []
    stage = (task.current or (done[-1] if done else None)) if task else None
    if task is None or stage is None:
        return StageSample(mind.time, None, None)
    status = next(s.status for s in task.stages if s.stage == stage)
    return StageSample(mind.time, stage, _outcome(task, status))


def _outcome(task: TaskBelief, status: Status) -> str | None:
    if task.verdict is Verdict.INTERRUPTED:
        return "unsafe"
    if status in (Status.FAILING, Status.FAILED):
        return "failing"
    if status in (Status.PENDING, Status.UNKNOWN):
        return None
    return "progressing"
