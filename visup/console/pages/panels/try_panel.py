"""What if: another belief from the cursor on, or another task or other rules for the whole run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import run, ui

from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.pages.frame import clock, shown_text, worded_button
from visup.console.pages.playhead import Playhead
from visup.console.reasoning.inquiry import AlternativeCourse
from visup.console.state import ConsoleState
from visup.wording import prose

ASSUMED = "object 2 satellite, touching 1 2 false, object 1 hidden"
KINDS = {"task": "another task", "rules": "other rules"}
MOST_LINES = 200
LONGEST_TEXT = 100_000


def try_panel(state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
    """Lay out the panel."""
    if role is not ConsoleRole.OPERATOR:
        ui.label("Who may only look cannot try things out.").classes("dim")
        return
    steps = len(head.run.frames)

    async def tried(course: Callable[[], AlternativeCourse]) -> None:
        answer.clear()
        with answer:
            ui.spinner(size="md")
        try:
            found = await run.io_bound(course)
        except VisupError as fault:
            answer.clear()
            with answer:
                ui.label(shown_text(str(fault))).classes("why")
            return
        answer.clear()
        if found is not None:  # the console is being stopped
            with answer:
                _course(found, head)

    _assume(
        lambda what, number: tried(lambda: state.inquiry(key).what_if(number, what, steps)), head
    )
    _write(lambda kind, text: tried(lambda: state.inquiry(key).judged_by(kind, text, steps)))
    with (
        ui.element("div")
        .classes("scroll")
        .props('tabindex=0 role=region aria-label="What would differ"')
    ):
        answer = ui.column().classes("w-full gap-0")


def _assume(begin: Callable[[str, int], Awaitable[None]], head: Playhead) -> None:
    ui.label("What if, from the cursor on?").classes("dim")
    with ui.row().classes("w-full items-center no-wrap"):
        said = ui.input(placeholder=ASSUMED).props('dense outlined aria-label="What is assumed"')
        said.classes("grow")
        worded_button("Try", lambda: begin(str(said.value or ""), head.number + 1), main=True)


def _write(begin: Callable[[str, str], Awaitable[None]]) -> None:
    with ui.expansion("Judge the whole run by another task or other rules").classes("w-full"):
        kind = ui.select(KINDS, value="task").props('dense outlined aria-label="What is written"')
        text = ui.codemirror("", language=None, theme="basicLight").classes("w-full")
        text.style("height:200px")

        async def judge() -> None:
            written = str(text.value or "")
            if len(written) > LONGEST_TEXT:
                ui.notify(f"at most {LONGEST_TEXT} letters", type="negative")
                return
            await begin(str(kind.value), written)

        worded_button("Judge", judge, main=True)


def _course(course: AlternativeCourse, head: Playhead) -> None:
    """What both courses tell, side by side."""
    was, would = (v or "none" for v in course.differs.verdicts)
    verdicts = f"verdict: {was}" if was == would else f"verdict: {was} → {would}"
    ui.label(verdicts.replace("_", " ")).style("font-weight:600")
    if not course.differs:
        ui.label(f"Nothing else is told, up to {clock(course.until)}.").classes("dim")
    marked = [("−", e) for e in course.differs.gone] + [("+", e) for e in course.differs.new]
    marked.sort(key=lambda m: float(m[1].get("time", 0.0)))
    for mark, event in marked[:MOST_LINES]:
        time = float(event.get("time", 0.0))
        with ui.element("div").classes("line"):
            ui.label(mark).classes("when")
            ui.label(clock(time)).classes("when")
            with ui.element("button").classes("plain said") as button:
                ui.label(shown_text(prose(str(event.get("text", "")))))
            button.on("click", lambda t=time: head.go_to_time(t))
