"""The workbench: edits a task, rules or zones, checks them, tries them on the run, and saves them."""

from __future__ import annotations

from functools import partial

from nicegui import run, ui

from visup.agent import Zone
from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.pages.editor import DraftEditor
from visup.console.pages.page_elements import safe_text, text_button
from visup.console.pages.panels.what_if_panel import show_comparison
from visup.console.pages.playhead import Playhead
from visup.console.state import ConsoleState
from visup.console.workbench.drafts import DraftCheck, DraftKind, check_draft, completions_at
from visup.console.workbench.saving import save_draft
from visup.runs.inputs.zones import zones_text
from visup.tasks.tools.outline import Branch

KINDS = {DraftKind.TASK: "a task", DraftKind.RULES: "rules", DraftKind.ZONES: "zones"}
CHECK_INTERVAL_S = 0.4
MAX_COMPLETIONS = 40
MAX_FAULTS = 30


def write_panel(state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
    """Lay out the panel."""
    if role is not ConsoleRole.OPERATOR:
        ui.label("Read-only access: you cannot write here.").classes("dim")
        return
    _Workbench(state, head, key)


class _Workbench:
    def __init__(self, state: ConsoleState, head: Playhead, key: str) -> None:
        self._state, self._head, self._key = state, head, key
        self._kind, self._checked = DraftKind.TASK, DraftCheck()
        with ui.row().classes("items-center gap-2"):
            kind = ui.select(KINDS, value=self._kind, on_change=lambda e: self._choose(e.value))
            kind.props('dense outlined options-dense aria-label="What is written"')
            text_button("Complete", self._complete)
            text_button("Try it on this run", self._try_on_run, primary=True)
        self._zone_tools = ui.row().classes("items-center gap-2")
        with self._zone_tools:
            self._zone_controls()
        self._zone_tools.set_visibility(False)
        self.editor = DraftEditor()
        self._completions = ui.row().classes("gap-0 w-full")
        self._findings()
        self._save_controls()
        region = ui.element("div").classes("scroll")
        with region.props('tabindex=0 role=region aria-label="What would differ"'):
            self._output = ui.column().classes("w-full gap-0")
        head.listen(self.editor.set_accessible_name, "Write")
        ui.timer(CHECK_INTERVAL_S, self._check)

    def _choose(self, kind: DraftKind) -> None:
        self._kind = DraftKind(kind)
        zones = self._kind is DraftKind.ZONES
        self._zone_tools.set_visibility(zones)
        self._head.drawing_zone = False
        self._head.set_zone_corners()
        if zones and not self.editor.text.strip() and self._head.run.zones:
            self.editor.text = zones_text(self._head.run.zones)
        self.editor.changed = True
        self._completions.clear()

    # Mistakes and meaning

    async def _check(self) -> None:
        if not self.editor.changed or self._head.panel != "Write":
            return
        self.editor.changed = False
        checked = await run.io_bound(check_draft, self._kind, self.editor.text)
        if checked is not None:
            self._checked = checked
            self.editor.mark_mistakes(checked.faults)
            self._findings.refresh()

    @ui.refreshable_method
    def _findings(self) -> None:
        with ui.element("div").classes("findings").props('role=status aria-label="Mistakes"'):
            for fault in self._checked.faults[:MAX_FAULTS]:
                with ui.element("div").classes("line"):
                    ui.label(str(fault.line or "")).classes("when")
                    with ui.element("button").classes("plain why") as button:
                        ui.label(safe_text(fault.text))
                    button.on("click", partial(self.editor.show_line, fault.line))
            if self._checked.tree:
                ui.label("No mistakes.").classes("dim")
        if self._checked.tree:
            with ui.element("ul").classes("tree").props('aria-label="What it means"'):
                for branch in self._checked.tree:
                    _branch(branch)

    async def _complete(self) -> None:
        caret = await self.editor.caret_offset()
        found = completions_at(self._kind, self.editor.text, caret)[:MAX_COMPLETIONS]
        self._completions.clear()
        with self._completions:
            for completion in found:
                button = text_button(
                    safe_text(completion.text), partial(self.editor.insert, completion)
                )
                button.tooltip(safe_text(completion.about))
            if not found:
                ui.label("No completions.").classes("dim")

    # Drawing zones on the picture

    def _zone_controls(self) -> None:
        ui.switch(
            "draw", on_change=lambda e: setattr(self._head, "drawing_zone", bool(e.value))
        ).props("dense")
        ui.label("Click the corners in the picture.").classes("dim")
        name = ui.input(placeholder="name").props('dense outlined aria-label="Name of the zone"')
        text_button("Add zone", lambda: self._add_zone(str(name.value or "").strip()))
        text_button(
            "Undo corner", lambda: self._head.set_zone_corners(self._head.zone_corners[:-1])
        )

    def _add_zone(self, name: str) -> None:
        text = zones_text([Zone(name.replace('"', ""), tuple(self._head.zone_corners))])
        existing = self.editor.text.rstrip()
        faults = check_draft(DraftKind.ZONES, text).faults
        if faults:
            ui.notify(safe_text(faults[0].text), type="negative", multi_line=True)
            return
        self.editor.text = f"{existing}\n\n{text}" if existing else text
        self._head.set_zone_corners()

    # Trying on the run, and saving

    async def _try_on_run(self) -> None:
        kind, text, steps = self._kind, self.editor.text, len(self._head.run.frames)
        if kind is DraftKind.ZONES:
            self._output.clear()
            with self._output:
                ui.label("Save the zones, then: visup replay --zones FILE").classes("dim")
            return
        inquiry, key = self._state.inquiry, self._key
        await show_comparison(
            lambda: inquiry(key).rerun_with(kind.value, text, steps), self._output, self._head
        )

    def _save_controls(self) -> None:
        folder = self._state.save_to
        if folder is None:
            hint = "To save texts, name a folder: visup console --save-to FOLDER"
            ui.label(hint).classes("dim")
            return
        with ui.row().classes("items-center gap-2"):
            name = ui.input(placeholder="name").props(
                'dense outlined aria-label="Name of the file"'
            )
            replace = ui.checkbox("replace").props("dense size=xs")

            def save() -> None:
                try:
                    path = save_draft(
                        folder,
                        self._kind,
                        str(name.value or "").strip(),
                        self.editor.text,
                        replace=bool(replace.value),
                    )
                except VisupError as fault:
                    ui.notify(safe_text(str(fault)), type="negative", multi_line=True)
                    return
                ui.notify(f"saved as {path.name}", type="positive")

            text_button("Save", save)


def _branch(branch: Branch) -> None:
    with ui.element("li"):
        repeated = " (see above)" if branch.again else ""
        ui.label(safe_text(f"{branch.text}{repeated}")).classes(f"branch {branch.kind}")
        if branch.inside:
            with ui.element("ul"):
                for inner in branch.inside:
                    _branch(inner)
