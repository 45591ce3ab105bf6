"""All cameras at once: the latest run of each, how it stands, and what is wrong."""

from __future__ import annotations

from collections.abc import Iterable

from nicegui import ui

from visup.agent import Mind, Severity
from visup.agent.model.errors import VisupError
from visup.console.library import RunEntry
from visup.console.pages.frame import clock, page_frame, shown_text, verdict_badge
from visup.console.run_view import RunView
from visup.console.state import ConsoleState

REFRESH_S = 2.0
MOST_TILES = 36


def latest_by_camera(entries: Iterable[RunEntry]) -> list[RunEntry]:
    """The latest run of each camera, and all runs without one that still go on; by name."""
    chosen: dict[str, RunEntry] = {}
    for entry in entries:
        name = entry.camera or ("" if entry.ended else str(entry.folder))
        if name and not entry.problem:
            held = chosen.get(name)
            chosen[name] = entry if held is None or entry.written > held.written else held
    return [chosen[name] for name in sorted(chosen)]


def wall_page(state: ConsoleState) -> None:
    """Lay out the wall; it looks anew every few seconds."""
    with page_frame("Cameras"):
        pass

    @ui.refreshable
    def tiles() -> None:
        found = latest_by_camera(state.library.scan())[:MOST_TILES]
        with ui.element("div").classes("wall"):
            for entry in found:
                _tile(state, entry)
        if not found:
            ui.label("No camera is watched, and no run goes on.").classes("card w-full")

    tiles()
    ui.timer(REFRESH_S, tiles.refresh)


def _tile(state: ConsoleState, entry: RunEntry) -> None:
    card = ui.element("section").classes("card tile")
    card.props["aria-label"] = entry.camera or entry.name
    with card:
        try:
            run = state.view(entry.key, refresh=True)
            mind = run.mind(len(run.frames) - 1)
        except VisupError as fault:
            ui.label(shown_text(str(fault))).classes("dim")
            return
        _stand(run, mind, entry)


def _stand(run: RunView, mind: Mind, entry: RunEntry) -> None:
    """Picture, verdict, stage and open alerts."""
    picture = ui.element("img").classes("picture")
    picture.props["src"] = f"/picture/{entry.key}/{len(run.frames) - 1}.jpg"
    picture.props["alt"] = ""
    with ui.element("div").classes("line"):
        ui.link(
            shown_text(entry.camera or entry.name), f"/run/{entry.key}?t={mind.time:.2f}"
        ).classes("said brand")
        ui.label(clock(mind.time)).classes("dim")
        verdict_badge(run.verdict, ended=run.ended)
    for task in mind.tasks:
        status = next((s.status.value for s in task.stages if s.stage == task.current), "")
        ui.label(shown_text(f"{task.task}: {task.current or 'over'} {status}")).classes("dim")
    for alert in mind.alerts:
        if alert.severity > Severity.INFO:
            with ui.element("div").classes(f"line {alert.severity.name.lower()}"):
                ui.label(shown_text(alert.cause)).classes("said")
