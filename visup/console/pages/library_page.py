"""The list of runs with source, verdict and alerts; filtered while typing."""

from __future__ import annotations

from datetime import UTC, datetime

from nicegui import ui

from visup.console.library import RunEntry
from visup.console.pages.page_elements import page_frame, safe_text, verdict_badge
from visup.console.run_view import clock_text
from visup.console.state import ConsoleState

MAX_ROWS = 200
COLUMNS = ("", "run", "tasks", "verdict", "alerts", "length", "last written")
WIDE_COLUMNS = ("tasks", "length", "last written")
"""Columns hidden in narrow windows."""


def library_page(state: ConsoleState) -> None:
    """Lay out the list."""
    with page_frame("Runs"):
        pass
    entries = state.library.scan()

    @ui.refreshable
    def run_table(query: str = "") -> None:
        found = [e for e in entries if _matches(e, query)]
        _table(found[:MAX_ROWS])
        if len(found) > MAX_ROWS:
            ui.label(f"{len(found) - MAX_ROWS} more: narrow the search").classes("dim")
        if not found:
            ui.label("No run matches." if query else "There are no runs yet.").classes("dim")

    with ui.element("div").classes("card w-full"):
        ui.input("Search runs", on_change=lambda e: run_table.refresh(str(e.value or ""))).props(
            'dense outlined clearable aria-label="Search runs"'
        ).classes("w-full max-w-md")
        run_table()


def _matches(entry: RunEntry, query: str) -> bool:
    """Whether an entry contains all typed words."""
    fields = (
        entry.name,
        entry.source,
        entry.camera,
        *entry.tasks,
        entry.verdict or "",
        entry.problem,
    )
    text = " ".join(fields).replace("_", " ").casefold()
    return all(word in text for word in query.replace("_", " ").casefold().split())


def _table(entries: list[RunEntry]) -> None:
    with ui.element("table").classes("runs"):
        with ui.element("thead"), ui.element("tr"):
            for heading in COLUMNS:
                kind = "wide" if heading in WIDE_COLUMNS else ""
                with ui.element("th").classes(kind).props("scope=col"):
                    ui.label(heading or "picture").classes("" if heading else "sr-only")
        with ui.element("tbody"):
            for entry in entries:
                _row(entry)


def _row(entry: RunEntry) -> None:
    with ui.element("tr"):
        with ui.element("td"):
            if not entry.problem:
                ui.element("img").props(f'src="/thumbnail/{entry.key}.jpg" alt="" loading="lazy"')
        with ui.element("td"):
            ui.link(safe_text(entry.name), f"/run/{entry.key}")
            ui.label(safe_text(entry.camera or entry.source)).classes("dim")
        if entry.problem:
            with ui.element("td").props(f"colspan={len(COLUMNS) - 2}"):
                ui.label(safe_text(entry.problem)).classes("dim")
            return
        _cell(", ".join(entry.tasks) or "–", wide=True)
        with ui.element("td"):
            verdict_badge(entry.verdict, ended=entry.ended)
        _cell(str(entry.alerts))
        _cell(clock_text(entry.seconds), wide=True)
        written = datetime.fromtimestamp(entry.written, UTC)
        _cell(f"{written:%Y-%m-%d %H:%M} UTC", wide=True)


def _cell(text: str, *, wide: bool = False) -> None:
    with ui.element("td").classes("wide" if wide else ""):
        ui.label(safe_text(text))
