"""The alerts of all cameras in one list, latest first, with filters and acknowledgement."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from visup.agent import Severity
from visup.agent.model.errors import VisupError
from visup.console.feedback import read_feedback
from visup.console.library import RunEntry
from visup.console.pages.alert_row import AlertRow
from visup.console.state import ConsoleState

STATES = {"open": "open", "unseen": "not seen yet", "all": "all"}


@dataclass(slots=True)
class AlertFilter:
    """The filter of the alert list.

    Attributes:
        state: One of `STATES`.
        words: Words searched for in camera, kind and text.
        critical: Whether to show only critical alerts.
    """

    state: str = "open"
    words: str = ""
    critical: bool = False

    def matches(self, row: AlertRow) -> bool:
        """Whether a row is shown."""
        alert = row.alert
        text = f"{row.camera} {alert.kind} {alert.cause}".replace("_", " ").casefold()
        words = self.words.replace("_", " ").casefold().split()
        min_severity = Severity.CRITICAL if self.critical else Severity.WARNING
        state = {"open": alert.closed is None, "unseen": row.feedback is None}.get(self.state, True)
        return state and alert.severity >= min_severity and all(word in text for word in words)


def alert_rows(
    state: ConsoleState, entries: Iterable[RunEntry], alert_filter: AlertFilter
) -> list[AlertRow]:
    """The alerts of some runs that pass the filter, by severity and then latest first."""
    found: list[AlertRow] = []
    for entry in entries:
        try:
            run = state.view(entry.key)
            said = read_feedback(run.folder)
            found += [
                AlertRow(entry.key, run, a, said.get(a.id), entry.camera or entry.name)
                for a in run.alerts
            ]
        except (VisupError, OSError):
            continue
    rows = [row for row in found if alert_filter.matches(row)]
    return sorted(rows, key=lambda r: (-r.alert.severity, -_opening_time(r), r.key))


def _opening_time(row: AlertRow) -> float:
    """When an alert opened, in wall-clock time if known."""
    wall = row.run.clock.seconds(row.alert.opened)
    return row.alert.opened if wall is None else wall
