"""Verification of one step under way: its status, from what is seen of it over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from visup.agent import Status, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.automaton.states import RunningDeadline, TaskStep
from visup.tasks.verification.observe import UNOBSERVED, ActionObservation
from visup.tasks.verification.reported import ReportedRelations, with_reported
from visup.tasks.verification.settings import TaskSettings

BAD = (Status.FAILING, Status.FAILED)

Worked = Callable[[float, float], float]
"""Seconds from one time to another in which work was not paused."""


class Moment(NamedTuple):
    """When something is seen.

    Attributes:
        now: Seconds.
        dt: Seconds since the last time.
    """

    now: float
    dt: float


@dataclass(frozen=True)
class StepMonitor:
    """State of the monitor of an active step; times in seconds.

    Attributes:
        entered: When the step was entered.
        turn: What was true before this shows nothing: the stage before it asked for the same, or had not
            begun then.
        status: How it stands.
        since: Since when it stands so.
        begun: When it was first seen to hold or to come nearer, or None.
        first_since: Since when the relation was true by which it was, or None.
        held: Whether it ever held.
        held_s: How long it has held without a break.
        broken_since: Since when it has not held, or None.
        fulfilled: Whether it has held for as long as it must.
        helped_by: Name of the relation by which it last held or came nearer, or None.
        helped_since: Since when that relation was true, or None.
        helped_at: When it last held or came nearer, or None.
        better_since: Since when it holds or comes nearer without a break, or None.
        contrary: Name of the contrary relation that is true now, or None.
        contrary_since: Since when.
        fault: The contrary by which it last failed, or None.
        fault_since: Since when that was so.
        late: Whether a `within` ran out before the step was over; there is no way back from that.
        missed: That `within`; None where it is the greatest delay that ran out.
        ceased: Whether it once held and then was seen not to.
        unseen_since: Since when nothing is known about it, or None.
        denied: Whether what the course says of its end was last seen not to hold.
        opened: Whether what the course says of its beginning was seen (see `StageCondition`).
        confidence: Of the last sighting, 0 to 1.
        early: Whether it had been so since before its turn, and has not ceased to be since: what a
            stage asks for must happen in it.
        parted_s: How long it has been seen not to be so, since its turn.
        after: When what comes before it was over; of what the task begins with, when that was.
        hasty_s: How long after that it began, where its course asks for a longer delay; else None.
        fulfilled_at: When it was first fulfilled, or None.
        told: What was told of it and of what came before it: what excludes that is told to begin no sooner.
    """

    entered: float
    turn: float = -math.inf
    status: Status = Status.ACTIVE
    since: float = 0.0
    begun: float | None = None
    first_since: float | None = None
    held: bool = False
    held_s: float = 0.0
    broken_since: float | None = None
    fulfilled: bool = False
    helped_by: str | None = None
    helped_since: float | None = None
    helped_at: float | None = None
    better_since: float | None = None
    contrary: str | None = None
    contrary_since: float | None = None
    fault: str | None = None
    fault_since: float = 0.0
    late: bool = False
    missed: RunningDeadline | None = None
    ceased: bool = False
    unseen_since: float | None = None
    confidence: float = 1.0
    denied: bool = False
    opened: bool = False
    early: bool = False
    parted_s: float = 0.0
    after: float = -math.inf
    hasty_s: float | None = None
    fulfilled_at: float | None = None
    told: ReportedRelations = ()

    @property
    def begun_anew(self) -> bool:
        """Whether what first showed that it holds or comes nearer came about in its turn."""
        return self.first_since is not None and self.first_since >= self.turn


def entered(now: float) -> StepMonitor:
    """The monitor of a step that begins now."""
    return StepMonitor(entered=now, since=now, after=now)


def update(
    monitor: StepMonitor,
    step: TaskStep,
    meaning: ActionDefinition,
    seen: ActionObservation,
    moment: Moment,
    settings: TaskSettings,
) -> StepMonitor:
    """Update the monitor of a step with one observation.

    Args:
        monitor: What was kept.
        step: The step.
        meaning: Its action.
        seen: What is seen of it now.
        moment: When that is.
        settings: Patience.

    Returns:
        What is kept now, with the new status.
    """
    now = moment.now
    if step.condition("begins") is not None and not monitor.opened:
        # Until it begins, nothing that is seen speaks for or against it.
        monitor = replace(monitor, opened=seen.entry is not None)
        if not monitor.opened:
            seen = replace(UNOBSERVED, observed=seen.observed, pauses=seen.pauses)
    if step.delay is not None:
        monitor = _note_haste(monitor, step, seen)
    worked = partial(seen.elapsed, step)
    if monitor.early:
        monitor, seen = _not_yet(monitor, seen, moment, settings, worked)
    noted = _note_progress(monitor, step, meaning, seen, moment, settings)
    noted = _note_contrary(noted, seen, now)
    noted = _note_lateness(noted, step, meaning, seen, now)
    status = _status(noted, seen, now, settings, worked)
    if status is noted.status:
        return noted
    noted = _note_told(noted, step, status, now)
    if status is not Status.FAILING:
        return replace(noted, status=status, since=now)
    # What had been reached is lost; the step fails since the contrary began, not since it was sure.
    since = now if noted.contrary_since is None else noted.contrary_since
    return replace(
        noted,
        status=status,
        since=since,
        fault=noted.contrary,
        fault_since=since,
        fulfilled=False,
        held_s=0.0,
    )


def _note_told(monitor: StepMonitor, step: TaskStep, status: Status, now: float) -> StepMonitor:
    """Record a reported change of status, with the relation that caused it."""
    by = monitor.helped_by if status is Status.PROGRESSING else None
    by = monitor.contrary if status in BAD else by
    return (
        replace(monitor, told=with_reported(monitor.told, step.actors, by, now)) if by else monitor
    )


def _note_lateness(
    monitor: StepMonitor,
    step: TaskStep,
    meaning: ActionDefinition,
    seen: ActionObservation,
    now: float,
) -> StepMonitor:
    """A `within` that has run out, or the greatest delay: there is no way back from that."""
    if monitor.late:
        return monitor
    missed = None if over(monitor, step, meaning) else overdue(step, seen, now)
    most = math.inf if step.delay is None else step.delay[1]
    delayed = monitor.begun is None and seen.elapsed(step, monitor.after, now) > most
    late = missed is not None or delayed
    return replace(monitor, late=True, missed=missed) if late else monitor


def _note_haste(monitor: StepMonitor, step: TaskStep, seen: ActionObservation) -> StepMonitor:
    """Disregard what begins sooner than its delay allows, until it begins again."""
    if monitor.held or monitor.early or seen.held_by is None or seen.holds is not Truth.TRUE:
        return monitor
    passed = seen.elapsed(step, monitor.after, seen.held_by.since)
    hasty = step.delay is not None and passed < step.delay[0]
    return replace(monitor, early=True, hasty_s=passed) if hasty else monitor


def _not_yet(
    monitor: StepMonitor,
    seen: ActionObservation,
    moment: Moment,
    settings: TaskSettings,
    worked: Worked,
) -> tuple[StepMonitor, ActionObservation]:
    """Disregard what held before its turn, until it has ceased; after a while it is a failure."""
    if not seen.observed:
        return monitor, seen
    if seen.holds is not Truth.TRUE:
        parted = monitor.parted_s + (moment.dt if seen.holds is Truth.FALSE else 0.0)
        early = parted < settings.gap_s
        return replace(monitor, parted_s=parted, early=early), replace(seen, helps=None)
    held_by = seen.held_by
    monitor = replace(monitor, parted_s=0.0)
    seen = replace(seen, holds=Truth.FALSE, held_by=None, helps=None, entry=None)
    if held_by is None or worked(monitor.entered, moment.now) < settings.early_s:
        return monitor, seen
    since = monitor.entered + settings.early_s
    return monitor, replace(seen, contrary=replace(held_by, since=since))


def over(monitor: StepMonitor, step: TaskStep, meaning: ActionDefinition) -> bool:
    """Whether a step is over by itself, whatever comes next."""
    told = step.hold_s is not None or step.condition("ends") is not None
    return monitor.fulfilled and (not meaning.lasts or told)


def overdue(step: TaskStep, seen: ActionObservation, now: float) -> RunningDeadline | None:
    """The first `within` around the step that has run out, or None; it does not run in pauses around it."""

    def left(due: RunningDeadline) -> float:
        if not due.pauses:
            return due.at - now
        return due.seconds - seen.pauses.elapsed(due.pauses, due.at - due.seconds, now)

    return next((d for d in step.deadlines if left(d) < 0.0), None)


def _note_progress(
    monitor: StepMonitor,
    step: TaskStep,
    meaning: ActionDefinition,
    seen: ActionObservation,
    moment: Moment,
    settings: TaskSettings,
) -> StepMonitor:
    now, dt = moment
    if not seen.observed:
        # Not seen is not "no": what was reached stays, the clocks stand still.
        return replace(monitor, unseen_since=_first(monitor.unseen_since, now), better_since=None)
    held, broken, ceased = monitor.held_s, monitor.broken_since, monitor.ceased
    if seen.holds is Truth.TRUE:
        held, broken = held + dt, None
        if step.hold_s is None and seen.held_by is not None:
            # What held already when the step began need not hold for as long once more.
            held = max(held, seen.elapsed(step, seen.held_by.since, now))
    elif seen.holds is Truth.FALSE:
        broken = _first(broken, now)
        if seen.elapsed(step, broken, now) >= settings.gap_s:
            held, ceased = 0.0, ceased or monitor.fulfilled
    helping = seen.helps is not None
    must = meaning.hold_s if step.hold_s is None else step.hold_s
    complete = held >= must - 1e-9
    if seen.over is not None:
        complete = seen.over is Truth.TRUE and (complete or step.hold_s is None)
    return replace(
        monitor,
        begun=_first(monitor.begun, now) if helping else monitor.begun,
        first_since=_first(monitor.first_since, seen.helps.since)
        if seen.helps
        else monitor.first_since,
        held=monitor.held or seen.holds is Truth.TRUE,
        held_s=held,
        broken_since=broken,
        fulfilled=monitor.fulfilled or complete,
        fulfilled_at=_first(monitor.fulfilled_at, now) if complete else monitor.fulfilled_at,
        helped_by=seen.helps.name if seen.helps else monitor.helped_by,
        helped_since=seen.helps.since if seen.helps else monitor.helped_since,
        helped_at=now if helping else monitor.helped_at,
        better_since=_first(monitor.better_since, now) if helping and not seen.contrary else None,
        ceased=ceased,
        denied=monitor.denied if seen.over in (None, Truth.UNKNOWN) else seen.over is Truth.FALSE,
        unseen_since=None,
        confidence=seen.helps.confidence if seen.helps else 1.0,
    )


def _note_contrary(monitor: StepMonitor, seen: ActionObservation, now: float) -> StepMonitor:
    """A contrary counts from when it was true within this step; holding outweighs it."""
    if not seen.observed:
        return monitor
    if seen.contrary is None or (seen.holds is Truth.TRUE and not seen.decisive):
        return replace(monitor, contrary=None, contrary_since=None)
    since = max(monitor.entered, seen.contrary.since)
    if monitor.contrary == seen.contrary.name and monitor.contrary_since is not None:
        since = min(since, monitor.contrary_since)
    confidence = seen.contrary.confidence
    return replace(
        monitor, contrary=seen.contrary.name, contrary_since=since, confidence=confidence
    )


def _status(
    monitor: StepMonitor,
    seen: ActionObservation,
    now: float,
    settings: TaskSettings,
    worked: Worked,
) -> Status:
    if monitor.late:
        return Status.FAILED
    if not seen.observed:
        return _status_unseen(monitor, now, settings, worked)
    if _fails(monitor, now, settings, worked):
        return Status.FAILED if _long_failing(monitor, now, settings, worked) else Status.FAILING
    if monitor.status in BAD and not _recovered(monitor, now, settings, worked):
        long = _long_failing(monitor, now, settings, worked)
        return Status.FAILED if long else monitor.status
    if monitor.begun is None:
        return Status.ACTIVE
    helped = monitor.helped_at
    stalled = helped is not None and worked(helped, now) >= settings.stalled_s
    return Status.STALLED if stalled else Status.PROGRESSING


def _status_unseen(
    monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked
) -> Status:
    """A failing stage stays so while it is not seen; any other becomes unknown after a while."""
    lasting = monitor.status in (Status.FAILING, Status.FAILED, Status.ACTIVE)
    unseen = monitor.unseen_since
    long = unseen is not None and worked(unseen, now) >= settings.unseen_s
    return Status.UNKNOWN if long and not lasting else monitor.status


def _fails(monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked) -> bool:
    if monitor.contrary_since is None:
        return False
    patience = settings.contrary_s if monitor.begun is not None else settings.contrary_early_s
    return worked(monitor.contrary_since, now) >= patience - 1e-9


def _long_failing(monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked) -> bool:
    if monitor.status is Status.FAILED:
        return True
    return monitor.status is Status.FAILING and worked(monitor.since, now) >= settings.failed_s


def _recovered(monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked) -> bool:
    """What has long failed must go well for longer; for good, for as long as that took."""
    if monitor.better_since is None:
        return False
    lasted = worked(monitor.since, monitor.better_since)
    must = max(settings.recover_s, settings.recover_share * lasted)
    must = settings.failed_s if monitor.status is Status.FAILED else must
    return worked(monitor.better_since, now) >= must


def _first(earlier: float | None, now: float) -> float:
    return now if earlier is None else earlier
