"""The sentences of supervision: evidence for stages, texts of events."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from visup.agent import Status, TaskBelief, Verdict
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.automaton.states import TaskStep
from visup.tasks.grammar.conditions import Action
from visup.tasks.grammar.nodes import Comparison, Task
from visup.tasks.grammar.structure import fact_key
from visup.tasks.verification.pauses import Pause
from visup.tasks.verification.reported_relations import since_reported
from visup.tasks.verification.step_monitor import StepMonitor

SHORT_S = 0.6
"""Intervals shorter than this, seconds, are reported by their beginning only."""


def names(words: Sequence[str]) -> str:
    """Names in a sentence: `the arm and the satellite`; without names, `the signal`."""
    the = [f"the {w.replace('_', ' ')}" for w in words]
    if len(the) < 2:
        return the[0] if the else "the signal"
    return f"{', '.join(the[:-1])} and {the[-1]}"


def evidence(
    step: TaskStep, meaning: ActionDefinition, monitor: StepMonitor, now: float, actions: Words
) -> str:
    """The evidence for the status of a step: one clause, without capital and full stop.

    Args:
        step: The step.
        meaning: Its action.
        monitor: Its monitor.
        now: Current time, seconds.
        actions: All actions, for their wording.
    """
    who, alone = names(step.actors), len(step.actors) < 2
    have, was = ("has", "was") if alone else ("have", "were")
    match monitor.status:
        case Status.FAILING | Status.FAILED if monitor.early:
            return _too_soon(step, meaning, monitor)
        case Status.FAILED if monitor.late:
            return _late(step, monitor)
        case Status.FAILING | Status.FAILED if monitor.contrary is not None:
            known = monitor.entered if monitor.contrary_since is None else monitor.contrary_since
            since = since_reported(monitor.reported, step.actors, monitor.contrary, known)
            what = _clause(monitor.contrary, actions, f"{who} {have} been", "has held")
            return (
                f"{what} since {since:.1f} s; {_demand(step, meaning, monitor.contrary, actions)}"
            )
        case Status.FAILING | Status.FAILED if monitor.fault is not None:
            what = _clause(monitor.fault, actions, f"{who} {was}", "held")
            stays = "the stage has" if _is_condition(monitor.fault, actions) else have
            what = f"{what} at {monitor.fault_since:.1f} s and {stays} not recovered"
            return f"{what}; {_demand(step, meaning, monitor.fault, actions)}"
        case Status.PROGRESSING if monitor.helped_since is not None:
            by, known = monitor.helped_by or "", max(0.0, monitor.helped_since)
            since = since_reported(monitor.reported, step.actors, by, known)
            return f"{_clause(by, actions, f'{who} {have} been', 'has held')} since {since:.1f} s"
        case Status.STALLED if monitor.helped_at is not None:
            return f"{who} {have} not been {meaning.text} since {monitor.helped_at:.1f} s"
        case Status.UNKNOWN if monitor.unseen_since is not None:
            return f"{who} {have} not been observable since {monitor.unseen_since:.1f} s"
    return f"{who} should be {meaning.text}"


def outcome(
    step: TaskStep,
    meaning: ActionDefinition,
    monitor: StepMonitor,
    now: float,
    followed: Sequence[float] = (),
    denied: float | None = None,
) -> tuple[Status, str]:
    """The status in which a step ended, and why.

    Args:
        step: The step.
        meaning: Its action.
        monitor: Its monitor.
        now: Current time, seconds.
        followed: Time since when each next step has been observed, seconds; limits the reported interval of
            an action that lasts until then.
        denied: Time since when the action has been contradicted, seconds, or None.

    Returns:
        DONE; FAILED if it ended before its `for` was satisfied, after its deadline, or while contradicted;
        UNKNOWN if it could not be observed, or may have held before.
    """
    who, was = names(step.actors), "was" if len(step.actors) < 2 else "were"
    if monitor.late:
        return Status.FAILED, _late(step, monitor)
    if step.hold_s is not None and not monitor.fulfilled:
        return Status.FAILED, f"{who} should be {meaning.text} for {step.hold_s:g} s, but {was} not"
    end = step.condition("ends")
    if end is not None and not monitor.fulfilled:
        if monitor.denied:
            return (
                Status.FAILED,
                f"`{step.stage}` ends when {end.condition}, which was not the case",
            )
        return Status.UNKNOWN, f"whether {end.condition} could not be seen"
    if meaning.lasts and monitor.begun is None:
        return Status.UNKNOWN, f"{who} {was} never seen {meaning.text}, but what follows was seen"
    if meaning.lasts or monitor.held:
        return Status.DONE, f"{who} {_held(step, meaning, monitor, now, followed, denied)}"
    if monitor.held_at is not None and not monitor.early:
        until = f"until {monitor.held_at:.1f} s, not while what is joined to it by `&` was so"
        return Status.FAILED, f"{who} {was} {meaning.text} {until}"
    if monitor.broken_since is not None:
        return Status.FAILED, f"{who} should be {meaning.text}, but {was} not"
    return Status.UNKNOWN, f"whether {who} {was} {meaning.text} could not be seen"


def _held(
    step: TaskStep,
    meaning: ActionDefinition,
    monitor: StepMonitor,
    now: float,
    followed: Sequence[float],
    denied: float | None,
) -> str:
    """From or until when a completed step held."""
    was, have = ("was", "has") if len(step.actors) == 1 else ("were", "have")
    since, until = lasted(step, meaning, monitor, now, followed, denied)
    if until is None:
        return f"{have} been {meaning.text} since {since:.1f} s"
    begun = since <= _first_known(monitor)
    if begun and until - since >= SHORT_S:
        return f"{was} {meaning.text} until {until:.1f} s"
    if until - since < 0.05:
        return f"{was} {meaning.text} at {until:.1f} s"
    return f"{was} {meaning.text} from {since:.1f} s to {until:.1f} s"


def in_retrospect(why: str, at: float) -> str:
    """Evidence at the end of a stage, in the past perfect, since it may no longer hold.

    >>> in_retrospect("the arm and the part have been coupled since 3.9 s", 4.9)
    'at 4.9 s the arm and the part had been coupled since 3.9 s'
    """
    for have in (" have been ", " has been "):
        who, found, what = why.partition(have)
        if found and " since " in what:
            return f"at {at:.1f} s {who} had been {what}"
    return why


def lasted(
    step: TaskStep,
    meaning: ActionDefinition,
    monitor: StepMonitor,
    now: float,
    followed: Sequence[float] = (),
    denied: float | None = None,
) -> tuple[float, float | None]:
    """The interval reported for a completed step, seconds.

    The arguments are those of `outcome`.

    Returns:
        Begin and end; the end is None if it still holds.
    """
    latest = monitor.helped_since or 0.0
    if meaning.lasts or monitor.held_s == 0.0:
        since, until = _first_known(monitor), last_held(meaning, monitor, now, followed)
        told = since_reported(monitor.reported, step.actors, meaning.name, since)
        # If something else was reported in between, it began anew.
        return (since if told == since else max(told, latest)), until
    known = max(0.0, now - monitor.held_s, latest)
    since = since_reported(monitor.reported, step.actors, meaning.name, known)
    return since, denied if denied is not None and denied > since else None


def _first_known(monitor: StepMonitor) -> float:
    """The earliest known time at which a step held or progressed, seconds; minus infinity if unknown."""
    known = (t for t in (monitor.begun, monitor.helped_since) if t is not None)
    return min(known, default=-math.inf)


def last_held(
    meaning: ActionDefinition, monitor: StepMonitor, now: float, followed: Sequence[float]
) -> float:
    """The end of the interval reported for a completed step, seconds.

    Args:
        meaning: Its action.
        monitor: Its monitor.
        now: Current time, seconds.
        followed: See `outcome`.
    """
    over = now if monitor.helped_at is None else monitor.helped_at
    if not meaning.lasts and monitor.broken_since is not None:
        over = monitor.broken_since
    start = _first_known(monitor)
    if monitor.status is Status.PROGRESSING:
        start = max(start, monitor.since)  # it was reported to go on then
    return min((over, *(since for since in followed if since > start)))


def _too_soon(step: TaskStep, meaning: ActionDefinition, monitor: StepMonitor) -> str:
    """Why a step was too early: before its turn, or before the end of its delay."""
    if step.delay is not None and monitor.hasty_s is not None:
        return (
            f"it began {max(0.0, monitor.hasty_s):.1f} s after the stage before it, "
            f"but should begin no sooner than {step.delay[0]:g} s after it"
        )
    was = "was" if len(step.actors) < 2 else "were"
    return (
        f"{names(step.actors)} {was} {meaning.text} before stage `{step.stage}` began, "
        "but should become so during it"
    )


def before_its_turn(step: TaskStep, meaning: ActionDefinition, since: float, first: str) -> str:
    """Why the order is broken: one clause."""
    have = "has" if len(step.actors) < 2 else "have"
    return (
        f"{names(step.actors)} {have} been {meaning.text} since {since:.1f} s, "
        f"before the turn of stage `{step.stage}`: stage `{first}` must be done first"
    )


def paused_by(pause: Pause, task: Task, actions: Words) -> str:
    """The reason for a pause and its beginning: one clause."""
    condition = pause.condition.condition
    key, actors = (
        fact_key(task, condition) if isinstance(condition, Action | Comparison) else ("", ())
    )
    if not actors:
        return f"`{condition}` since {pause.since:.1f} s"
    have = "has" if len(actors) < 2 else "have"
    return f"{names(actors)} {have} been {_say(key, actions)} since {pause.since:.1f} s"


def _late(step: TaskStep, monitor: StepMonitor) -> str:
    """The evidence for a step that ended or began too late."""
    due = monitor.missed
    if due is not None:
        return f"`{due.stage}` should be done within {due.seconds:g} s, but was not"
    assert step.delay is not None
    return (
        f"`{step.stage}` should begin no later than {step.delay[1]:g} s after the stage before it, "
        "but did not"
    )


def stage_sentence(kind: str, stage: str, task: str, why: str, undone: bool = False) -> str:
    """The sentence of an event of a stage; `undone` if it was reported complete, and no longer is."""
    said = UNDONE if undone else STAGE_WORDS[kind]
    return f"{said.format(stage=stage, task=task)}: {why}."


def verdict_sentence(task: str, verdict: Verdict, why: str) -> str:
    """The sentence of a verdict."""
    # The reason for an interruption is the sentence of an alert.
    why = f"o{why[1:]}" if why.startswith("Object ") else why
    return f"Task `{task}` {VERDICT_WORDS[verdict]}{': ' + why if why else ''}."


Words = Mapping[str, ActionDefinition]

UNDONE = "Stage `{stage}` is no longer complete"
"""For a stage that was reported complete and is failing, or has failed."""

STAGE_WORDS = {
    "stage_started": "Stage `{stage}` of task `{task}` has begun",
    "stage_progressing": "Stage `{stage}` is progressing satisfactorily",
    "stage_paused": "Stage `{stage}` is paused",
    "stage_resumed": "Stage `{stage}` has resumed",
    "stage_stalled": "Stage `{stage}` makes no progress",
    "stage_failing": "Stage `{stage}` is failing",
    "stage_failed": "Stage `{stage}` has failed",
    "stage_done": "Stage `{stage}` is complete",
    "stage_unknown": "Stage `{stage}` cannot be judged",
}

VERDICT_WORDS = {
    Verdict.IN_PROGRESS: "is in progress again",
    Verdict.SUCCEEDED: "has succeeded",
    Verdict.FAILED: "has failed",
    Verdict.INTERRUPTED: "is interrupted",
    Verdict.UNKNOWN: "cannot be judged",
}


def _say(relation: str, actions: Words) -> str:
    meaning = actions.get(relation)
    return meaning.text if meaning else relation.replace("_", " ")


def _clause(relation: str, actions: Words, who_are: str, held: str) -> str:
    """A relation as a clause; a condition that a course states is quoted."""
    if _is_condition(relation, actions):
        return f"`{relation}` {held}"
    return f"{who_are} {_say(relation, actions)}"


def _demand(step: TaskStep, meaning: ActionDefinition, relation: str, actions: Words) -> str:
    """What the stage requires of a step that fails by a relation."""
    if _is_condition(relation, actions):
        return f"stage `{step.stage}` fails when it does"
    them = "it" if len(step.actors) < 2 else "them"
    return f"stage `{step.stage}` requires {them} to be {meaning.text}"


def _is_condition(relation: str, actions: Words) -> bool:
    """Whether the name of a relation is the text of a condition that a course states."""
    return relation not in actions and not relation.isidentifier()


def prospects_text(belief: TaskBelief) -> str:
    """The next stages and the probability of success, in one line."""
    if belief.success is None:
        return "next: unknown"
    if belief.verdict in (Verdict.FAILED, Verdict.INTERRUPTED):
        return "next: nothing, the task is over"
    chances = [(f"`{p.stage}`" if p.stage else "the end", p.probability) for p in belief.prospects]
    lost = 1.0 - sum(p.probability for p in belief.prospects)
    said = [
        f"{what} ({chance:.0%})" for what, chance in (*chances, ("failure", lost)) if chance >= 0.01
    ]
    return f"next: {', '.join(said)}; ends well with a probability of {belief.success:.0%}"
