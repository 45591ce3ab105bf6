"""Breakpoints, and the changes made by each phase of a step."""

from __future__ import annotations

from functools import partial

from nicegui import run, ui
from nicegui.events import ValueChangeEventArguments

from visup.agent.contract.phases import Phase
from visup.agent.model.errors import VisupError
from visup.console.pages.page_elements import icon_button, safe_text, section_heading, text_button
from visup.console.pages.playhead import Playhead
from visup.console.reasoning.debugging import PhaseRecord, StopSearchResult
from visup.console.state import ConsoleState
from visup.wording import EVENT_KINDS, prose

EXAMPLE = "alert, stage captured, when gap(1, 2) < 20 px"
MAX_CONDITION_LENGTH = 500
MAX_CHANGES = 120
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
    _PhaseStepper(state, head, key)


class _Breakpoints:
    """The breakpoints, and the search for the next one."""

    def __init__(self, state: ConsoleState, head: Playhead, key: str) -> None:
        self._state, self._head, self._key = state, head, key
        self._conditions: dict[str, bool] = {"alert": True}
        self._searching = self._cancelled = False
        ui.context.client.on_disconnect(partial(setattr, self, "_cancelled", True))
        section_heading("Stop at")
        self._condition_input()
        self._condition_list()
        with ui.row().classes("items-center gap-2"):
            text_button("Continue", self._continue, primary=True)
            self._status = ui.label().classes("why").props("role=status")

    def _condition_input(self) -> None:
        with ui.row().classes("w-full items-center no-wrap"):
            known = [f"event {kind}" for kind in EVENT_KINDS]
            typed = ui.input(placeholder=EXAMPLE, autocomplete=[*known, *_stages(self._head)])
            typed.props('dense outlined aria-label="Where to stop"').classes("grow")
            typed.on("keydown.enter", partial(self._add, typed))
            text_button("Add", partial(self._add, typed))

    def _add(self, typed: ui.input) -> None:
        if text := " ".join(str(typed.value or "").split())[:MAX_CONDITION_LENGTH]:
            self._conditions[text] = True
            self._condition_list.refresh()
        typed.set_value("")

    @ui.refreshable_method
    def _condition_list(self) -> None:
        for condition, enabled in self._conditions.items():
            with ui.element("div").classes("line"):
                box = ui.checkbox(safe_text(condition), value=enabled).props("dense size=xs")
                box.classes("said").on_value_change(partial(self._switch, condition))
                icon_button(
                    "close", f"Delete {safe_text(condition)}", partial(self._delete, condition)
                )

    def _switch(self, condition: str, e: ValueChangeEventArguments[bool]) -> None:
        self._conditions[condition] = bool(e.value)

    def _delete(self, condition: str) -> None:
        self._conditions.pop(condition, None)
        self._condition_list.refresh()

    async def _continue(self) -> None:
        if self._searching:
            self._cancelled = True
            return
        self._searching, self._cancelled = True, False
        self._status.set_text("reasoning on ... (press again to stop)")
        start, conditions = (
            self._head.number,
            [w for w, enabled in self._conditions.items() if enabled],
        )
        try:
            found = await run.io_bound(self._search, start, conditions)
            if found is not None:  # else the console is stopping
                self._show_result(found)
        except VisupError as fault:
            self._status.set_text(safe_text(str(fault)))
        finally:
            self._searching = False

    def _search(self, start: int, conditions: list[str]) -> StopSearchResult:
        inquiry = self._state.inquiry(self._key)
        return inquiry.next_stop(start + 1, conditions, lambda: self._cancelled)

    def _show_result(self, found: StopSearchResult) -> None:
        if found.reasons:
            self._head.go(found.number - 1)
            when = self._head.run.time_text(self._head.run.times[self._head.number])
            self._status.set_text(safe_text(f"{when}  {'; '.join(map(prose, found.reasons))}"))
        elif found.ended:
            self._status.set_text("It does not happen before the end.")
        else:
            self._status.set_text("Given up.")


def _stages(head: Playhead) -> list[str]:
    return [f"stage {s.stage}" for t in head.run.mind(head.number).tasks for s in t.stages]


class _PhaseStepper:
    """Steps through the phases at the cursor and on into the next step."""

    def __init__(self, state: ConsoleState, head: Playhead, key: str) -> None:
        self._state, self._head, self._key = state, head, key
        self._records: tuple[PhaseRecord, ...] = ()
        self._number, self._shown = -1, 0
        section_heading("Inside the step")
        with ui.row().classes("items-center gap-2"):
            text_button("Next phase", self._next_phase, primary=True)
            ui.label("of the frame at the cursor, then of the next one").classes("dim")
        region = ui.element("div").classes("scroll")
        with region.props('tabindex=0 role=region aria-label="Phases"'):
            self._phases()
        head.listen(self._update, "Steps")

    async def _next_phase(self) -> None:
        if self._number == self._head.number and self._shown >= len(self._records):
            self._head.step(1)
        if self._number != (number := self._head.number):
            try:
                records = await run.io_bound(self._load_phases, number)
            except VisupError as fault:
                ui.notify(safe_text(str(fault)), type="negative", multi_line=True)
                return
            self._records, self._number, self._shown = records or (), number, 0
        self._shown += 1
        self._phases.refresh()

    def _load_phases(self, number: int) -> tuple[PhaseRecord, ...]:
        return self._state.inquiry(self._key).phases(number + 1)

    def _update(self) -> None:
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
        ui.label(safe_text(f"{count} × {kind.replace('_', ' ')}")).classes("why under-phase")
    for text in record.events:
        ui.label(safe_text(prose(text))).classes("why under-phase told")
    for change in record.changes[:MAX_CHANGES]:
        ui.label(safe_text(str(change))).classes("why under-phase")
    if len(record.changes) > MAX_CHANGES:
        more = len(record.changes) - MAX_CHANGES
        ui.label(f"and {more} more").classes("dim under-phase")
    if not (record.percepts or record.events or record.changes):
        ui.label("changes nothing").classes("dim under-phase")
