"""Common elements of all pages: the bar at the top, the style, and words for states."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.resources import files

from nicegui import ui

from visup.agent import Status
from visup.report.palette import STATUS_COLOURS, css
from visup.wording import printable

STYLE = files(__package__).joinpath("console.css").read_text(encoding="utf-8")

VERDICT_COLOURS = {
    "succeeded": css(STATUS_COLOURS[Status.DONE]),
    "failed": css(STATUS_COLOURS[Status.FAILED]),
    "interrupted": css(STATUS_COLOURS[Status.FAILED]),
    "unsafe": css(STATUS_COLOURS[Status.FAILED]),
    "in_progress": css(STATUS_COLOURS[Status.PROGRESSING]),
}
NEUTRAL_COLOUR = "#5a6573"


@contextmanager
def page_frame(title: str) -> Iterator[None]:
    """The bar at the top, to which the caller can add; the page's own elements follow."""
    ui.add_css(STYLE)
    ui.add_head_html('<script>document.documentElement.lang = "en"</script>')
    ui.page_title(f"{title} · visup")
    dark = ui.dark_mode(value=None)
    with ui.header(elevated=False).classes("bar"):
        with ui.element("nav").props('aria-label="Main"'):
            ui.link("visup", "/").classes("brand")
            ui.link("cameras", "/wall").classes("nav")
        with ui.element("h1").classes("crumb"):
            ui.label(safe_text(title))
        yield
        ui.space()
        icon_button("contrast", "Dark or light", lambda: dark.set_value(not dark.value))


def section_heading(title: str) -> None:
    """The heading of a part of a panel."""
    with ui.element("h2").classes("part"):
        ui.label(title)


def icon_button(icon: str, label: str, on_click: Callable[[], object]) -> ui.button:
    """A round icon button with a tooltip and an accessible name."""
    button = ui.button(icon=icon, on_click=on_click, color=None)
    button.props(f'flat round dense aria-label="{label}"').classes("icon")
    button.tooltip(label)
    return button


def text_button(text: str, on_click: Callable[[], object], *, primary: bool = False) -> ui.button:
    """A button with a text; the main one is highlighted."""
    button = ui.button(text, on_click=on_click, color=None).props("dense no-caps unelevated")
    return button.classes("act main" if primary else "act")


def badge(text: str, colour: str) -> ui.label:
    """A word on a coloured background."""
    return ui.label(safe_text(text)).classes("state").style(f"background:{colour}")


def verdict_badge(verdict: str | None, *, ended: bool) -> ui.label:
    """The verdict of a run, or that it goes on."""
    text = (verdict or ("no task" if ended else "running")).replace("_", " ")
    return badge(text, VERDICT_COLOURS.get(verdict or "", NEUTRAL_COLOUR))


def safe_text(text: str) -> str:
    """A text that is safe to show: without bidirectional control characters."""
    return printable(text)
