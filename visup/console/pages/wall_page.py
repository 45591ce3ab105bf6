"""The wall: the latest run of each camera with its state, and the alerts of all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from nicegui import ui

from visup.agent import Mind, Severity
from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.evidence import latest_snapshot
from visup.console.library import RunEntry
from visup.console.pages.alert_row import AlertRow, show_alert
from visup.console.pages.page_elements import page_frame, safe_text, section_heading, verdict_badge
from visup.console.pages.wall_alerts import STATES, AlertFilter, alert_rows
from visup.console.run_view import RunView
from visup.console.state import ConsoleState

REFRESH_S = 2.0
MAX_TILES = 36
MAX_ROWS = 60


def latest_by_camera(entries: Iterable[RunEntry]) -> list[RunEntry]:
    """The latest run of each camera, and all live runs without one; by name."""
    chosen: dict[str, RunEntry] = {}
    for entry in entries:
        name = entry.camera or ("" if entry.ended else str(entry.folder))
        if name and not entry.problem:
            latest = chosen.get(name)
            chosen[name] = entry if latest is None or entry.written > latest.written else latest
    return [chosen[name] for name in sorted(chosen)]


def wall_page(state: ConsoleState, role: ConsoleRole) -> None:
    """Lay out the wall; it refreshes every few seconds, and redraws what has changed."""
    with page_frame("Cameras"):
        pass
    wall = _Wall(state, role)
    wall.tiles()
    with ui.element("section").classes("card w-full").props('aria-label="Alerts of all cameras"'):
        section_heading("Alerts (times of cameras in UTC)")
        _filter(wall.alert_filter, wall.refresh)
        with (
            ui.element("div").classes("scroll").props('tabindex=0 role=region aria-label="Alerts"')
        ):
            wall.alerts()
    wall.refresh()
    ui.timer(REFRESH_S, wall.refresh)


class _Wall:
    """The content of one wall page, and what it showed last."""

    def __init__(self, state: ConsoleState, role: ConsoleRole) -> None:
        self.alert_filter = AlertFilter()
        self._state, self._role = state, role
        self._shown: tuple[object, object] = (None, None)

    def refresh(self) -> None:
        """Refresh."""
        found = latest_by_camera(self._state.library.scan())[:MAX_TILES]
        runs = [(e.key, e.written, e.ended) for e in found]
        if self._shown[0] != runs:
            self.tiles.refresh(found)
        rows = alert_rows(self._state, found, self.alert_filter)
        shown_alerts = [(r.key, r.alert, r.feedback) for r in rows]
        if self._shown[1] != shown_alerts:
            self.alerts.refresh(rows)
        self._shown = runs, shown_alerts

    @ui.refreshable_method
    def tiles(self, found: Sequence[RunEntry] = ()) -> None:
        """Draw a tile for each camera."""
        with ui.element("div").classes("wall"):
            for entry in found:
                _tile(self._state, entry)
        if not found:
            ui.label("No camera is being watched, and no run is in progress.").classes(
                "card w-full"
            )

    @ui.refreshable_method
    def alerts(self, rows: Sequence[AlertRow] = ()) -> None:
        """Draw a row for each alert."""
        for row in rows[:MAX_ROWS]:
            moment = f"/run/{row.key}?t={row.alert.opened:.2f}"
            show_alert(row, self._role, partial(ui.navigate.to, moment), self.refresh)
        if not rows:
            ui.label("No such alerts.").classes("dim")


def _filter(alert_filter: AlertFilter, refresh: Callable[[], None]) -> None:
    def changed(name: str, value: object) -> None:
        setattr(alert_filter, name, value)
        refresh()

    with ui.row().classes("items-center gap-3"):
        ui.select(
            STATES, value=alert_filter.state, on_change=lambda e: changed("state", str(e.value))
        ).props('dense outlined options-dense aria-label="Which alerts"')
        ui.input(
            placeholder="camera, kind, words",
            on_change=lambda e: changed("words", str(e.value or "")),
        ).props('dense outlined clearable aria-label="Search alerts"')
        ui.checkbox("only critical", on_change=lambda e: changed("critical", bool(e.value))).props(
            "dense size=xs"
        )


def _tile(state: ConsoleState, entry: RunEntry) -> None:
    card = ui.element("section").classes("card tile")
    card.props["aria-label"] = entry.camera or entry.name
    with card:
        try:
            run = state.view(entry.key, refresh=True)
            mind = run.mind(len(run.frames) - 1)
        except VisupError as fault:
            ui.label(safe_text(str(fault))).classes("dim")
            return
        _latest_picture(run, entry)
        _state_summary(run, mind, entry)


def _latest_picture(run: RunView, entry: RunEntry) -> None:
    """The last frame; for a camera, which only its own process can read, the latest picture of an alert."""
    picture = ui.element("img").classes("picture")
    picture.props["alt"] = ""
    number = latest_snapshot(run.folder) if run.pictures.problem else None
    if number is None:
        picture.props["src"] = f"/picture/{entry.key}/{len(run.frames) - 1}.jpg"
        return
    picture.props["src"] = f"/evidence/{entry.key}/{number}.jpg"
    opened = next((a.opened for a in run.alerts if a.id == number), None)
    when = "" if opened is None else f", {run.time_text(opened)}"
    ui.label(f"picture of alert {number}{when}").classes("dim")


def _state_summary(run: RunView, mind: Mind, entry: RunEntry) -> None:
    """Show verdict, stage and open alerts."""
    with ui.element("div").classes("line"):
        ui.link(
            safe_text(entry.camera or entry.name), f"/run/{entry.key}?t={mind.time:.2f}"
        ).classes("said brand")
        ui.label(run.time_text(mind.time)).classes("dim")
        verdict_badge(run.verdict, ended=run.ended)
    for task in mind.tasks:
        status = next((s.status.value for s in task.stages if s.stage == task.current), "")
        ui.label(safe_text(f"{task.task}: {task.current or 'over'} {status}")).classes("dim")
    opened = [a for a in mind.alerts if a.severity > Severity.INFO]
    if opened:
        kind = max(a.severity for a in opened).name.lower()
        with ui.element("div").classes(f"line {kind}"):
            text = f"{len(opened)} alerts are open" if len(opened) > 1 else "1 alert is open"
            ui.label(text).classes("said")
