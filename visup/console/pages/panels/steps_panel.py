"""Breakpoints, and the changes made by each phase of a step."""

from __future__ import annotations

from functools import partial

from nicegui import run, ui
from nicegui.events import ValueChangeEventArguments

from visup.agent.contract.phases import Phase
from visup.agent.model.errors import VisupError
from visup.console.pages.frame import button, part_heading, shown_text, worded_button
from visup.console.pages.playhead import Playhead
from visup.console.reasoning.debugging import FoundStop, PhaseRecord
from visup.console.state import ConsoleState
from visup.wording import EVENT_KINDS, prose

EXAMPLE = "alert, stage captured, when gap(1, 2) < 20 px"
LONGEST = 500
MOST_CHANGES = 120
PHASES = {
    Phase.PERCEIVE: "what was seen",
    Phase.UPDATE: "who is where",
    Phase.COGITATE: "what holds, and who is who",
    Phase.MATCH: "how tasks stand",
    Phase.ATTEND: "what to look at next",
    Phase.ACT: "alerts",
}


def steps_panel(state: ConsoleState, head: Playhead, key: str) -> None:
    """Lay out the panel."""
    _Breakpoints(state, head, key)
    _PhaseWalk(state, head, key)


class _Breakpoints:
    """The breakpoints, and the search for the next one."""

    def __init__(self, state: ConsoleState, head: Playhead, key: str) -> None:
        self._state, self._head, self._key = state, head, key
        self._words: dict[str, bool] = {"alert": True}
        self._searching = self._left = False
        ui.context.client.on_disconnect(partial(setattr, self, "_left", True))
        part_heading("Stop at")
        self._entry()
        self._listed()
        with ui.row().classes("items-center gap-2"):
            worded_button("Continue", self._go_on, main=True)
            self._said = ui.label().classes("why").props("role=status")

    def _entry(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            known = [f"event {kind}" for kind in EVENT_KINDS]
            typed = ui.input(placeholder=EXAMPLE, autocomplete=[*known, *_stages(self._head)])
            typed.props('dense outlined aria-label="Where to stop"').classes("grow")
            typed.on("keydown.enter", partial(self._add, typed))
            worded_button("Add", partial(self._add, typed))

    def _add(self, typed: ui.input) -> None:
        if text := " ".join(str(typed.value or "").split())[:LONGEST]:
            self._words[text] = True
            self._listed.refresh()
        typed.set_value("")

    @ui.refreshable_method
    def _listed(self) -> None:
        for words, on in self._words.items():
            with ui.element("div").classes("line"):
                box = ui.checkbox(shown_text(words), value=on).props("dense size=xs")
                box.classes("said").on_value_change(partial(self._switch, words))
                button("close", f"Delete {shown_text(words)}", partial(self._delete, words))

    def _switch(self, words: str, e: ValueChangeEventArguments[bool]) -> None:
        self._words[words] = bool(e.value)

    def _delete(self, words: str) -> None:
        self._words.pop(words, None)
        self._listed.refresh()

    async def _go_on(self) -> None:
        if self._searching:
            self._left = True
            return
        self._searching, self._left = True, False
        self._said.set_text("reasoning on ... (press again to stop)")
        begin, asked = self._head.number, [w for w, on in self._words.items() if on]
        try:
            found = await run.io_bound(self._search, begin, asked)
            if found is not None:  # else the console is stopping
                self._arrive(found)
        except VisupError as fault:
            self._said.set_text(shown_text(str(fault)))
        finally:
            self._searching = False

    def _search(self, begin: int, asked: list[str]) -> FoundStop:
        inquiry = self._state.inquiry(self._key)
        return inquiry.next_stop(begin + 1, asked, lambda: self._left)

    def _arrive(self, found: FoundStop) -> None:
        if found.reasons:
            self._head.go(found.number - 1)
            when = self._head.run.when(self._head.run.times[self._head.number])
            self._said.set_text(shown_text(f"{when}  {'; '.join(map(prose, found.reasons))}"))
        elif found.ended:
            self._said.set_text("It does not happen before the end.")
        else:
            self._said.set_text("Given up.")


def _stages(head: Playhead) -> list[str]:
    return [f"stage {s.stage}" for t in head.run.mind(head.number).tasks for s in t.stages]


class _PhaseWalk:
    """Steps through the phases at the cursor and on into the next step."""

    def __init__(self, state: ConsoleState, head: Playhead, key: str) -> None:
        self._state, self._head, self._key = state, head, key
        self._records: tuple[PhaseRecord, ...] = ()
        self._number, self._shown = -1, 0
        part_heading("Inside the step")
        with ui.row().classes("items-center gap-2"):
            worded_button("Next phase", self._forth, main=True)
            ui.label("of the frame at the cursor, then of the next one").classes("dim")
        region = ui.element("div").classes("scroll")
        with region.props('tabindex=0 role=region aria-label="Phases"'):
            self._phases()
        head.listen(self._moved, "Steps")

    async def _forth(self) -> None:
        if self._number == self._head.number and self._shown >= len(self._records):
            self._head.step(1)
        if self._number != (number := self._head.number):
            try:
                records = await run.io_bound(self._look, number)
            except VisupError as fault:
                ui.notify(shown_text(str(fault)), type="negative", multi_line=True)
                return
            self._records, self._number, self._shown = records or (), number, 0
        self._shown += 1
        self._phases.refresh()

    def _look(self, number: int) -> tuple[PhaseRecord, ...]:
        return self._state.inquiry(self._key).phases(number + 1)

    def _moved(self) -> None:
        if self._head.number != self._number:
            self._shown = 0
        self._phases.refresh()

    @ui.refreshable_method
    def _phases(self) -> None:
        records = self._records[: self._shown] if self._number == self._head.number else ()
        for number, record in enumerate(records, 1):
            _phase(record, last=number == self._shown)


def _phase(record: PhaseRecord, *, last: bool) -> None:
    with ui.element("div").classes("line now" if last else "line"):
        ui.label(record.phase.value).classes("said phase")
        ui.label(PHASES[record.phase]).classes("dim")
    for kind, count in sorted(record.percepts.items()):
        ui.label(shown_text(f"{count} × {kind.replace('_', ' ')}")).classes("why under-phase")
    for text in record.events:
        ui.label(shown_text(prose(text))).classes("why under-phase told")
    for change in record.changes[:MOST_CHANGES]:
        ui.label(shown_text(str(change))).classes("why under-phase")
    if len(record.changes) > MOST_CHANGES:
        more = len(record.changes) - MOST_CHANGES
        ui.label(f"and {more} more").classes("dim under-phase")
    if not (record.percepts or record.events or record.changes):
        ui.label("changes nothing").classes("dim under-phase")
