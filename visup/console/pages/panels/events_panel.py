"""Events and alerts with their times; a click moves the cursor."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from nicegui import ui

from visup.agent import Event, Severity
from visup.console.access import ConsoleRole
from visup.console.feedback import read_feedback
from visup.console.pages.alert_row import AlertRow, show_alert
from visup.console.pages.page_elements import safe_text
from visup.console.pages.playhead import Playhead
from visup.console.recorded_mind import is_open_at
from visup.wording import prose, worded_once

MAX_LINES = 200
"""Maximum number of events on the page, around the cursor."""


def events_panel(head: Playhead) -> None:
    """Lay out the events; those up to the cursor are marked."""
    texts = list(worded_once(head.run.events))
    event_count = [len(head.run.events)]

    def update() -> None:
        if len(head.run.events) != event_count[0]:
            event_count[0] = len(head.run.events)
            texts[:] = worded_once(head.run.events)

    @ui.refreshable
    def event_list() -> None:
        now = head.run.times[head.number]
        for event in _events_around(texts, now):
            is_recent = event.time <= now < event.time + 1.0
            _line(event.time, event.text, event.severity, head, marked=is_recent)
        if not texts:
            ui.label("No events.").classes("dim")

    with ui.element("div").classes("scroll").props('tabindex=0 role=region aria-label="Events"'):
        event_list()
    head.listen_to_growth(update)
    head.listen(event_list.refresh, "Events")


def _events_around(texts: Sequence[Event], now: float) -> Sequence[Event]:
    """The events around a time if there are too many."""
    if len(texts) <= MAX_LINES:
        return texts
    at = sum(e.time <= now for e in texts)
    begin = min(max(0, at - MAX_LINES // 2), len(texts) - MAX_LINES)
    return texts[begin : begin + MAX_LINES]


def _line(
    time: float, text: str, severity: Severity, head: Playhead, *, marked: bool = False
) -> None:
    kind = severity.name.lower() + (" now" if marked else "")
    with ui.element("div").classes(f"line {kind}"):
        ui.label(head.run.time_text(time)).classes("when")
        with ui.element("button").classes("plain said") as button:
            ui.label(safe_text(prose(text)))
        button.on("click", lambda: head.go_to_time(time))


def alerts_panel(head: Playhead, key: str, role: ConsoleRole) -> None:
    """Lay out the alerts with feedback."""
    filters = {"open": False}

    @ui.refreshable
    def alert_list() -> None:
        feedback = read_feedback(head.run.folder)
        now = head.run.times[head.number]
        found = [a for a in head.run.alerts if a.severity > Severity.INFO]
        if filters["open"]:
            found = [a for a in found if is_open_at(a, now)]
        for alert in found:
            row = AlertRow(key, head.run, alert, feedback.get(alert.id))
            show_alert(row, role, partial(head.go_to_time, alert.opened), alert_list.refresh)
        if not found:
            ui.label("No alerts are open here." if filters["open"] else "No alerts.").classes("dim")

    def set_only_open(value: bool) -> None:
        filters["open"] = value
        alert_list.refresh()

    ui.checkbox("only alerts open at the cursor", on_change=lambda e: set_only_open(bool(e.value)))
    with ui.element("div").classes("scroll").props('tabindex=0 role=region aria-label="Alerts"'):
        alert_list()
    shown_alerts = [head.run.alerts]

    def update() -> None:
        if head.run.alerts != shown_alerts[0]:
            shown_alerts[0] = head.run.alerts
            alert_list.refresh()

    head.listen_to_growth(update)
    head.listen(lambda: alert_list.refresh() if filters["open"] else None, "Alerts")
