"""Explanations (why, why not) at the cursor, shown as a tree down to frames."""

from __future__ import annotations

from functools import partial

from nicegui import run, ui

from visup.agent import Severity
from visup.agent.model.errors import VisupError
from visup.console.pages.page_elements import safe_text, text_button
from visup.console.pages.playhead import Playhead
from visup.console.recorded_mind import is_open_at
from visup.console.state import ConsoleState
from visup.stepping.explanations.evidence import Why
from visup.wording import prose

MAX_LINES = 400
EXAMPLE = "touching 1 2, identity 1, not coupled 1 2"


def ask_panel(state: ConsoleState, head: Playhead, key: str) -> None:
    """Lay out the panel."""

    async def ask(question: str) -> None:
        answer.clear()
        with answer:
            ui.label("Reasoning the run again up to the cursor…").classes("dim")
            ui.spinner(size="md")
        try:
            number = head.number
            why = await run.io_bound(lambda: state.inquiry(key).why(number + 1, question))
        except VisupError as fault:
            _show_message(str(fault))
            return
        answer.clear()
        if why is None:  # the console is stopping
            return
        with answer:
            ui.label(f"{question}, at {head.run.time_text(head.run.times[number])}").classes("dim")
            _tree(why, head)

    def _show_message(text: str) -> None:
        answer.clear()
        with answer:
            ui.label(safe_text(text)).classes("why")

    with ui.row().classes("w-full items-center no-wrap"):
        asked = ui.input(placeholder=EXAMPLE).props('dense outlined aria-label="Why ...?"')
        asked.classes("grow").on("keydown.enter", lambda: ask(str(asked.value or "")))
        text_button("Why?", lambda: ask(str(asked.value or "")), primary=True)

    @ui.refreshable
    def suggestions() -> None:
        with ui.row().classes("gap-1"):
            for question in suggested_questions(head):
                text_button(question, partial(ask, question))

    suggestions()
    head.listen(suggestions.refresh, "Ask")
    with ui.element("div").classes("scroll").props('tabindex=0 role=region aria-label="Answer"'):
        answer = ui.column().classes("w-full gap-0")


def suggested_questions(head: Playhead) -> list[str]:
    """Suggested questions at the cursor."""
    mind = head.run.mind(head.number)
    opened = [a for a in head.run.alerts if a.severity > Severity.INFO and is_open_at(a, mind.time)]
    alerts = [f"alert {a.id}" for a in opened[:3]]
    stages = [t.current for t in mind.tasks if t.current]
    objects = [b for b in mind.present() if b.candidates][:3]
    verdict = ["verdict"] if mind.tasks else []
    return [*alerts, *verdict, *stages, *(f"identity {b.id}" for b in objects)]


def _tree(why: Why, head: Playhead, depth: int = 0, lines_left: list[int] | None = None) -> None:
    """The explanation, indented; a click on a line with a frame moves the cursor there."""
    lines_left = [MAX_LINES] if lines_left is None else lines_left
    if lines_left[0] <= 0:
        return
    lines_left[0] -= 1
    with ui.element("div").classes("line").style(f"padding-left:{6 + 14 * depth}px"):
        if why.time is None:
            ui.label(safe_text(prose(why.text))).classes("why")
        else:
            frame = why.frame_index
            with ui.element("button").classes("plain why") as button:
                ui.label(safe_text(why.line()))
            button.on("click", lambda: head.go(head.run.moment_of_frame(frame or 0)))
    for part in why.parts:
        _tree(part, head, depth + 1, lines_left)
