"""Events of supervision when a belief about a task changes, and alert conditions while it is bad."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from types import MappingProxyType

from visup.agent import (
    AlertCondition,
    Event,
    Mind,
    Severity,
    StageBelief,
    Status,
    TaskBelief,
    Verdict,
)
from visup.agent.model.fast_replace import replace
from visup.rules.wording.sentences import describe
from visup.tasks.automaton.backpointers import Revision
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import stages_inside
from visup.tasks.supervision.sentences import stage_sentence, verdict_sentence
from visup.tasks.supervision.stage_beginnings import is_first
from visup.tasks.supervision.task_inference import TaskActivity
from visup.tasks.verification.step_monitor import BAD

KINDS = {
    Status.PROGRESSING: "stage_progressing",
    Status.PAUSED: "stage_paused",
    Status.STALLED: "stage_stalled",
    Status.FAILING: "stage_failing",
    Status.FAILED: "stage_failed",
    Status.DONE: "stage_done",
    Status.UNKNOWN: "stage_unknown",
}
WORTH_SAYING_S = 0.25
"""The onset of a stage is mentioned in its sentence if it is at least this long ago, seconds."""

NOTHING: Mapping[str, float] = MappingProxyType({})

GOES_ON = (Status.ACTIVE, Status.PROGRESSING, Status.STALLED)
"""Statuses after a pause for which only the resumption is reported."""


def stage_events(
    before: TaskBelief,
    now: TaskBelief,
    mind: Mind,
    task: Task,
    onsets: Mapping[str, float] = NOTHING,
    revised: Collection[str] = (),
) -> Iterator[Event]:
    """Events of what changed between two beliefs about a task.

    Args:
        before: The belief of the last step.
        now: The belief of this step.
        mind: The mind, for the time; it may still hold the old belief.
        task: The task, for the texts of its stages.
        onsets: Stage that begins now -> time when it most probably began, seconds; missing: now.
        revised: Stages whose report of completion is taken back: they have not begun again.

    Yields:
        Events of stages in the order of the task, then a change of the verdict.
    """
    was = {s.stage: s for s in before.stages}
    changed = [s for s in now.stages if _is_news(was.get(s.stage), s)]
    if not changed and now.verdict is before.verdict:
        return
    mind = replace(mind, tasks=(now,))  # objects are named by their actors in this task
    first, done = is_first(before.stages), done_stages(before)
    for stage in changed:
        for kind in _kinds(was.get(stage.stage), stage, stage.stage in revised):
            undone = stage.stage in done and stage.status in BAD
            event = _stage_event(kind, stage, now, mind, undone)
            if first and kind == "stage_started" and event.objects:
                event = replace(event, text=_introduction(stage, now, mind))
            if kind == "stage_started":
                event = _dated(event, onsets.get(stage.stage, mind.time))
                event = replace(event, text=event.text + _own_words(stage.stage, before, task))
            yield event
    if now.verdict is not before.verdict and _worth_telling(before.verdict, now.verdict):
        yield _verdict_event(now, mind)


def activity_events(
    before: TaskActivity, now: TaskActivity, belief: TaskBelief, mind: Mind
) -> Iterator[Event]:
    """The event of a task that is inferred to be in progress, or no longer is, if that has changed."""
    if before.reportable == now.reportable:
        return
    kind = "task_active" if now.reportable else "task_inactive"
    said = "appears to be in progress" if now.reportable else "turns out not to be in progress"
    chance = f"{now.chance:.0%}".replace("%", " %")
    yield Event(
        kind,
        mind.time,
        mind.frame_index,
        f"Task `{belief.task}` {said} ({chance}).",
        _objects(belief),
        now.chance if now.reportable else 1.0 - now.chance,
        data={"task": belief.task},
    )


def played(belief: TaskBelief, actors: Sequence[str]) -> tuple[int, ...]:
    """Ids of the objects of the given actors, without unbound ones."""
    who = {b.actor: b.object_id for b in belief.bindings}
    ids = (who.get(a) for a in actors)
    return tuple(i for i in ids if i is not None)


def revision_events(
    before: TaskBelief, now: TaskBelief, revisions: Sequence[Revision], mind: Mind
) -> Iterator[Event]:
    """Events of stages that were reported done, and are now believed not to be done, or not to have begun."""
    done, still = done_stages(before), done_stages(now)
    earliest = {r.step.stage: r for r in revisions}  # revisions come latest step first
    for stage, revision in earliest.items():
        if stage in done and stage not in still:
            data = {"task": now.task, "stage": stage, "told": revision.reported}
            text = f"Stage {revision.text(stage in _under_way(now))}."
            yield Event(
                "stage_revised",
                mind.time,
                mind.frame_index,
                text,
                _objects(now),
                now.confidence,
                data=data,
            )


def _under_way(belief: TaskBelief) -> set[str]:
    """The stages that go on."""
    return {s.stage for s in belief.stages if s.status in GOES_ON}


def done_stages(belief: TaskBelief) -> set[str]:
    """The stages that are reported done."""
    return {s.stage for s in belief.stages if s.status is Status.DONE}


def stage_concerns(belief: TaskBelief, violated: str = "") -> Iterator[AlertCondition]:
    """An alert condition for each stage that is failing or has failed.

    An interrupted task is not expected to continue, so its stages raise none.

    Args:
        belief: Belief about the task.
        violated: The broken invariant by which the task has failed, or empty; it has an alert condition of
            its own, so its stage has none.
    """
    if belief.verdict is Verdict.INTERRUPTED:
        return
    for stage in belief.stages:
        if stage.status in BAD and not (violated and stage.evidence == violated):
            cause = stage_sentence("stage_failing", stage.stage, belief.task, stage.evidence)
            yield AlertCondition(
                "stage_failing",
                _objects(belief),
                Severity.WARNING,
                cause,
                (f"{_capital(stage.evidence)}.",),
                key=f"{belief.task}/{stage.stage}",
            )


def _is_news(was: StageBelief | None, now: StageBelief) -> bool:
    before = Status.PENDING if was is None else was.status
    return now.status is not before or now.begun is not (was is not None and was.begun)


def _kinds(was: StageBelief | None, now: StageBelief, revised: bool) -> Iterator[str]:
    before = Status.PENDING if was is None else was.status
    # A stage that was reported done counts as begun again only if it makes progress or stalls: if it fails,
    # it is undone instead.
    again = before is Status.DONE and now.status in (Status.PROGRESSING, Status.STALLED)
    if not revised and (again or (now.begun and not (was is not None and was.begun))):
        yield "stage_started"
    if now.status is before:
        return
    if before is Status.PAUSED and now.status in GOES_ON:
        yield "stage_resumed"
        return
    if now.status in KINDS and not (before is Status.UNKNOWN and now.status is Status.PENDING):
        yield KINDS[now.status]


def _worth_telling(was: Verdict, now: Verdict) -> bool:
    """Whether a change of verdict is an event; the beginning of a task is reported by its stages."""
    return not (was is Verdict.UNKNOWN and now is Verdict.IN_PROGRESS)


def _stage_event(
    kind: str, stage: StageBelief, belief: TaskBelief, mind: Mind, undone: bool
) -> Event:
    bad = kind in ("stage_failing", "stage_failed") and belief.verdict is not Verdict.INTERRUPTED
    return Event(
        kind,
        mind.time,
        mind.frame_index,
        stage_sentence(kind, stage.stage, belief.task, stage.evidence, undone),
        _objects(belief),
        stage.confidence,
        Severity.WARNING if bad else Severity.INFO,
        {"task": belief.task, "stage": stage.stage, "status": str(stage.status)},
    )


def _dated(event: Event, began: float) -> Event:
    """The event of a beginning stage with its onset (seconds), in the sentence as well if much earlier."""
    data = {**event.data, "began": round(began, 3)}
    if event.time - began < WORTH_SAYING_S:
        return replace(event, data=data)
    text = event.text.replace(" has begun", f" has begun, at about {began:.1f} s", 1)
    return replace(event, data=data, text=text)


def _introduction(stage: StageBelief, belief: TaskBelief, mind: Mind) -> str:
    """The sentence for the beginning of a task, which names the objects that take part."""
    who = ", and ".join(describe(mind, i) for i in _objects(belief))
    return f"Stage `{stage.stage}` of task `{belief.task}` has begun, with {who}."


def _own_words(name: str, before: TaskBelief, task: Task) -> str:
    """The task file's own text of a beginning stage, and of stages that begin with it."""
    begun = {s.stage for s in before.stages if s.begun}
    groups = [s for s in task.stages if s.text and s.name != name]
    inside = ((g, stages_inside(task, g.name)) for g in groups)
    texts = [g.text for g, names in inside if name in names and not names & begun]
    own = task.stage(name)
    texts += [own.text] if own and own.text else []
    return "".join(f" {_capital(t).rstrip('.')}." for t in texts)


def _verdict_event(belief: TaskBelief, mind: Mind) -> Event:
    good = belief.verdict in (Verdict.SUCCEEDED, Verdict.IN_PROGRESS)
    return Event(
        "verdict",
        mind.time,
        mind.frame_index,
        verdict_sentence(belief.task, belief.verdict, belief.evidence),
        _objects(belief),
        belief.confidence,
        Severity.INFO if good else Severity.WARNING,
        {"task": belief.task, "verdict": str(belief.verdict)},
    )


def _objects(belief: TaskBelief) -> tuple[int, ...]:
    return tuple(b.object_id for b in belief.bindings if b.object_id is not None)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
