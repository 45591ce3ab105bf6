"""Events and alerts with their times; a click moves the cursor."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from nicegui import ui

from visup.agent import Event, Severity
from visup.console.access import ConsoleRole
from visup.console.feedback import read_feedback
from visup.console.pages.alert_row import AlertRow, show_alert
from visup.console.pages.frame import shown_text
from visup.console.pages.playhead import Playhead
from visup.console.recorded_mind import open_at
from visup.wording import prose, worded_once

MOST_LINES = 200
"""Maximum number of events on the page, around the cursor."""


def events_panel(head: Playhead) -> None:
    """Lay out the events; those up to the cursor are marked."""
    worded = list(worded_once(head.run.events))
    read = [len(head.run.events)]

    def read_on() -> None:
        if len(head.run.events) != read[0]:
            read[0] = len(head.run.events)
            worded[:] = worded_once(head.run.events)

    @ui.refreshable
    def lines() -> None:
        now = head.run.times[head.number]
        for event in _around(worded, now):
            last = event.time <= now < event.time + 1.0
            _line(event.time, event.text, event.severity, head, marked=last)
        if not worded:
            ui.label("No events.").classes("dim")

    with ui.element("div").classes("scroll").props('tabindex=0 role=region aria-label="Events"'):
        lines()
    head.listen_to_growth(read_on)
    head.listen(lines.refresh, "Events")


def _around(worded: Sequence[Event], now: float) -> Sequence[Event]:
    """The events around a time if there are too many."""
    if len(worded) <= MOST_LINES:
        return worded
    at = sum(e.time <= now for e in worded)
    begin = min(max(0, at - MOST_LINES // 2), len(worded) - MOST_LINES)
    return worded[begin : begin + MOST_LINES]


def _line(
    time: float, text: str, severity: Severity, head: Playhead, *, marked: bool = False
) -> None:
    kind = severity.name.lower() + (" now" if marked else "")
    with ui.element("div").classes(f"line {kind}"):
        ui.label(head.run.when(time)).classes("when")
        with ui.element("button").classes("plain said") as button:
            ui.label(shown_text(prose(text)))
        button.on("click", lambda: head.go_to_time(time))


def alerts_panel(head: Playhead, key: str, role: ConsoleRole) -> None:
    """Lay out the alerts with feedback."""
    wanted = {"open": False}

    @ui.refreshable
    def listed() -> None:
        feedback = read_feedback(head.run.folder)
        now = head.run.times[head.number]
        found = [a for a in head.run.alerts if a.severity > Severity.INFO]
        if wanted["open"]:
            found = [a for a in found if open_at(a, now)]
        for alert in found:
            row = AlertRow(key, head.run, alert, feedback.get(alert.id))
            show_alert(row, role, partial(head.go_to_time, alert.opened), listed.refresh)
        if not found:
            ui.label("No alerts are open here." if wanted["open"] else "No alerts.").classes("dim")

    def only_open(yes: bool) -> None:
        wanted["open"] = yes
        listed.refresh()

    ui.checkbox("only alerts open at the cursor", on_change=lambda e: only_open(bool(e.value)))
    with ui.element("div").classes("scroll").props('tabindex=0 role=region aria-label="Alerts"'):
        listed()
    shown = [head.run.alerts]

    def read_on() -> None:
        if head.run.alerts != shown[0]:
            shown[0] = head.run.alerts
            listed.refresh()

    head.listen_to_growth(read_on)
    head.listen(lambda: listed.refresh() if wanted["open"] else None, "Alerts")
