"""Answers to a run from other processes, such as the console: lines in a file of its folder.

An answer is a line `ID=NAME`; the run reads new lines after each step. The last answer on an object holds, so
that a resumed run does not repeat those it has already.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from visup.agent import Frame
from visup.agent.cycle.agent import Agent
from visup.agent.cycle.answers import resolve_model
from visup.agent.model.errors import OutputError, VisupError
from visup.agent.model.step import Step
from visup.agent.storage.file_lock import only_writer
from visup.agent.storage.text_file import read_bounded
from visup.runs.operator import parse_answers

ANSWERS = "answers.txt"
MAX_FILE_BYTES = 2**16
"""Maximum size of the answers to a run, bytes."""


def put_answer(folder: Path, object_id: int, name: str) -> None:
    """Leave an answer for a live run, from any process.

    Args:
        folder: Folder of the run.
        object_id: The object.
        name: A model, an actor, or 'unknown' for none of the models.

    Raises:
        SettingsError: The name cannot be part of such a line.
        OutputError: The folder cannot be written, or has too many answers already.
    """
    ((number, answer),) = parse_answers([f"{object_id}={' '.join(name.split())}"]).items()
    path = folder / ANSWERS
    try:
        with only_writer(path, "answers to this run"), path.open("a", encoding="utf-8") as out:
            if out.tell() > MAX_FILE_BYTES // 2:
                raise OutputError("too many answers wait for this run", where=str(path))
            out.write(f"{number}={answer}\n")
    except OSError as fault:
        why = f"the answer cannot be kept: {fault.strerror}"
        raise OutputError(why, where=str(path)) from fault


class AnswerBox:
    """An observer that passes answers in the run folder to an agent.

    Args:
        agent: The agent.
        folder: Gives the folder, which changes when a run rolls over; None for none.
        report_error: Receives errors of lines.
    """

    def __init__(
        self,
        agent: Agent,
        folder: Callable[[], Path | None],
        report_error: Callable[[str], None] | None,
    ) -> None:
        self._agent, self._folder, self._report_error = agent, folder, report_error
        self._path: Path | None = None
        self._bytes_read = 0
        self._waiting: dict[int, str] = {}

    def __call__(self, step: Step, frame: Frame) -> None:
        """Pass on new answers about known objects."""
        for line in self._new_lines():
            self._try(self._receive, line)
        for number in [i for i in self._waiting if i in self._agent.mind.objects]:
            self._try(self._pass_on, number, self._waiting.pop(number))

    def _receive(self, line: str) -> None:
        self._waiting.update(parse_answers([line]))

    def _pass_on(self, number: int, name: str) -> None:
        agent = self._agent
        model = resolve_model(agent.mind, name, agent.models, cast=agent.cast)
        if agent.mind.answers.get(number) != model:
            agent.answer(number, name)

    def _try(self, action: Callable[..., None], *arguments: object) -> None:
        try:
            action(*arguments)
        except VisupError as fault:
            if self._report_error:
                self._report_error(str(fault))

    def _new_lines(self) -> list[str]:
        """New complete lines."""
        folder = self._folder()
        if folder is None:
            return []
        if (path := folder / ANSWERS) != self._path:
            self._path, self._bytes_read = path, 0
        try:
            if path.stat().st_size == self._bytes_read:
                return []
            new = read_bounded(path, MAX_FILE_BYTES)[self._bytes_read :]
        except OSError:
            return []  # no answers yet, or not a regular file
        complete = new[: new.rfind(b"\n") + 1]
        self._bytes_read += len(complete)
        return complete.decode("utf-8", errors="replace").splitlines()
