"""Teaching: saves the clicked object under a name as a view of a model."""

from __future__ import annotations

from pathlib import Path

from nicegui import run, ui

from visup.agent.model.errors import VisupError
from visup.console.pages.frame import shown_text, worded_button
from visup.console.pages.playhead import Playhead
from visup.console.workbench.remembering import MODELS, remember


def remember_part(head: Playhead, number: int, folder: Path) -> None:
    """Lay out a field for the name and a button.

    Args:
        head: The cursor.
        number: Of the object.
        folder: Folder of the model database.
    """
    with ui.row().classes("items-center gap-2"):
        name = ui.input(placeholder="name").props('dense outlined aria-label="Name of the model"')

        async def keep() -> None:
            model_name = str(name.value or "").strip()
            try:
                lesson = await run.io_bound(
                    remember, head.run, head.number, number, model_name, folder
                )
            except VisupError as fault:
                ui.notify(shown_text(str(fault)), type="negative", multi_line=True)
                return
            if lesson is not None:
                text = f"'{model_name}' is known from now on: --models {MODELS}"
                ui.notify(shown_text(text), type="positive")

        worded_button("Remember as a model", keep)
