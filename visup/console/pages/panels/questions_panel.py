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
from visup.console.pages.frame import part_heading, shown_text, worded_button
from visup.console.pages.panels.try_panel import show_tried
from visup.console.pages.playhead import Playhead
from visup.console.questions import questions_at
from visup.console.state import ConsoleState
from visup.runs.inputs.answer_box import put_answer


class QuestionsPart:
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
                ui.label(self._head.run.when(question.asked)).classes("when")
                ui.label(shown_text(question.text)).classes("said")
            if self._operator:
                self._buttons(question)

    def _buttons(self, question: Question) -> None:
        if not self._head.run.ended:
            self._row("answer:", question, self._say)
        self._row("if answered:", question, self._try)

    def _row(self, what: str, question: Question, act: Callable[[int, str], object]) -> None:
        with ui.row().classes("gap-1 items-center under-line"):
            ui.label(what).classes("dim")
            for name in (*question.names, NONE_OF_THE_MODELS[0]):
                shown = name.replace("_", " ") if name != NONE_OF_THE_MODELS[0] else "none of them"
                worded_button(shown_text(shown), partial(act, question.object_id, name))

    def _say(self, object_id: int, name: str) -> None:
        try:
            put_answer(self._head.run.folder, object_id, name)
        except VisupError as fault:
            ui.notify(shown_text(str(fault)), type="negative")
            return
        ui.notify("Sent to the run; it takes effect with the next frame.")

    async def _try(self, object_id: int, name: str) -> None:
        number, steps = self._head.number + 1, len(self._head.run.frames)
        inquiry, key = self._state.inquiry, self._key
        await show_tried(
            lambda: inquiry(key).as_if_answered(number, object_id, name, steps),
            self._answer,
            self._head,
            assumed=True,
        )
