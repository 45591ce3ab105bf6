"""Teaches the clicked object: saves it under a name as a view of a model."""

from __future__ import annotations

from pathlib import Path

from nicegui import run, ui

from visup.agent.model.errors import VisupError
from visup.console.pages.page_elements import safe_text, text_button
from visup.console.pages.playhead import Playhead
from visup.console.workbench.object_teaching import MODELS, teach_object


def teach_section(head: Playhead, number: int, folder: Path) -> None:
    """Lay out a field for the name and a button.

    Args:
        head: The cursor.
        number: Number of the object.
        folder: Folder of the model database.
    """
    with ui.row().classes("items-center gap-2"):
        name = ui.input(placeholder="name").props('dense outlined aria-label="Name of the model"')

        async def teach() -> None:
            model_name = str(name.value or "").strip()
            try:
                result = await run.io_bound(
                    teach_object, head.run, head.number, number, model_name, folder
                )
            except VisupError as fault:
                ui.notify(safe_text(str(fault)), type="negative", multi_line=True)
                return
            if result is not None:
                text = f"'{model_name}' is known from now on: --models {MODELS}"
                ui.notify(safe_text(text), type="positive")

        text_button("Remember as a model", teach)
