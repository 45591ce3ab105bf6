"""Breakpoints, and the inside of a step: where the run next does something, and what each phase changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from nicegui import run, ui

from visup.agent.contract.phases import Phase
from visup.agent.model.errors import VisupError
from visup.console.pages.frame import button, clock, part_heading, shown_text, worded_button
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


@dataclass(slots=True)
class BreakpointList:
    """The breakpoints of a page, and whether a search goes on.

    Attributes:
        words: Condition -> whether it is looked at.
        searching: Whether a search goes on.
        left: Whether the page was left, or the search given up.
    """

    words: dict[str, bool] = field(default_factory=lambda: {"alert": True})
    searching: bool = False
    left: bool = False

    @property
    def active(self) -> list[str]:
        """Those that are looked at."""
        return [w for w, on in self.words.items() if on]


def steps_panel(state: ConsoleState, head: Playhead, key: str) -> None:
    """Lay out the panel."""
    stops = BreakpointList()
    ui.context.client.on_disconnect(lambda: setattr(stops, "left", True))
    ui.context.client.on_connect(lambda: setattr(stops, "left", False))
    _breakpoints(state, head, key, stops)
    _inside(state, head, key)


def _breakpoints(state: ConsoleState, head: Playhead, key: str, stops: BreakpointList) -> None:
    async def go_on() -> None:
        if stops.searching:
            stops.left = True
            return
        stops.searching, stops.left, begin = True, False, head.number
        said.set_text("reasoning on ... (press again to stop)")
        try:
            asked = stops.active
            found = await run.io_bound(
                lambda: state.inquiry(key).next_stop(begin + 1, asked, lambda: stops.left)
            )
            if found is not None:
                _arrive(found, head, said)
        except VisupError as fault:
            said.set_text(shown_text(str(fault)))
        finally:
            stops.searching = False

    def add(words: str) -> None:
        if text := " ".join(words.split())[:LONGEST]:
            stops.words[text] = True
            listed.refresh()
        typed.set_value("")

    part_heading("Stop at")
    with ui.row().classes("w-full items-center no-wrap"):
        known = [f"event {kind}" for kind in EVENT_KINDS]
        typed = ui.input(placeholder=EXAMPLE, autocomplete=[*known, *_stages(head)])
        typed.props('dense outlined aria-label="Where to stop"').classes("grow")
        typed.on("keydown.enter", lambda: add(str(typed.value or "")))
        worded_button("Add", lambda: add(str(typed.value or "")))

    @ui.refreshable
    def listed() -> None:
        for words in stops.words:
            _breakpoint(words, stops, listed.refresh)

    listed()
    with ui.row().classes("items-center gap-2"):
        worded_button("Go on", go_on, main=True)
        said = ui.label().classes("why").props("role=status")


def _arrive(found: FoundStop, head: Playhead, said: ui.label) -> None:
    if found.reasons:
        head.go(found.number - 1)
        when = clock(head.run.times[head.number])
        said.set_text(shown_text(f"{when}  {'; '.join(map(prose, found.reasons))}"))
    elif found.ended:
        said.set_text("Nothing of it happens up to the end.")
    else:
        said.set_text("Given up.")


def _stages(head: Playhead) -> list[str]:
    return [f"stage {s.stage}" for t in head.run.mind(head.number).tasks for s in t.stages]


def _breakpoint(words: str, stops: BreakpointList, again: Callable[[], object]) -> None:
    def switch(on: bool) -> None:
        stops.words[words] = on

    def delete() -> None:
        stops.words.pop(words, None)
        again()

    with ui.element("div").classes("line"):
        box = ui.checkbox(
            shown_text(words), value=stops.words[words], on_change=lambda e: switch(bool(e.value))
        )
        box.props("dense size=xs").classes("said")
        button("close", f"Delete {shown_text(words)}", delete)


def _inside(state: ConsoleState, head: Playhead, key: str) -> None:
    """The phases of the step at the cursor, one after the other."""
    at = {"phase": -1}
    known: dict[int, tuple[PhaseRecord, ...]] = {}

    async def forth() -> None:
        number = head.number
        if number not in known:
            try:
                records = await run.io_bound(lambda: state.inquiry(key).phases(number + 1))
            except VisupError as fault:
                ui.notify(shown_text(str(fault)), type="negative", multi_line=True)
                return
            known.clear()
            known[number] = records or ()
        at["phase"] += 1
        if at["phase"] < len(known[number]):
            shown.refresh()
        else:
            at["phase"] = -1
            head.step(1)
            shown.refresh()
            if head.number != number:
                await forth()

    def moved() -> None:
        if head.number not in known:
            at["phase"] = -1
        shown.refresh()

    part_heading("Inside the step")
    with ui.row().classes("items-center gap-2"):
        worded_button("Next phase", forth, main=True)
        ui.label("of the frame at the cursor, then of the next one").classes("dim")

    @ui.refreshable
    def shown() -> None:
        records = known.get(head.number, ())
        for number, record in enumerate(records[: at["phase"] + 1]):
            _phase(record, last=number == at["phase"])

    with ui.element("div").classes("scroll").props('tabindex=0 role=region aria-label="Phases"'):
        shown()
    head.listen(moved, "Steps")


def _phase(record: PhaseRecord, *, last: bool) -> None:
    with ui.element("div").classes("line now" if last else "line"):
        ui.label(record.phase.value).classes("said phase")
        ui.label(PHASES[record.phase]).classes("dim")
    for kind, count in sorted(record.percepts.items()):
        ui.label(shown_text(f"{count} × {kind.replace('_', ' ')}")).classes("why under-phase")
    for text in record.told:
        ui.label(shown_text(prose(text))).classes("why under-phase told")
    for change in record.changes[:MOST_CHANGES]:
        ui.label(shown_text(str(change))).classes("why under-phase")
    if len(record.changes) > MOST_CHANGES:
        more = len(record.changes) - MOST_CHANGES
        ui.label(f"and {more} more").classes("dim under-phase")
    if not (record.percepts or record.told or record.changes):
        ui.label("changes nothing").classes("dim under-phase")
