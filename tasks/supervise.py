"""Supervision of tasks: the thinker of the cycle's match phase (paper, sections 6 and 7.4).

In each step the actors of every task are matched to objects, what is seen of them is taken into
the readings of the task, and the best reading says which stage is under way, how it stands, what
should be seen next and what the verdict is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from visup.agent import (
    Binding,
    Concern,
    Event,
    Mind,
    Observation,
    Outcome,
    Presence,
    Severity,
    StageBelief,
    Status,
    TaskBelief,
    Thinker,
    Truth,
    Verdict,
)
from visup.agent.changing import replace
from visup.tasks.actions import Meaning, known_actions
from visup.tasks.believe import Scene, believe
from visup.tasks.conditions import facts_of
from visup.tasks.course import leaves
from visup.tasks.matching import match, strength, unexplained
from visup.tasks.readings import Follower, Reading
from visup.tasks.settings import DEFAULT_SETTINGS, TaskSettings
from visup.tasks.structure import keyed, stage_names
from visup.tasks.tell import revision_events, stage_concerns, stage_events
from visup.tasks.trail import Revision, revised
from visup.tasks.tree import Invariant, Task
from visup.tasks.units import value
from visup.tasks.verify import BAD
from visup.tasks.vocabulary import vocabulary

MEMORY = "tasks"
UNSAFE = frozenset({"unexpected_object", "collision_course", "workspace_violation"})
LONGEST_STEP_S = 1.0  # a gap in the frames counts as no more than this


@dataclass(frozen=True, slots=True)
class TaskMemory:
    """What is remembered of one task from step to step.

    Attributes:
        time: Seconds of the last step.
        readings: The courses followed; empty until its first actors are found.
        belief: What was last believed.
        interrupted: Why the task was interrupted, or empty; once set it stays, but for one reason: an
            unexpected object that turns out to be one of the actors.
        strangers: The objects that interrupted the task by being unexpected.
        strange_since: Since when objects have been unexplained, by id.
        broken_since: Since when each invariant has been broken, or None.
        rival: A matching that would change who plays whom, by actor; empty when there is none.
        rival_since: Since when it has been the better one.
        lasting: Since when what is no plain relation of the mind has been true, by key.
    """

    time: float
    readings: tuple[Reading, ...]
    belief: TaskBelief
    interrupted: str = ""
    strangers: tuple[int, ...] = ()
    strange_since: tuple[tuple[int, float], ...] = ()
    broken_since: tuple[float | None, ...] = ()
    rival: tuple[int | None, ...] = ()
    rival_since: float = 0.0
    lasting: tuple[tuple[str, float], ...] = ()


def task_thinker(
    tasks: Sequence[Task],
    settings: TaskSettings = DEFAULT_SETTINGS,
    actions: Mapping[str, Meaning] | None = None,
) -> Thinker:
    """The thinker that supervises some tasks.

    Args:
        tasks: The active tasks, checked (see `parse_task`).
        settings: Patience and thresholds.
        actions: Meanings of actions; None for all that are known, with those of plug-ins.

    Returns:
        A pure function of mind and observation. It renews `Mind.tasks`, one belief for each task
        in order, keeps its memory in `Mind.memory['tasks']`, and gives events 'stage_started',
        'stage_progressing', 'stage_stalled', 'stage_failing', 'stage_failed', 'stage_done',
        'stage_unknown', 'stage_revised', 'invariant_broken' and 'verdict', and concerns 'stage_failing' and
        'invariant_broken'.
    """
    followers = tuple(_follower(t, actions or known_actions(), settings) for t in tasks)

    def think(mind: Mind, observation: Observation) -> Outcome:
        memories = _recall(mind, followers)
        steps = [_step(f, m, mind) for f, m in zip(followers, memories, strict=True)]
        new = tuple(s.memory for s in steps)
        believed = replace(mind, tasks=tuple(m.belief for m in new)).remember(MEMORY, new)
        events = tuple(e for s in steps for e in s.events)
        return Outcome(believed, events, tuple(c for s in steps for c in s.concerns))

    return think


def finish(belief: TaskBelief) -> Verdict:
    """The verdict on a task once nothing more will be seen of it.

    Args:
        belief: The last belief about the task.

    Returns:
        The verdict as it stands, with a task that was failing at the end failed, and one of which
        nothing was seen unknown.
    """
    if belief.verdict is Verdict.IN_PROGRESS and any(s.status in BAD for s in belief.stages):
        return Verdict.FAILED
    return belief.verdict


def _follower(task: Task, actions: Mapping[str, Meaning], settings: TaskSettings) -> Follower:
    words = vocabulary(task, actions)
    follower = Follower(task, words.meanings, settings, words.looks)
    follower.success(follower.start(0.0))  # so that no step has to work out the whole course
    return follower


@dataclass(frozen=True, slots=True)
class _Step:
    memory: TaskMemory
    events: tuple[Event, ...]
    concerns: tuple[Concern, ...]


def _recall(mind: Mind, followers: tuple[Follower, ...]) -> tuple[TaskMemory, ...]:
    kept = mind.memory.get(MEMORY, ())
    if [m.belief.task for m in kept] == [f.task.name for f in followers]:
        return tuple(kept)
    return tuple(_blank(f, mind.time) for f in followers)


def _blank(follower: Follower, now: float) -> TaskMemory:
    stages = tuple(StageBelief(s, Status.PENDING, 0.0) for s in stage_names(follower.task))
    belief = TaskBelief(follower.task.name, Verdict.UNKNOWN, stages)
    return TaskMemory(now, (), belief, broken_since=(None,) * len(follower.task.invariants))


def _step(follower: Follower, memory: TaskMemory, mind: Mind) -> _Step:
    """One step of one task: bind its actors, follow its readings, judge, tell."""
    settings, now = follower.settings, mind.time
    bindings, rival, rival_since = _bind(follower, memory, mind)
    scene = Scene(mind, bindings, follower, dict(memory.lasting))
    readings = memory.readings or _start(follower, scene)
    if readings:
        dt = min(max(0.0, now - memory.time), LONGEST_STEP_S) if memory.readings else 0.0
        readings = follower.follow(readings, scene.see, now, dt)
    broken = _broken(follower, scene, memory)
    strange = _strange(follower, scene, memory)
    interrupted, strangers = memory.interrupted, memory.strangers
    if {b.object_id for b in bindings} & set(strangers):
        interrupted, strangers = "", ()
    if not interrupted:
        interrupted, strangers = _interrupted(follower, scene, memory, broken)
    belief = believe(follower, scene, readings, interrupted)
    lasting = tuple(i for i, since in strange if now - since >= settings.unexplained_s)
    belief = replace(belief, unexplained=lasting)
    new = TaskMemory(
        now,
        readings,
        belief,
        interrupted,
        strangers,
        strange,
        broken,
        rival,
        rival_since,
        scene.since,
    )
    events = (
        *stage_events(memory.belief, belief, mind, follower.task),
        *revision_events(memory.belief, belief, _revised(memory, readings, now), mind),
        *_invariant_events(follower, memory, new, mind),
    )
    return _Step(new, events, (*stage_concerns(belief), *_invariant_concerns(follower, new, scene)))


def _revised(memory: TaskMemory, readings: tuple[Reading, ...], now: float) -> tuple[Revision, ...]:
    """Steps that lay behind by the reading told before and do not by the one told now."""
    if not memory.readings or not readings:
        return ()
    return tuple(revised(memory.readings[0].trail, readings[0].trail, now))


def _bind(
    follower: Follower, memory: TaskMemory, mind: Mind
) -> tuple[tuple[Binding, ...], tuple[int | None, ...], float]:
    """The bindings now, and the rival matching with the time since when it has been better.

    A matching that takes an actor from an object that is still there must last to be believed.
    """
    before = memory.belief.bindings
    found = match(follower.task, mind, before, _current_actors(memory), follower.settings)
    if not any(_changes_hands(a, b, mind) for a, b in zip(before, found, strict=False)):
        return found, (), mind.time
    rival = tuple(b.object_id for b in found)
    since = memory.rival_since if rival == memory.rival else mind.time
    if mind.time - since >= follower.settings.switch_s:
        return found, (), mind.time
    return tuple(_refreshed(b, mind) for b in before), rival, since


def _changes_hands(before: Binding, now: Binding, mind: Mind) -> bool:
    if before.object_id is None or before.object_id == now.object_id:
        return False
    belief = mind.objects.get(before.object_id)
    return belief is not None and belief.presence is not Presence.LEFT


def _refreshed(binding: Binding, mind: Mind) -> Binding:
    """The same binding with the strength that it has now."""
    belief = None if binding.object_id is None else mind.objects.get(binding.object_id)
    if belief is None:
        return replace(binding, object_id=None, strength=0.0)
    return replace(binding, strength=strength(belief, binding.models))


def _start(follower: Follower, scene: Scene) -> tuple[Reading, ...]:
    """The task begins once all actors of one of its first steps are found."""
    readings = follower.start(scene.mind.time)
    found = any(scene.found(x.step.actors) for r in readings for x in leaves(r.state))
    return readings if found else ()


def _strange(follower: Follower, scene: Scene, memory: TaskMemory) -> tuple[tuple[int, float], ...]:
    """Objects that are unexplained now, each with the time since when."""
    before = dict(memory.strange_since)
    optional = {a.name for a in follower.task.actors if a.optional}
    now = unexplained(scene.mind, scene.bindings, follower.settings, optional)
    return tuple((i, before.get(i, scene.mind.time)) for i in now)


def _interrupted(
    follower: Follower, scene: Scene, memory: TaskMemory, broken: tuple[float | None, ...]
) -> tuple[str, tuple[int, ...]]:
    """Why the task is interrupted by something unsafe, or empty; and by which unexpected objects.

    A task that is over is not interrupted.
    """
    if memory.belief.verdict in (Verdict.SUCCEEDED, Verdict.FAILED):
        return "", ()
    for alert in scene.mind.alerts:
        if alert.kind in UNSAFE and alert.severity >= Severity.WARNING:
            strangers = alert.objects if alert.kind == "unexpected_object" else ()
            return alert.cause.rstrip("."), strangers
    for invariant, since in zip(follower.task.invariants, broken, strict=True):
        if since is not None and scene.mind.time - since >= _patience(follower, invariant):
            return f"`{invariant}` does not hold", ()
    return "", ()


def _broken(follower: Follower, scene: Scene, memory: TaskMemory) -> tuple[float | None, ...]:
    """Since when each invariant has been broken, or None; what is not seen is not broken."""
    before = memory.broken_since
    return tuple(
        (since if since is not None else scene.mind.time) if _breaks(i, scene, memory) else None
        for i, since in zip(follower.task.invariants, before, strict=True)
    )


def _breaks(invariant: Invariant, scene: Scene, memory: TaskMemory) -> bool:
    holds = scene.holds(invariant.condition, None)
    if invariant.during and not {r.stage for r in invariant.during} & _under_way(memory):
        return False
    return holds is (Truth.TRUE if invariant.when == "never" else Truth.FALSE)


def _under_way(memory: TaskMemory) -> frozenset[str]:
    """The stages under way by the best reading, with those in which they stand."""
    if not memory.readings or memory.readings[0].finished is not None:
        return frozenset()
    steps = [x.step for x in leaves(memory.readings[0].state)]
    return frozenset().union(*(s.inside for s in steps))


def _patience(follower: Follower, invariant: Invariant) -> float:
    """For how long an invariant must be broken to count, seconds."""
    if invariant.lasting is None:
        return follower.settings.contrary_s
    return value(follower.task.amount(invariant.lasting.duration))


def _invariant_concerns(follower: Follower, memory: TaskMemory, scene: Scene) -> Iterator[Concern]:
    for invariant, since in zip(follower.task.invariants, memory.broken_since, strict=True):
        if since is not None and memory.time - since >= _patience(follower, invariant):
            facts = facts_of(invariant.condition)
            actors = (a for f in facts for a in keyed(follower.task, f)[1])
            objects = scene.objects(tuple(dict.fromkeys(actors)))
            cause = f"`{invariant}` has not held since {since:.1f} s."
            key = f"{follower.task.name}: {invariant}"
            yield Concern("invariant_broken", objects, Severity.CRITICAL, cause, (), key)


def _invariant_events(
    follower: Follower, memory: TaskMemory, new: TaskMemory, mind: Mind
) -> Iterator[Event]:
    for i, invariant in enumerate(follower.task.invariants):
        patience = _patience(follower, invariant)
        since = new.broken_since[i]
        if since is not None and memory.time - since < patience <= new.time - since:
            text = f"Task `{follower.task.name}`: `{invariant}` has not held since {since:.1f} s."
            yield Event(
                "invariant_broken",
                mind.time,
                mind.frame_index,
                text,
                severity=Severity.CRITICAL,
                data={"task": follower.task.name, "invariant": str(invariant)},
            )


def _current_actors(memory: TaskMemory) -> tuple[str, ...]:
    if not memory.readings:
        return ()
    return tuple(a for x in leaves(memory.readings[0].state) for a in x.step.actors)
