"""What-if analysis: a changed belief from the cursor on, compared with the run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import run, ui

from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.pages.frame import shown_text, worded_button
from visup.console.pages.playhead import Playhead
from visup.console.reasoning.inquiry import AlternativeCourse
from visup.console.state import ConsoleState
from visup.wording import prose

ASSUMED = "object 2 satellite, touching 1 2 false, object 1 hidden"
MOST_LINES = 200


def try_panel(state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
    """Lay out the panel."""
    if role is not ConsoleRole.OPERATOR:
        ui.label("Read-only access: you cannot try things out.").classes("dim")
        return
    steps = len(head.run.frames)

    async def tried(what: str, number: int) -> None:
        await show_tried(lambda: state.inquiry(key).what_if(number, what, steps), answer, head)

    _assume(tried, head)
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


async def show_tried(
    course: Callable[[], AlternativeCourse],
    answer: ui.element,
    head: Playhead,
    *,
    assumed: bool = False,
) -> None:
    """Compute an alternative course in the background, and show it or the reason for its failure.

    Args:
        course: Computes it.
        answer: Element for the result.
        head: The cursor.
        assumed: Whether to show the assumption.
    """
    answer.clear()
    with answer:
        ui.spinner(size="md")
    found, said = None, ""
    try:
        found = await run.io_bound(course)
    except VisupError as fault:
        said = str(fault)
    if answer.is_deleted:  # the page was closed meanwhile
        return
    answer.clear()
    with answer:
        if found is not None:
            if assumed:
                ui.label(shown_text(found.assumed)).classes("dim")
            _show_course(found, head)
        elif said:  # with neither, the console is stopping
            ui.label(shown_text(said)).classes("why")


def _show_course(course: AlternativeCourse, head: Playhead) -> None:
    """Show the events of both timelines side by side."""
    was, would = (v or "none" for v in course.differs.verdicts)
    verdicts = f"verdict: {was}" if was == would else f"verdict: {was} → {would}"
    ui.label(verdicts.replace("_", " ")).style("font-weight:600")
    if not course.differs:
        ui.label(f"No other events, up to {head.run.when(course.until)}.").classes("dim")
    marked = [("−", e) for e in course.differs.gone] + [("+", e) for e in course.differs.new]
    marked.sort(key=lambda m: float(m[1].get("time", 0.0)))
    for mark, event in marked[:MOST_LINES]:
        time = float(event.get("time", 0.0))
        with ui.element("div").classes("line"):
            ui.label(mark).classes("when")
            ui.label(head.run.when(time)).classes("when")
            with ui.element("button").classes("plain said") as button:
                ui.label(shown_text(prose(str(event.get("text", "")))))
            button.on("click", lambda t=time: head.go_to_time(t))
