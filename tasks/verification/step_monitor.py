"""Runtime monitor of one active step: its status from observations over time."""

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
from visup.tasks.verification.observation import UNOBSERVED, ActionObservation, overdue
from visup.tasks.verification.recovery import greatest_gap, has_come_back
from visup.tasks.verification.reported_relations import ReportedRelations, with_reported
from visup.tasks.verification.settings import TaskSettings

BAD = (Status.FAILING, Status.FAILED)

Worked = Callable[[float, float], float]
"""Working time between two times, without pauses, seconds."""


class Moment(NamedTuple):
    """The time of an observation, and since the last one, seconds."""

    now: float
    dt: float


@dataclass(frozen=True)
class StepMonitor:
    """State of the monitor of an active step; times in seconds.

    Attributes:
        entered: When the step was entered.
        turn: Time before which relations that became true are not evidence: the previous stage required the
            same, or had not begun then.
        status: Current status.
        since: Since when it has that status.
        begun: When it was first observed to hold or progress, or was missed, or None.
        first_since: Since when the relation of that first observation was true, or None.
        held: Whether it ever held.
        held_from: Since when it held when it last did, or None.
        held_at: When it last held, or None.
        held_s: How long it has held without a break.
        broken_since: Since when it has not held, or None.
        fulfilled: Whether it has held for as long as required.
        helped_by: Name of the relation by which it last held or progressed, or None.
        helped_since: Since when that relation was true, or None.
        helped_at: When it last held or progressed, or None.
        better_since: Since when it holds or progresses without a break, or None.
        contrary: Name of the contrary relation that is true now, or None.
        contrary_since: Since when.
        contrary_arose: Whether the course states that contrary, and it became true while the step was active.
        fault: The contrary by which it last failed, or None.
        fault_since: Since when that was true.
        late: Whether a `within` expired before the step was over, which is final.
        missed: That `within`; None if the greatest delay expired.
        ceased: Whether it held once and was then observed not to.
        unseen_since: Since when nothing is known about it, or None.
        unseen_s: How long nothing was known about it since it was entered.
        denied: Whether the end condition of the course was last observed not to hold.
        opened: Whether the begin condition of the course was observed (see `StageCondition`).
        confidence: Confidence of the last observation, 0 to 1.
        early: Whether it has held since before its turn without a break: then it must cease, and begin again.
        parted_s: How long an `early` action has been observed not to hold without a break.
        after: When the previous step was over; for the first step, the start.
        hasty_s: Delay after which it began, if the course requires a longer one; else None.
        fulfilled_at: When it was first fulfilled, or None.
        reported: Relations reported of this and of earlier steps; incompatible ones then begin later.
        earliest: The earliest time at which it can have begun: when the previous step was first observed, or
            had lasted as long as required.
        farthest: Greatest gap between its actors since it fails, pixels; None if it does not, or if unknown.
    """

    entered: float
    turn: float = -math.inf
    status: Status = Status.ACTIVE
    since: float = 0.0
    begun: float | None = None
    first_since: float | None = None
    held: bool = False
    held_from: float | None = None
    held_at: float | None = None
    held_s: float = 0.0
    broken_since: float | None = None
    fulfilled: bool = False
    helped_by: str | None = None
    helped_since: float | None = None
    helped_at: float | None = None
    better_since: float | None = None
    contrary: str | None = None
    contrary_since: float | None = None
    contrary_arose: bool = False
    fault: str | None = None
    fault_since: float = 0.0
    late: bool = False
    missed: RunningDeadline | None = None
    ceased: bool = False
    unseen_since: float | None = None
    unseen_s: float = 0.0
    confidence: float = 1.0
    denied: bool = False
    opened: bool = False
    early: bool = False
    parted_s: float = 0.0
    after: float = -math.inf
    hasty_s: float | None = None
    fulfilled_at: float | None = None
    reported: ReportedRelations = ()
    earliest: float = -math.inf
    greatest_gap: float | None = None

    @property
    def begun_anew(self) -> bool:
        """Whether the relation by which it first held or progressed became true in its turn."""
        return self.first_since is not None and self.first_since >= self.turn


def entered(now: float) -> StepMonitor:
    """The monitor of a step that begins now."""
    return StepMonitor(entered=now, since=now, after=now)


def update_monitor(
    monitor: StepMonitor,
    step: TaskStep,
    meaning: ActionDefinition,
    seen: ActionObservation,
    moment: Moment,
    settings: TaskSettings,
) -> StepMonitor:
    """Update the monitor of a step with one observation.

    Args:
        monitor: The previous state.
        step: The step.
        meaning: Its action.
        seen: The observation.
        moment: Its time.
        settings: Time constants.

    Returns:
        The new state, with the new status.
    """
    now = moment.now
    monitor, seen = _beginning(monitor, step, seen)
    if step.delay is not None:
        monitor = _mark_hasty(monitor, step, seen)
    worked = partial(seen.elapsed, step)
    if monitor.early:
        monitor, seen = _disregard_early(monitor, seen, moment, settings, worked)
    gap = greatest_gap(monitor.greatest_gap, seen) if monitor.status in BAD else None
    monitor = monitor if gap == monitor.greatest_gap else replace(monitor, greatest_gap=gap)
    noted = _note_progress(monitor, step, meaning, seen, moment, settings)
    noted = _note_contrary(noted, seen, now)
    noted = _note_lateness(noted, step, meaning, seen, now)
    status = _status(noted, seen, now, settings, worked)
    if status is noted.status:
        return noted
    noted = _note_reported(noted, step, status, now)
    if status is not Status.FAILING:
        return replace(noted, status=status, since=now)
    # Progress is reset. The failure is dated to the onset of the contrary, not to its confirmation.
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


def _beginning(
    monitor: StepMonitor, step: TaskStep, seen: ActionObservation
) -> tuple[StepMonitor, ActionObservation]:
    """What counts until a step has begun: nothing before its begin condition; then also a sudden trend."""
    if monitor.begun is not None:
        return monitor, seen
    if step.condition("begins") is not None and not monitor.opened:
        monitor = replace(monitor, opened=seen.entry is not None)
        if not monitor.opened:
            return monitor, replace(UNOBSERVED, observed=seen.observed, pauses=seen.pauses)
    return monitor, seen if seen.helps is not None else replace(seen, helps=seen.new_trend)


def _note_reported(monitor: StepMonitor, step: TaskStep, status: Status, now: float) -> StepMonitor:
    """Record a reported change of status, with the relation that caused it."""
    by = monitor.helped_by if status is Status.PROGRESSING else None
    by = monitor.contrary if status in BAD else by
    if not by:
        return monitor
    return replace(monitor, reported=with_reported(monitor.reported, step.actors, by, now))


def _note_lateness(
    monitor: StepMonitor,
    step: TaskStep,
    meaning: ActionDefinition,
    seen: ActionObservation,
    now: float,
) -> StepMonitor:
    """Record an expired `within` or greatest delay, which is final."""
    if monitor.late:
        return monitor
    missed = None if over(monitor, step, meaning) else overdue(step, seen, now)
    most = math.inf if step.delay is None else step.delay[1]
    delayed = monitor.begun is None and seen.elapsed(step, monitor.after, now) > most
    late = missed is not None or delayed
    return replace(monitor, late=True, missed=missed) if late else monitor


def _mark_hasty(monitor: StepMonitor, step: TaskStep, seen: ActionObservation) -> StepMonitor:
    """Mark an action that begins before its least delay as early: it must begin again."""
    if monitor.held or monitor.early or seen.held_by is None or seen.holds is not Truth.TRUE:
        return monitor
    passed = seen.elapsed(step, monitor.after, seen.held_by.since)
    hasty = step.delay is not None and passed < step.delay[0]
    return replace(monitor, early=True, hasty_s=passed) if hasty else monitor


def _disregard_early(
    monitor: StepMonitor,
    seen: ActionObservation,
    moment: Moment,
    settings: TaskSettings,
    worked: Worked,
) -> tuple[StepMonitor, ActionObservation]:
    """Disregard an action that held before its turn, until it ceases; after a while that is a contrary."""
    if not seen.observed:
        return monitor, seen
    if seen.holds is not Truth.TRUE:
        parted = monitor.parted_s + (moment.dt if seen.holds is Truth.FALSE else 0.0)
        early = parted < settings.gap_s
        return replace(monitor, parted_s=parted, early=early), replace(seen, helps=None)
    held_by = seen.held_by
    monitor = replace(monitor, parted_s=0.0)
    seen = replace(seen, holds=Truth.FALSE, held_by=None, helps=None, entry=None)
    beyond = worked(monitor.entered, moment.now) - settings.early_s
    if held_by is None or beyond < 0.0:
        return monitor, seen
    # Counted back from now, because there may have been pauses before.
    return monitor, replace(seen, contrary=replace(held_by, since=moment.now - beyond))


def without_hold(monitor: StepMonitor) -> StepMonitor:
    """A monitor for which the action has not held yet in its turn."""
    return replace(monitor, held=False, held_s=0.0, fulfilled=False)


def over(monitor: StepMonitor, step: TaskStep, meaning: ActionDefinition) -> bool:
    """Whether a step is over by itself, without the next one having begun."""
    explicit = step.hold_s is not None or step.condition("ends") is not None
    return monitor.fulfilled and (not meaning.lasts or explicit)


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
        # Unobserved is not false: progress is retained and the clocks stand still.
        unseen_since, unseen_s = _first(monitor.unseen_since, now), monitor.unseen_s + dt
        return replace(monitor, unseen_since=unseen_since, unseen_s=unseen_s, better_since=None)
    held, broken, ceased = monitor.held_s, monitor.broken_since, monitor.ceased
    if seen.holds is Truth.TRUE:
        held, broken = held + dt, None
        if seen.held_by is not None and step.hold_s is None:
            # Time for which it held before the step began counts too.
            held = max(held, seen.elapsed(step, seen.held_by.since, now))
        elif seen.held_by is not None:
            # It has held for longer than it has been known to.
            since = max(seen.held_by.since, monitor.entered)
            held = max(held, seen.elapsed(step, since, now) - monitor.unseen_s)
    elif seen.holds is Truth.FALSE:
        broken = _first(broken, now)
        if seen.elapsed(step, broken, now) >= settings.gap_s:
            held, ceased = 0.0, ceased or monitor.fulfilled
    holding, helping = seen.holds is Truth.TRUE, seen.helps is not None
    required = meaning.hold_s if step.hold_s is None else step.hold_s
    complete = held >= required - 1e-9
    if seen.over is not None:
        complete = seen.over is Truth.TRUE and (complete or step.hold_s is None)
    return replace(
        monitor,
        begun=_first(monitor.begun, now) if helping else monitor.begun,
        first_since=_first(monitor.first_since, seen.helps.since)
        if seen.helps
        else monitor.first_since,
        held=monitor.held or holding,
        held_from=seen.held_by.since if holding and seen.held_by else monitor.held_from,
        held_at=now if holding else monitor.held_at,
        held_s=held,
        broken_since=broken,
        fulfilled=monitor.fulfilled or complete,
        fulfilled_at=_first(monitor.fulfilled_at, now) if complete else monitor.fulfilled_at,
        helped_by=seen.helps.name if seen.helps else monitor.helped_by,
        helped_since=seen.helps.since if seen.helps else monitor.helped_since,
        helped_at=now if helping else monitor.helped_at,
        better_since=_first(monitor.better_since, now)
        if helping and not seen.contrary and has_come_back(monitor.greatest_gap, seen)
        else None,
        ceased=ceased,
        denied=monitor.denied if seen.over in (None, Truth.UNKNOWN) else seen.over is Truth.FALSE,
        unseen_since=None,
        confidence=seen.helps.confidence if seen.helps else 1.0,
    )


def _note_contrary(monitor: StepMonitor, seen: ActionObservation, now: float) -> StepMonitor:
    """Record a contrary, from its onset and the action's end; none while that holds, or held and is over."""
    if not seen.observed:
        return monitor
    holds = seen.holds is Truth.TRUE and not seen.decisive
    if seen.contrary is None or holds or (monitor.held and seen.unreached is not None):
        return replace(monitor, contrary=None, contrary_since=None)
    left = monitor.entered if seen.decisive or monitor.held_at is None else monitor.held_at
    since = max(monitor.entered, left, seen.contrary.since)
    if monitor.contrary == seen.contrary.name and monitor.contrary_since is not None:
        since = min(since, monitor.contrary_since)
    return replace(
        monitor,
        contrary=seen.contrary.name,
        contrary_since=since,
        contrary_arose=seen.decisive and since > monitor.entered,
        confidence=seen.contrary.confidence,
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
    helped = monitor.helped_at
    if monitor.begun is None or helped is None:
        return Status.ACTIVE
    stalled = worked(helped, now) >= settings.stalled_s
    return Status.STALLED if stalled else Status.PROGRESSING


def _status_unseen(
    monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked
) -> Status:
    """A failing stage stays so while unobserved; a begun one becomes unknown after a while."""
    lasting = monitor.status in (Status.FAILING, Status.FAILED, Status.ACTIVE)
    unseen = monitor.unseen_since
    long = unseen is not None and worked(unseen, now) >= settings.unseen_s
    return Status.UNKNOWN if long and not lasting else monitor.status


def _fails(monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked) -> bool:
    if monitor.contrary_since is None:
        return False
    early = monitor.begun is None and not monitor.contrary_arose
    patience = settings.contrary_early_s if early else settings.contrary_s
    return worked(monitor.contrary_since, now) >= patience - 1e-9


def _long_failing(monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked) -> bool:
    if monitor.status is Status.FAILED:
        return True
    return monitor.status is Status.FAILING and worked(monitor.since, now) >= settings.failed_s


def _recovered(monitor: StepMonitor, now: float, settings: TaskSettings, worked: Worked) -> bool:
    """A longer failure needs longer progress to recover; a failed stage needs `failed_s`."""
    if monitor.better_since is None:
        return False
    lasted = worked(monitor.since, monitor.better_since)
    required = max(settings.recover_s, settings.recover_share * lasted)
    required = settings.failed_s if monitor.status is Status.FAILED else required
    return worked(monitor.better_since, now) >= required


def _first(earlier: float | None, now: float) -> float:
    return now if earlier is None else earlier
