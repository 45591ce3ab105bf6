"""The table of keyboard shortcuts of a run's page."""

from __future__ import annotations

from nicegui import ui

from visup.console.pages.page_elements import section_heading, text_button

SHORTCUTS = (
    (("Space",), "play or pause"),
    (("←", "→"), "one frame back or forward"),
    (("Shift", "←  →"), "ten frames"),
    (("p", "n"), "previous or next event"),
    (("Home", "End"), "to the start or the end"),
    (("?",), "this table"),
)


def show_shortcuts() -> None:
    """Show the table over the page."""
    with ui.dialog(value=True) as dialog, ui.card().classes("card"):
        dialog.props('aria-label="Keys"')
        section_heading("Keys")
        with ui.element("table").classes("keys"):
            for keys, action in SHORTCUTS:
                with ui.element("tr"):
                    with ui.element("td"):
                        for key in keys:
                            with ui.element("kbd"):
                                ui.label(key)
                    with ui.element("td"):
                        ui.label(action)
        text_button("Close", dialog.close, primary=True)
    dialog.on("hide", dialog.delete)
