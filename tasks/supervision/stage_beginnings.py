"""Which stages have begun, and when: a stage whose turn has come begins once there is evidence of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from visup.agent import Mind, StageBelief, Status, TaskBelief
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.motion import MOVING_SIGMAS
from visup.rules.relations.reasoner import relation_settings, sample_window
from visup.tasks.automaton.states import Leaf, TaskStep, leaves
from visup.tasks.supervision.hypotheses import HOLD, TaskHypotheses
from visup.tasks.supervision.memory import TaskMemory
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.snapshot import TaskSnapshot
from visup.tasks.verification.motion_onset import moving_bodies
from visup.tasks.verification.observe import TRENDS
from visup.tasks.verification.stage_onset import stage_onset
from visup.tasks.verification.step_monitor import StepMonitor

Resting = tuple[tuple[str, float], ...]
"""Stages that wait to begin, each with the time since when its actors rest, seconds."""

REST_S = 0.3
"""How long the actors of a stage must have rested for their motion to begin it, seconds."""


def with_begun(
    before: tuple[StageBelief, ...],
    stages: tuple[StageBelief, ...],
    moved: Collection[str] = (),
    waiting: Collection[str] = (),
) -> tuple[StageBelief, ...]:
    """Update whether each stage has begun.

    Args:
        before: The previous beliefs, in the same order.
        stages: The present beliefs.
        moved: The stages that begin by motion of their actors, if they are active.
        waiting: The stages that no progress begins; they are active until they begin otherwise.
    """
    still = {s for s in waiting if s not in moved}
    pairs = [
        (b, _waiting(s) if s.stage in still else s) for b, s in zip(before, stages, strict=True)
    ]
    return tuple(
        [replace(s, begun=True) if _begun(b, s, s.stage in moved) else s for b, s in pairs]
    )


def _waiting(stage: StageBelief) -> StageBelief:
    going = stage.status is Status.PROGRESSING
    return replace(stage, status=Status.ACTIVE, begun=False) if going else stage


def is_first(stages: tuple[StageBelief, ...]) -> bool:
    """Whether no stage has begun."""
    return not any(s.begun for s in stages)


def _begun(before: StageBelief, now: StageBelief, moved: bool) -> bool:
    if now.status is Status.PENDING:
        return False
    if now.status is Status.PAUSED:
        return before.begun
    anew = before.status is Status.DONE and now.status is Status.ACTIVE
    return (
        moved
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
"""An object that appears this long after the first one, seconds, has come in, or was found since it has
started to move; either begins a task."""


def begun_by_motion(
    model: MonitoredPhases,
    before: TaskMemory,
    resting: Resting,
    snapshot: TaskSnapshot,
    posterior: TaskHypotheses | None,
) -> frozenset[str]:
    """The stages that begin since their actors start to move.

    Any motion begins the first stage of a task, also that of an actor whose turn comes later: a cap
    that is brought before its block. A later stage begins when an actor sets out after all of them
    have rested: a tug that leaves without its cart hauls it in vain.

    Args:
        model: The task.
        before: The memory of the task before this step.
        resting: The stages that wait at rest, as of this step.
        snapshot: The observations.
        posterior: The hypotheses.
    """
    if is_first(before.belief.stages):
        names = frozenset(s.stage for s in before.belief.stages)
        too_soon = snapshot.objects(tuple(model.moved_later))
        moves = not snapshot.setting_out.isdisjoint(too_soon)
        return names if moves or _shows_motion(snapshot, posterior) else frozenset()
    rested = {stage for stage, since in resting if snapshot.mind.time - since >= REST_S - 1e-9}
    actors = {s: snapshot.objects(a) for s, a in _actors(posterior).items() if s in rested}
    return frozenset(s for s, ids in actors.items() if not snapshot.setting_out.isdisjoint(ids))


def stages_at_rest(
    before: TaskMemory, snapshot: TaskSnapshot, posterior: TaskHypotheses | None
) -> Resting:
    """The stages that wait to begin and whose actors rest, or have just rested for long enough."""
    waiting = {s.stage for s in before.belief.stages if s.status is Status.ACTIVE and not s.begun}
    if not waiting or is_first(before.belief.stages):
        return ()
    now, since = snapshot.mind.time, dict(before.resting)
    found = []
    for stage, actors in _actors(posterior).items():
        if stage not in waiting or not snapshot.found(actors):
            continue
        at = since.get(stage, now)
        if snapshot.setting_out.isdisjoint(snapshot.objects(actors)) or now - at >= REST_S - 1e-9:
            found.append((stage, at))
    return tuple(found)


def _actors(posterior: TaskHypotheses | None) -> dict[str, tuple[str, ...]]:
    """The actors of each active stage that motion may begin.

    It does not begin a stage that takes along what was grasped before: if the gripper moves alone, the grasp
    has failed.
    """
    if posterior is None:
        return {}
    hypothesis, found = posterior.likeliest, dict[str, tuple[str, ...]]()
    steps = [x.step for x in leaves(hypothesis.state)]
    last = hypothesis.backpointer
    grasped = set(last.step.actors) if last is not None and last.step.action == HOLD else {""}
    taking = {s.stage for s in steps if s.action == "moving_together" and grasped <= {*s.actors}}
    for step in steps:
        if step.stage not in taking:
            found[step.stage] = (*found.get(step.stage, ()), *step.actors)
    return found


def _shows_motion(snapshot: TaskSnapshot, posterior: TaskHypotheses | None) -> bool:
    """Whether actors of the most likely active steps start to move, or have just appeared.

    Of a stage with several steps, an actor of each must move; for a trend, the actor named first: that the
    giver brings a payload does not begin what the receiver should do.
    """
    out = moving_bodies(snapshot.mind) | _newcomers(snapshot.mind)

    def stirs(step: TaskStep, *, alone: bool) -> bool:
        leads = step.actors[:1] if step.action in TRENDS and not alone else step.actors
        return not out.isdisjoint(snapshot.objects(leads))

    stages = _stages(posterior).values()
    return any(all(stirs(x.step, alone=len(stage) == 1) for x in stage) for stage in stages)


def waiting_for_leads(
    before: TaskBelief, snapshot: TaskSnapshot, posterior: TaskHypotheses | None
) -> frozenset[str]:
    """The first stages of several steps that do not begin yet, since of a trend only the second actor moves.

    A giver that brings the payload nearer to the receiver is progress of `converging(receiver, payload)`,
    but the receiver has not begun. Another action of the stage that begins in its turn begins the stage.
    """
    several = {name: steps for name, steps in _stages(posterior).items() if len(steps) > 1}
    if not several or not is_first(before.stages):
        return frozenset()
    out = moving_bodies(snapshot.mind) | _newcomers(snapshot.mind)

    def waits(step: TaskStep) -> bool:
        lead, others = snapshot.objects(step.actors[:1]), snapshot.objects(step.actors[1:])
        rests = bool(lead) and out.isdisjoint(lead)
        return step.action in TRENDS and rests and not out.isdisjoint(others)

    def held_back(steps: Sequence[Leaf[StepMonitor]]) -> bool:
        going = [x for x in steps if not waits(x.step)]
        return len(going) < len(steps) and not any(x.payload.begun_anew for x in going)

    return frozenset(name for name, steps in several.items() if held_back(steps))


def _stages(posterior: TaskHypotheses | None) -> dict[str, list[Leaf[StepMonitor]]]:
    """The most likely active steps by stage."""
    if posterior is None or posterior.likeliest.finished is not None:
        return {}
    found: dict[str, list[Leaf[StepMonitor]]] = {}
    for leaf in leaves(posterior.likeliest.state):
        found.setdefault(leaf.step.stage, []).append(leaf)
    return found


def _newcomers(mind: Mind) -> frozenset[int]:
    """Ids of the objects that have appeared later than the first ones, except those found at rest.

    They are judged by their image motion, since it is not known yet how their outlines move. Where no image
    motion is measured, all of them count.
    """
    start = min((b.first_seen for b in mind.objects.values()), default=0.0)
    late = frozenset(i for i, b in mind.objects.items() if b.first_seen - start > CAME_LATER_S)
    window = sample_window(mind)
    if not late or not np.isfinite(window.image).any():
        return late
    vx, vy, sigma = window.image[-1].T
    least = relation_settings(mind).slow_speed * image_diagonal(mind.frame_size)
    moves = np.hypot(vx, vy) > np.maximum(least, MOVING_SIGMAS * sigma)
    return late & {i for i, m in zip(window.ids, moves.tolist(), strict=True) if m}
