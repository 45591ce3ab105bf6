"""The workbench: edits a task, rules or zones, checks them, tries them on the run, and saves them."""

from __future__ import annotations

from functools import partial

from nicegui import run, ui

from visup.agent import Zone
from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.pages.editor import DraftEditor
from visup.console.pages.frame import shown_text, worded_button
from visup.console.pages.panels.try_panel import show_tried
from visup.console.pages.playhead import Playhead
from visup.console.state import ConsoleState
from visup.console.workbench.drafts import DraftCheck, DraftKind, check_draft, words_at
from visup.console.workbench.saving import save_draft
from visup.runs.inputs.zones import zones_text
from visup.tasks.tools.outline import Branch

KINDS = {DraftKind.TASK: "a task", DraftKind.RULES: "rules", DraftKind.ZONES: "zones"}
LOOK_S = 0.4
MOST_WORDS = 40
MOST_FAULTS = 30


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
            worded_button("Complete", self._complete)
            worded_button("Try it on this run", self._judge, main=True)
        self._zone_tools = ui.row().classes("items-center gap-2")
        with self._zone_tools:
            self._drawing()
        self._zone_tools.set_visibility(False)
        self.editor = DraftEditor()
        self._words = ui.row().classes("gap-0 w-full")
        self._findings()
        self._saving()
        region = ui.element("div").classes("scroll")
        with region.props('tabindex=0 role=region aria-label="What would differ"'):
            self._answer = ui.column().classes("w-full gap-0")
        head.listen(self.editor.name, "Write")
        ui.timer(LOOK_S, self._look)

    def _choose(self, kind: DraftKind) -> None:
        self._kind = DraftKind(kind)
        zones = self._kind is DraftKind.ZONES
        self._zone_tools.set_visibility(zones)
        self._head.pen = False
        self._head.draw()
        if zones and not self.editor.text.strip() and self._head.run.zones:
            self.editor.text = zones_text(self._head.run.zones)
        self.editor.changed = True
        self._words.clear()

    # Mistakes and meaning

    async def _look(self) -> None:
        if not self.editor.changed or self._head.panel != "Write":
            return
        self.editor.changed = False
        checked = await run.io_bound(check_draft, self._kind, self.editor.text)
        if checked is not None:
            self._checked = checked
            self.editor.mark(checked.faults)
            self._findings.refresh()

    @ui.refreshable_method
    def _findings(self) -> None:
        with ui.element("div").classes("findings").props('role=status aria-label="Mistakes"'):
            for fault in self._checked.faults[:MOST_FAULTS]:
                with ui.element("div").classes("line"):
                    ui.label(str(fault.line or "")).classes("when")
                    with ui.element("button").classes("plain why") as button:
                        ui.label(shown_text(fault.text))
                    button.on("click", partial(self.editor.show_line, fault.line))
            if self._checked.tree:
                ui.label("No mistakes.").classes("dim")
        if self._checked.tree:
            with ui.element("ul").classes("tree").props('aria-label="What it means"'):
                for branch in self._checked.tree:
                    _branch(branch)

    async def _complete(self) -> None:
        place = await self.editor.place()
        found = words_at(self._kind, self.editor.text, place)[:MOST_WORDS]
        self._words.clear()
        with self._words:
            for word in found:
                made = worded_button(shown_text(word.text), partial(self.editor.put, word))
                made.tooltip(shown_text(word.about))
            if not found:
                ui.label("No completions.").classes("dim")

    # Drawing zones on the picture

    def _drawing(self) -> None:
        ui.switch("draw", on_change=lambda e: setattr(self._head, "pen", bool(e.value))).props(
            "dense"
        )
        ui.label("Click the corners in the picture.").classes("dim")
        name = ui.input(placeholder="name").props('dense outlined aria-label="Name of the zone"')
        worded_button("Add zone", lambda: self._add_zone(str(name.value or "").strip()))
        worded_button("Undo corner", lambda: self._head.draw(self._head.drawn[:-1]))

    def _add_zone(self, name: str) -> None:
        made = zones_text([Zone(name.replace('"', ""), tuple(self._head.drawn))])
        before = self.editor.text.rstrip()
        faults = check_draft(DraftKind.ZONES, made).faults
        if faults:
            ui.notify(shown_text(faults[0].text), type="negative", multi_line=True)
            return
        self.editor.text = f"{before}\n\n{made}" if before else made
        self._head.draw()

    # Trying on the run, and saving

    async def _judge(self) -> None:
        kind, text, steps = self._kind, self.editor.text, len(self._head.run.frames)
        if kind is DraftKind.ZONES:
            self._answer.clear()
            with self._answer:
                ui.label("Save the zones, then: visup replay --zones FILE").classes("dim")
            return
        inquiry, key = self._state.inquiry, self._key
        await show_tried(
            lambda: inquiry(key).judged_by(kind.value, text, steps), self._answer, self._head
        )

    def _saving(self) -> None:
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
                    ui.notify(shown_text(str(fault)), type="negative", multi_line=True)
                    return
                ui.notify(f"saved as {path.name}", type="positive")

            worded_button("Save", save)


def _branch(branch: Branch) -> None:
    with ui.element("li"):
        again = " (see above)" if branch.again else ""
        ui.label(shown_text(f"{branch.text}{again}")).classes(f"branch {branch.kind}")
        if branch.inside:
            with ui.element("ul"):
                for inner in branch.inside:
                    _branch(inner)
