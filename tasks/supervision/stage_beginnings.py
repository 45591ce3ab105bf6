"""Which stages have begun, and when: a stage whose turn has come begins once there is evidence of it."""

from __future__ import annotations

from collections.abc import Iterator

from visup.agent import Mind, StageBelief, Status, TaskBelief
from visup.agent.model.fast_replace import replace
from visup.rules.relations.reasoner import sample_window
from visup.tasks.automaton.states import TaskStep, leaves
from visup.tasks.supervision.hypotheses import TaskHypotheses
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.snapshot import TaskSnapshot
from visup.tasks.verification.motion_onset import moving_bodies
from visup.tasks.verification.observe import TRENDS
from visup.tasks.verification.stage_onset import stage_onset


def with_begun(
    before: tuple[StageBelief, ...], stages: tuple[StageBelief, ...], *, motion_seen: bool
) -> tuple[StageBelief, ...]:
    """Update whether each stage has begun.

    Args:
        before: The previous beliefs, in the same order.
        stages: The present beliefs.
        motion_seen: Whether an actor of an active step starts to move, which begins the first stage of a
            task.
    """
    motion_seen = motion_seen and is_first(before)
    pairs = zip(before, stages, strict=True)
    return tuple([replace(s, begun=True) if _begun(b, s, motion_seen) else s for b, s in pairs])


def is_first(stages: tuple[StageBelief, ...]) -> bool:
    """Whether no stage has begun."""
    return not any(s.begun for s in stages)


def _begun(before: StageBelief, now: StageBelief, motion_seen: bool) -> bool:
    if now.status is Status.PENDING:
        return False
    if now.status is Status.PAUSED:
        return before.begun
    anew = before.status is Status.DONE and now.status is Status.ACTIVE
    return (
        motion_seen
        or now.begun
        or (before.begun and not anew)
        or now.status not in (Status.ACTIVE, Status.UNKNOWN)
    )


def stage_onsets(
    model: MonitoredPhases,
    before: TaskBelief,
    now: TaskBelief,
    posterior: TaskHypotheses | None,
    mind: Mind,
) -> Iterator[tuple[str, float]]:
    """Onsets of the stages that are believed to have begun since the last step.

    Args:
        model: The task.
        before: The previous belief.
        now: The present one.
        posterior: The hypotheses from which it is derived.
        mind: The mind.

    Yields:
        (stage, time when it most probably began in seconds); see `stage_onset`.
    """
    begun = {s.stage for s in before.stages if s.begun}
    anew = [s.stage for s in now.stages if s.begun and s.stage not in begun]
    if not anew or posterior is None:
        return
    objects = TaskSnapshot(mind, now.bindings, model).objects
    steps, window = leaves(posterior.likeliest.state), sample_window(mind)
    for stage in anew:
        mine = [x for x in steps if x.step.stage == stage]
        if mine:
            yield stage, stage_onset(mine, model.actions, objects, mind.time, window)


CAME_LATER_S = 0.3
"""An object that appears this long after the first one, seconds, has arrived or started to move; either
begins a task."""


def shows_motion(snapshot: TaskSnapshot, posterior: TaskHypotheses | None) -> bool:
    """Whether actors of the most likely active steps start to move, or have just appeared.

    Of a stage with several steps, an actor of each must move; for a trend, the actor named first: that the
    giver brings a payload does not begin what the receiver should do.
    """
    if posterior is None or posterior.likeliest.finished is not None:
        return False
    steps = [x.step for x in leaves(posterior.likeliest.state)]
    actors = {a for step in steps for a in step.actors}
    ids, mind = snapshot.objects(tuple(actors)), snapshot.mind
    came = [mind.objects[i].first_seen for i in ids if i in mind.objects]
    start = min((b.first_seen for b in mind.objects.values()), default=0.0)
    if came and max(came) - start > CAME_LATER_S:
        return True
    out = moving_bodies(mind)

    def stirs(step: TaskStep, *, alone: bool) -> bool:
        leads = step.actors[:1] if step.action in TRENDS and not alone else step.actors
        return not out.isdisjoint(snapshot.objects(leads))

    stages = [[s for s in steps if s.stage == stage] for stage in {s.stage for s in steps}]
    return any(all(stirs(s, alone=len(stage) == 1) for s in stage) for stage in stages)
