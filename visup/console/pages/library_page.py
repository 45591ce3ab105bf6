"""The list of runs with source, verdict and alerts; filtered while typing."""

from __future__ import annotations

from datetime import UTC, datetime

from nicegui import ui

from visup.console.library import RunEntry
from visup.console.pages.frame import page_frame, shown_text, verdict_badge
from visup.console.run_view import clock_text
from visup.console.state import ConsoleState

MOST_SHOWN = 200
HEADINGS = ("", "run", "tasks", "verdict", "alerts", "length", "last written")
WIDE = ("tasks", "length", "last written")
"""Columns hidden in narrow windows."""


def library_page(state: ConsoleState) -> None:
    """Lay out the list."""
    with page_frame("Runs"):
        pass
    entries = state.library.scan()

    @ui.refreshable
    def listed(wanted: str = "") -> None:
        found = [e for e in entries if _matches(e, wanted)]
        _table(found[:MOST_SHOWN])
        if len(found) > MOST_SHOWN:
            ui.label(f"{len(found) - MOST_SHOWN} more: narrow the search").classes("dim")
        if not found:
            ui.label("No run matches." if wanted else "There are no runs yet.").classes("dim")

    with ui.element("div").classes("card w-full"):
        ui.input("Search runs", on_change=lambda e: listed.refresh(str(e.value or ""))).props(
            'dense outlined clearable aria-label="Search runs"'
        ).classes("w-full max-w-md")
        listed()


def _matches(entry: RunEntry, wanted: str) -> bool:
    """Whether an entry contains all typed words."""
    told = (
        entry.name,
        entry.source,
        entry.camera,
        *entry.tasks,
        entry.verdict or "",
        entry.problem,
    )
    text = " ".join(told).replace("_", " ").casefold()
    return all(word in text for word in wanted.replace("_", " ").casefold().split())


def _table(entries: list[RunEntry]) -> None:
    with ui.element("table").classes("runs"):
        with ui.element("thead"), ui.element("tr"):
            for heading in HEADINGS:
                kind = "wide" if heading in WIDE else ""
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
            ui.link(shown_text(entry.name), f"/run/{entry.key}")
            ui.label(shown_text(entry.camera or entry.source)).classes("dim")
        if entry.problem:
            with ui.element("td").props(f"colspan={len(HEADINGS) - 2}"):
                ui.label(shown_text(entry.problem)).classes("dim")
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
        ui.label(shown_text(text))
