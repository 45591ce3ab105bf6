"""Questions of the run to its operator, with answers as buttons.

In a live run an answer is passed on to it; in any run its consequences can be tried.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nicegui import ui

from visup.agent import Question
from visup.agent.cycle.answers import NONE_OF_THE_MODELS
from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.pages.page_elements import safe_text, section_heading, text_button
from visup.console.pages.panels.what_if_panel import show_comparison
from visup.console.pages.playhead import Playhead
from visup.console.questions import open_questions
from visup.console.state import ConsoleState
from visup.runs.inputs.answer_box import put_answer


class QuestionsSection:
    """The questions open at the cursor.

    Args:
        state: Shared state of all pages.
        head: The cursor.
        key: Key of the run.
        role: Role of the user; only operators may try answers.
    """

    def __init__(self, state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
        self._state, self._head, self._key = state, head, key
        self._operator = role is ConsoleRole.OPERATOR
        self._open_questions()
        self._answer = ui.column().classes("w-full gap-0")
        head.listen(self._update, "Now")

    def _update(self) -> None:
        self._answer.clear()
        self._open_questions.refresh()

    @ui.refreshable_method
    def _open_questions(self) -> None:
        questions = open_questions(self._head.run.events, self._head.run.times[self._head.number])
        if questions:
            section_heading("Asked")
        for question in questions:
            with ui.element("div").classes("line warning"):
                ui.label(self._head.run.time_text(question.asked)).classes("when")
                ui.label(safe_text(question.text)).classes("said")
            if self._operator:
                self._buttons(question)

    def _buttons(self, question: Question) -> None:
        if not self._head.run.ended:
            self._row("answer:", question, self._send_answer)
        self._row("if answered:", question, self._try_answer)

    def _row(self, label: str, question: Question, on_answer: Callable[[int, str], object]) -> None:
        with ui.row().classes("gap-1 items-center under-line"):
            ui.label(label).classes("dim")
            for name in (*question.names, NONE_OF_THE_MODELS[0]):
                label_of_name = (
                    name.replace("_", " ") if name != NONE_OF_THE_MODELS[0] else "none of them"
                )
                text_button(safe_text(label_of_name), partial(on_answer, question.object_id, name))

    def _send_answer(self, object_id: int, name: str) -> None:
        try:
            put_answer(self._head.run.folder, object_id, name)
        except VisupError as fault:
            ui.notify(safe_text(str(fault)), type="negative")
            return
        ui.notify("Sent to the run; it takes effect with the next frame.")

    async def _try_answer(self, object_id: int, name: str) -> None:
        number, steps = self._head.number + 1, len(self._head.run.frames)
        inquiry, key = self._state.inquiry, self._key
        await show_comparison(
            lambda: inquiry(key).what_if_answered(number, object_id, name, steps),
            self._answer,
            self._head,
            show_assumption=True,
        )
