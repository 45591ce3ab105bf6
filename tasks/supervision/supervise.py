"""Supervision of tasks: the reasoner of the cycle's match phase (paper, sections 6 and 7.4).

In each step the actors of every task are matched to objects, the hypotheses of the task are updated with the
observations, and the belief about stages, expectations and verdict is derived from them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from visup.agent import (
    AlertCondition,
    Event,
    Mind,
    Observation,
    Outcome,
    Reasoner,
    Severity,
    TaskBelief,
    Verdict,
)
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.tasks.actions.actions import ActionDefinition, known_actions
from visup.tasks.actions.vocabulary import task_vocabulary
from visup.tasks.automaton.backpointers import Revision, behind
from visup.tasks.automaton.states import leaves
from visup.tasks.casting.matching import (
    bystanders,
    familiar_objects,
    machines,
    unexplained,
)
from visup.tasks.casting.recasting import Casting, recast
from visup.tasks.grammar.nodes import Task
from visup.tasks.supervision.belief import (
    failed_belief,
    out_of_order_belief,
    pending_stages,
    suppressed,
    task_belief,
)
from visup.tasks.supervision.events import (
    activity_events,
    done_stages,
    revision_events,
    stage_concerns,
    stage_events,
)
from visup.tasks.supervision.hypotheses import TaskHypotheses
from visup.tasks.supervision.invariants import (
    broken_since,
    invariant_concerns,
    invariant_events,
    order_violation,
    violation,
)
from visup.tasks.supervision.memory import TaskMemory
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.replay import followed, newly_found, remembered, replayed
from visup.tasks.supervision.snapshot import TaskSnapshot
from visup.tasks.supervision.stage_beginnings import (
    begun_by_motion,
    stage_onsets,
    stages_at_rest,
    waiting_for_leads,
    with_begun,
)
from visup.tasks.supervision.task_inference import ALONE, TaskActivity, updated_activities
from visup.tasks.verification.settings import DEFAULT_SETTINGS, TaskSettings
from visup.tasks.verification.step_monitor import BAD

MEMORY: MemoryKey[tuple[TaskMemory, ...]] = MemoryKey("tasks", ())
OVER = (Verdict.SUCCEEDED, Verdict.FAILED)
UNSAFE = frozenset({"unexpected_object", "collision_course", "workspace_violation"})
UNREPORTED_S = 0.2  # interval of updates of a task that is not reported


def task_reasoner(
    tasks: Sequence[Task],
    settings: TaskSettings = DEFAULT_SETTINGS,
    actions: Mapping[str, ActionDefinition] | None = None,
) -> Reasoner:
    """The reasoner that supervises some tasks.

    Args:
        tasks: Checked tasks (see `parse_task`). A single one is assumed to be in progress; of several it is
            inferred which are (see `task_inference.py`), and the others are not reported.
        settings: Time constants and thresholds.
        actions: Meanings of actions; None for all known ones, including those of plug-ins.

    Returns:
        A pure function of mind and observation. It updates `Mind.tasks`, one belief per task in order, stores
        its memory under `MEMORY`, and gives events 'stage_started', 'stage_progressing', 'stage_paused',
        'stage_resumed', 'stage_stalled', 'stage_failing', 'stage_failed', 'stage_done', 'stage_unknown',
        'stage_revised', 'task_active', 'task_inactive', 'invariant_broken' and 'verdict', and alert
        conditions 'stage_failing' and 'invariant_broken'.
    """
    known = actions or known_actions()
    return TaskReasoner(tuple(_model(t, known, settings) for t in tasks))


@dataclass(frozen=True, slots=True, eq=False)
class TaskReasoner:
    """Supervises tasks; see `task_reasoner`.

    Attributes:
        models: The prepared tasks.
    """

    models: tuple[MonitoredPhases, ...]

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The tasks."""
        return tuple(m.task for m in self.models)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Process one step; see `Reasoner`."""
        before = _recall(mind, self.models)
        each = zip(self.models, before, strict=True)
        seen = tuple(_follow(f, m, mind) if _due(m, mind.time) else m for f, m in each)
        new = _inferred(before, seen, mind.time)
        believed = mind.remember(MEMORY, new, tasks=tuple(m.belief for m in new))
        steps = list(zip(self.models, before, new, strict=True))
        events = tuple(e for step in steps for e in _events(*step, mind))
        return Outcome(believed, events, tuple(c for f, _, m in steps for c in _concerns(f, m)))


def finish(belief: TaskBelief) -> Verdict:
    """The final verdict on a task at the end of a run.

    Args:
        belief: The last belief about the task.

    Returns:
        The verdict; FAILED for a task that was failing at the end, UNKNOWN for one that was never observed.
    """
    if belief.verdict is Verdict.IN_PROGRESS and any(s.status in BAD for s in belief.stages):
        return Verdict.FAILED
    return belief.verdict


def _model(
    task: Task, actions: Mapping[str, ActionDefinition], settings: TaskSettings
) -> MonitoredPhases:
    words = task_vocabulary(task, actions)
    model = MonitoredPhases(task, words.meanings, settings, words.evaluators, words.rhythms)
    model.filter.success(model.filter.start())  # explores the course now rather than in a step
    return model


def _recall(mind: Mind, models: tuple[MonitoredPhases, ...]) -> tuple[TaskMemory, ...]:
    kept = mind.recall(MEMORY)
    if [m.belief.task for m in kept] == [f.task.name for f in models]:
        return kept
    activity = ALONE if len(models) == 1 else TaskActivity()
    return tuple(_blank(f, mind.time, activity) for f in models)


def _blank(model: MonitoredPhases, now: float, activity: TaskActivity) -> TaskMemory:
    name, stages = model.task.name, pending_stages(model)
    belief = TaskBelief(name, Verdict.UNKNOWN, stages, active=activity.chance)
    broken = (None,) * len(model.task.invariants)
    return TaskMemory(now, None, belief, broken_since=broken, activity=activity, inferred=now)


def _due(memory: TaskMemory, now: float) -> bool:
    """Whether a task is updated in this step.

    A reported task is updated in each step. The others are updated at a lower rate, which delays their
    reports accordingly, and all at the same time, so that no rival has an advantage.
    """
    return memory.activity.reportable or not 0.0 < now - memory.time < UNREPORTED_S - 1e-9


def _inferred(
    before: tuple[TaskMemory, ...], seen: tuple[TaskMemory, ...], now: float
) -> tuple[TaskMemory, ...]:
    """The memories of tasks after inferring which are in progress."""
    if len(seen) == 1:
        return seen
    dt = now - before[0].inferred
    cast = [
        frozenset(b.object_id for b in m.belief.bindings if b.object_id is not None) for m in seen
    ]
    activities = updated_activities(
        [m.activity for m in before],
        [m.gain * dt for m in seen],
        cast,
        dt,
        [a.belief.verdict in OVER or _ends(a, b) for a, b in zip(before, seen, strict=True)],
    )
    each = zip(before, seen, activities, strict=True)
    return tuple([_with_activity(old.belief, new, activity, now) for old, new, activity in each])


def _ends(before: TaskMemory, now: TaskMemory) -> bool:
    """Whether a task that was reported on has just ended."""
    return before.activity.reportable and now.belief.verdict in OVER


def _with_activity(
    told: TaskBelief, memory: TaskMemory, activity: TaskActivity, now: float
) -> TaskMemory:
    """A memory with its activity; the belief about a task that is not in progress is suppressed.

    A reported failure or end of a task remains whatever follows. So does an interruption, which does not
    depend on the task.
    """
    if memory.belief is told and memory.activity == activity:
        return replace(memory, inferred=now)
    belief = replace(memory.belief, active=activity.chance)
    over = told.verdict in OVER or any(s.status in BAD for s in told.stages)
    if activity.reportable or over or memory.interrupted:
        return replace(memory, activity=activity, belief=belief, inferred=now)
    posterior = memory.posterior
    if memory.activity.begun and not activity.begun:
        posterior = None  # a rival has ended; later observations do not belong to it
    if posterior and any(x.payload.status in BAD for x in leaves(posterior.likeliest.state)):
        posterior = None  # if it is in progress later, it starts from its first stage
    memory = memory if posterior is memory.posterior else replace(memory, past_steps=())
    belief = suppressed(belief, activity)
    return replace(memory, activity=activity, belief=belief, posterior=posterior, inferred=now)


def _follow(model: MonitoredPhases, memory: TaskMemory, mind: Mind) -> TaskMemory:
    """One step of one task: bind its actors, update its hypotheses, derive the belief."""
    now, casting = mind.time, _cast(model, memory, mind)
    start, observations, past = memory.posterior, memory.observations, memory.past_steps
    if past and newly_found(memory.belief.bindings, casting.bindings, mind):
        start, observations = replayed(model, past, casting.bindings)
    snapshot = TaskSnapshot(mind, casting.bindings, model, observations)
    posterior = followed(model, start, snapshot)
    broken = broken_since(model, snapshot, memory)
    familiar = familiar_objects(mind, casting.bindings, model.settings, memory.familiar_objects)
    bystanding = bystanders(model.task, mind, casting.bindings, model.settings)
    interrupted, interrupting = _interrupted(model, snapshot, memory, broken, bystanding)
    interrupted_now = interrupted != memory.interrupted and not interrupting
    interrupted_now = interrupted_now and interrupted == violation(model, broken, now, safety=True)
    violated = memory.violated
    if not violated and memory.belief.verdict not in OVER:
        violated = violation(model, broken, now, safety=False)
    unexplained = _unexplained_since(model, snapshot, memory)
    past = remembered(past, mind, start, observations) if _awaited(model, casting) else ()
    new = replace(
        memory,
        time=now,
        posterior=posterior,
        interrupted=interrupted,
        interrupting_objects=interrupting,
        unexplained_since=tuple(s for s in unexplained if s[0] not in familiar),
        broken_since=broken,
        rival=casting.rival,
        rival_since=casting.rival_since,
        settled=casting.settled,
        gain=_gain(model, start, posterior, snapshot),
        past_steps=past,
        violated=violated,
        familiar_objects=familiar,
        forbidden=memory.forbidden or interrupted_now,
        resting=stages_at_rest(memory, snapshot, posterior),
        order_violation=order_violation(model, snapshot, posterior, memory.order_violation),
    )
    belief = _belief(model, snapshot, memory, new, bystanding)
    # The snapshot's memory now has all facts that were asked for.
    return replace(new, belief=belief, observations=snapshot.memory)


def _belief(
    model: MonitoredPhases,
    snapshot: TaskSnapshot,
    memory: TaskMemory,
    new: TaskMemory,
    bystanding: tuple[int, ...],
) -> TaskBelief:
    """The belief that follows from the new memory of a task, apart from its belief, and the one before."""
    now, old = new.time, memory.belief
    belief = task_belief(model, snapshot, new.posterior, new.interrupted)
    if new.violated:
        belief = failed_belief(belief, old, new.violated, now)
    elif new.order_violation:
        belief = out_of_order_belief(belief, old, new.order_violation.why, now)
    if memory.forbidden:
        belief = replace(belief, stages=old.stages, current=old.current)
    moved = begun_by_motion(model, memory, new.resting, snapshot, new.posterior)
    waiting = waiting_for_leads(old, snapshot, new.posterior)
    least = model.settings.unexplained_s
    return replace(
        belief,
        stages=with_begun(old.stages, belief.stages, moved, waiting),
        unexplained=tuple(i for i, since in new.unexplained_since if now - since >= least),
        bystanders=bystanding,
        machines=machines(model.task, snapshot.bindings),
    )


def _gain(
    model: MonitoredPhases,
    before: TaskHypotheses | None,
    now: TaskHypotheses | None,
    snapshot: TaskSnapshot,
) -> float:
    """Evidence per second that the task is in progress; 0 in its first step."""
    if before is None or now is None:
        return 0.0
    return model.gain(now.likeliest, snapshot.observe)


def _cast(model: MonitoredPhases, memory: TaskMemory, mind: Mind) -> Casting:
    """The casting of this step."""
    bindings = memory.belief.bindings
    before = Casting(bindings, memory.rival, memory.rival_since, memory.settled)
    steps = () if memory.posterior is None else leaves(memory.posterior.likeliest.state)
    acting = tuple(a for x in steps for a in x.step.actors)
    return recast(model.task, mind, before, acting, model.settings)


def _awaited(model: MonitoredPhases, casting: Casting) -> bool:
    """Whether an actor that the task depends on is still missing."""
    unbound = (b.actor for b in casting.bindings if b.object_id is None)
    return any(not model.task.actor(a).optional for a in unbound)


def _events(
    model: MonitoredPhases, memory: TaskMemory, new: TaskMemory, mind: Mind
) -> Iterator[Event]:
    """The events of one task after a step."""
    yield from activity_events(memory.activity, new.activity, new.belief, mind)
    if not new.activity.reportable and memory.activity.reportable:
        return  # the end of its activity is the only event
    onsets = dict(stage_onsets(model, memory.belief, new.belief, new.posterior, mind))
    revisions = _revised(memory, new)
    revised = {r.step.stage for r in revisions}
    yield from stage_events(memory.belief, new.belief, mind, model.task, onsets, revised)
    yield from revision_events(memory.belief, new.belief, revisions, mind)
    yield from invariant_events(model, memory, new, mind)


def _concerns(model: MonitoredPhases, memory: TaskMemory) -> Iterator[AlertCondition]:
    yield from stage_concerns(memory.belief, memory.violated)
    yield from invariant_concerns(model, memory)


def _revised(memory: TaskMemory, new: TaskMemory) -> tuple[Revision, ...]:
    """Steps of stages that were reported done and are no longer."""
    before, after = memory.posterior, new.posterior
    undone = done_stages(memory.belief) - done_stages(new.belief)
    if before is None or after is None or not undone:
        return ()
    still = {s.step.stage for s in behind(after.likeliest.backpointer)}
    trails = (tuple(behind(w.value.backpointer)) for w in before.hypotheses.values())
    gone = undone - still
    found = next((t for t in trails if gone <= {b.step.stage for b in t}), ())
    return tuple(Revision(b.step, b.left, new.time) for b in found if b.step.stage in gone)


def _unexplained_since(
    model: MonitoredPhases, snapshot: TaskSnapshot, memory: TaskMemory
) -> tuple[tuple[int, float], ...]:
    """Objects that are unexplained now, each with its start time."""
    before = dict(memory.unexplained_since)
    optional = {a.name for a in model.task.actors if a.optional}
    now = unexplained(snapshot.mind, snapshot.bindings, model.settings, optional, model.task)
    return tuple((i, before.get(i, snapshot.mind.time)) for i in now)


def _interrupted(
    model: MonitoredPhases,
    snapshot: TaskSnapshot,
    memory: TaskMemory,
    broken: tuple[float | None, ...],
    bystanding: tuple[int, ...],
) -> tuple[str, tuple[int, ...]]:
    """Why the task is interrupted by something unsafe, or empty; and by which unexpected objects.

    An interruption lasts, unless the object that caused it turns out to be an actor or a bystander. A task
    that has ended is not interrupted, and bystanders interrupt none.
    """
    explained = {b.object_id for b in snapshot.bindings}.union(bystanding)
    if memory.interrupted and explained.isdisjoint(memory.interrupting_objects):
        return memory.interrupted, memory.interrupting_objects
    if memory.belief.verdict in OVER:
        return "", ()
    for alert in snapshot.mind.alerts:
        if set(alert.objects) & set(bystanding):
            continue
        if alert.kind in UNSAFE and alert.severity >= Severity.WARNING:
            strangers = alert.objects if alert.kind == "unexpected_object" else ()
            return alert.cause.rstrip("."), strangers
    return violation(model, broken, snapshot.mind.time, safety=True), ()
