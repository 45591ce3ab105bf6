"""The last phase of a step: opens, renews and closes alerts as their conditions come and go."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from visup.agent.cycle.system_alerts import BEHAVIOUR_FAILED
from visup.agent.model.events import Alert, AlertCondition, Event, Severity
from visup.agent.model.fast_replace import replace
from visup.agent.model.records import FAULT_STATES, Observation, ReportState

CLOSING_DELAY_S = 1.0
"""Time without its condition after which an alert closes, seconds: alerts must not flicker."""

RECOVERY_S = 3.0
"""Time that rules need to recover after a kind of percept was unknown, seconds; until then alerts that need
it stay open."""

Key = tuple[str, tuple[int, ...], str]


def fault_conditions(observation: Observation) -> tuple[AlertCondition, ...]:
    """Alert conditions for behaviours that failed, are late or suspended, whose output is unknown."""
    return tuple(
        AlertCondition(
            BEHAVIOUR_FAILED,
            (),
            Severity.WARNING,
            f"The behaviour '{r.behaviour}' {_failure(r.state)}; its output is unavailable.",
            (r.error,),
            key=r.behaviour,
            needs=(),
        )
        for r in observation.reports
        if r.state in FAULT_STATES
    )


def _failure(state: ReportState) -> str:
    return "gave no answer in time" if state is ReportState.LATE else "failed"


def update_alerts(
    alerts: Sequence[Alert],
    conditions: Iterable[AlertCondition],
    time: float,
    next_id: int,
    unknown: frozenset[str] = frozenset(),
) -> tuple[tuple[Alert, ...], tuple[Alert, ...], tuple[Alert, ...]]:
    """Alerts after the conditions of one step.

    Args:
        alerts: Open alerts in the order of opening.
        conditions: Conditions that hold now; of two with the same key the more severe counts.
        time: Seconds.
        next_id: Number of the next alert that opens.
        unknown: Kinds of percept that are unknown now: an alert that needs one of them stays open, because it
            is unknown whether it is over.

    Returns:
        Open alerts, newly opened ones, newly closed ones.
    """
    pending = _by_key(conditions)
    open_alerts: list[Alert] = []
    closed: list[Alert] = []
    for alert in alerts:
        condition = pending.pop(_key(alert), None)
        if condition is not None:
            open_alerts.append(_renew(alert, condition, time))
            continue
        unrenewed = _unsure(alert, unknown, time)
        if _is_over(unrenewed, time):
            closed.append(replace(unrenewed, closed=time))
        else:
            open_alerts.append(unrenewed)
    opened = tuple(_open(c, time, next_id + i) for i, c in enumerate(pending.values()))
    return (*open_alerts, *opened), opened, tuple(closed)


def alert_events(
    opened: Iterable[Alert], closed: Iterable[Alert], time: float, frame_index: int
) -> tuple[Event, ...]:
    """The events of alerts that opened or closed."""
    opening_events = [_event("alert", a.cause, a, time, frame_index, a.severity) for a in opened]
    closing_events = [
        _event("alert_closed", f"Resolved: {a.cause}", a, time, frame_index, Severity.INFO)
        for a in closed
    ]
    return (*opening_events, *closing_events)


def _event(
    kind: str, text: str, alert: Alert, time: float, frame_index: int, severity: Severity
) -> Event:
    data = {"alert": alert.id, "alert_kind": alert.kind, "evidence": list(alert.evidence)}
    return Event(kind, time, frame_index, text, alert.objects, severity=severity, data=data)


def _key(record: Alert | AlertCondition) -> Key:
    return record.kind, record.objects, record.key


def _by_key(conditions: Iterable[AlertCondition]) -> dict[Key, AlertCondition]:
    found: dict[Key, AlertCondition] = {}
    for condition in conditions:
        most_severe = found.setdefault(_key(condition), condition)
        if condition.severity > most_severe.severity:
            found[_key(condition)] = condition
    return found


def _open(condition: AlertCondition, time: float, number: int) -> Alert:
    return Alert(
        id=number,
        kind=condition.kind,
        severity=condition.severity,
        opened=time,
        updated=time,
        objects=condition.objects,
        cause=condition.cause,
        evidence=condition.evidence,
        key=condition.key,
        needs=condition.needs,
    )


def _renew(alert: Alert, condition: AlertCondition, time: float) -> Alert:
    # The cause keeps its first wording, so that the narrative and the report tell one story.
    severity = max(alert.severity, condition.severity)
    return replace(alert, severity=severity, updated=time, evidence=condition.evidence)


def _unsure(alert: Alert, unknown: frozenset[str], time: float) -> Alert:
    return replace(alert, unsure=time) if unknown.intersection(alert.needs) else alert


def _is_over(alert: Alert, time: float) -> bool:
    recovered = alert.unsure is None or time - alert.unsure > RECOVERY_S
    return recovered and time - alert.updated > CLOSING_DELAY_S
