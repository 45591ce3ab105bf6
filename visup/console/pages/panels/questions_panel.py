"""What the run asked its operator: each answer is a button, and shows what would have followed from it."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from visup.agent import Question
from visup.agent.cycle.answers import NOBODY
from visup.console.access import ConsoleRole
from visup.console.pages.frame import clock, part_heading, shown_text, worded_button
from visup.console.pages.panels.try_panel import show_tried
from visup.console.pages.playhead import Playhead
from visup.console.questions import questions_at
from visup.console.state import ConsoleState


class QuestionsPart:
    """The questions that wait at the cursor.

    Args:
        state: What all pages share.
        head: The cursor.
        key: Of the run.
        role: Of whoever looks; only operators may try answers.
    """

    def __init__(self, state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
        self._state, self._head, self._key = state, head, key
        self._operator = role is ConsoleRole.OPERATOR
        self._waiting()
        self._answer = ui.column().classes("w-full gap-0")
        head.listen(self._moved, "Now")

    def _moved(self) -> None:
        self._answer.clear()
        self._waiting.refresh()

    @ui.refreshable_method
    def _waiting(self) -> None:
        waiting = questions_at(self._head.run.events, self._head.run.times[self._head.number])
        if waiting:
            part_heading("Asked")
        for question in waiting:
            with ui.element("div").classes("line warning"):
                ui.label(clock(question.asked)).classes("when")
                ui.label(shown_text(question.text)).classes("said")
            if self._operator:
                self._buttons(question)

    def _buttons(self, question: Question) -> None:
        with ui.row().classes("gap-1 items-center under-line"):
            ui.label("as if answered:").classes("dim")
            for name in (*question.names, NOBODY[0]):
                shown = name.replace("_", " ") if name != NOBODY[0] else "none of them"
                worded_button(shown_text(shown), partial(self._try, question.object_id, name))

    async def _try(self, object_id: int, name: str) -> None:
        number, steps = self._head.number + 1, len(self._head.run.frames)
        inquiry, key = self._state.inquiry, self._key
        await show_tried(
            lambda: inquiry(key).as_if_answered(number, object_id, name, steps),
            self._answer,
            self._head,
            assumed=True,
        )
