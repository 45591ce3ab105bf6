"""The operator of a run, who identifies objects in advance, in a file, or on the terminal.

The run never waits for an answer: a separate thread reads lines, which are processed after each step.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread

from visup.agent import Frame, Mind
from visup.agent.cycle.agent import Agent
from visup.agent.cycle.answers import resolve_model
from visup.agent.model.errors import SettingsError, VisupError
from visup.agent.model.step import Observer, Step
from visup.agent.storage.text_file import read_text_file

MAX_DIGITS = 18
"""Maximum number of digits of an object id."""


def parse_answers(lines: Iterable[str], where: str | None = None) -> dict[int, str]:
    """Parse answers `ID=NAME`; empty lines and comments after `#` are skipped.

    >>> parse_answers(["2=arm", "", "1 = satellite  # the big one"])
    {2: 'arm', 1: 'satellite'}

    Args:
        lines: One answer each.
        where: Name of the file, for errors.

    Raises:
        SettingsError: A line is malformed.
    """
    answers = {}
    for line in lines:
        text = line.split("#")[0].strip()
        if not text:
            continue
        number, equals, name = (part.strip() for part in text.partition("="))
        if not (number.isdecimal() and len(number) <= MAX_DIGITS and equals and name):
            raise SettingsError(
                f"the answer {text!r} cannot be read",
                where=where,
                expected="ID=NAME, such as 2=arm",
            )
        answers[int(number)] = name
    return answers


def read_answers(path: Path) -> dict[int, str]:
    """Answers from a file.

    Raises:
        SettingsError: It cannot be read, or a line is not of the form ID=NAME.
    """
    try:
        return parse_answers(read_text_file(path).splitlines(), str(path))
    except (OSError, UnicodeDecodeError) as fault:
        raise SettingsError(f"the answers cannot be read: {fault}", where=str(path)) from fault


def typed_lines() -> Callable[[], list[str]] | None:
    """A non-blocking reader of lines typed on the terminal; None without a terminal."""
    if not sys.stdin.isatty():
        return None
    typed: SimpleQueue[str] = SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            typed.put(line)

    Thread(target=read, name="operator", daemon=True).start()
    return lambda: _drained(typed)


def _drained(queue: SimpleQueue[str]) -> list[str]:
    lines = []
    while True:
        try:
            lines.append(queue.get_nowait())
        except Empty:
            return lines


@dataclass(slots=True)
class HumanOperator:
    """Passes answers to an agent.

    Attributes:
        answers: Answers given in advance: object id -> name; each waits until its object is known.
        typed: Gives the lines typed since the last call, or None.
        tell: Receives errors of typed lines, and how to answer a question.
    """

    answers: dict[int, str] = field(default_factory=dict)
    typed: Callable[[], list[str]] | None = None
    tell: Callable[[str], None] = print

    def attend(self, agent: Agent, *, at_once: bool = False) -> Observer:
        """An observer that passes answers to an agent after each step.

        Args:
            agent: The agent.
            at_once: Whether to pass on answers about known objects immediately, since a killed run may not
                have done so.

        Raises:
            SettingsError: An answer given in advance has an unknown name.
        """
        for name in self.answers.values():
            resolve_model(agent.mind, name, agent.models, cast=agent.cast)
        pending = dict(self.answers)

        def pass_on() -> None:
            for number in [i for i in pending if _known(agent.mind, i)]:
                agent.answer(number, pending.pop(number))

        if at_once:
            pass_on()

        def after(step: Step, frame: Frame) -> None:
            pass_on()
            if self.typed is None:
                return
            for event in step.events:
                if event.kind == "question":
                    name = event.data["names"][0]
                    self.tell(f"Type an answer such as {event.objects[0]}={name} at any time.")
            for line in self.typed():
                self._process_line(agent, line, step.time)

        return after

    def _process_line(self, agent: Agent, line: str, now: float) -> None:
        """Process a typed line: ID=NAME, or a name alone while one question is open.

        A name typed before the question could be read is no answer to it.
        """
        open_questions = [q for q in agent.mind.questions if q.asked < now]
        if "=" not in line and line.strip() and len(open_questions) == 1:
            line = f"{open_questions[0].object_id}={line}"
        try:
            for number, name in parse_answers([line]).items():
                agent.answer(number, name)
        except VisupError as fault:
            self.tell(str(fault))


def _known(mind: Mind, object_id: int) -> bool:
    belief = mind.objects.get(object_id)
    return belief is not None and belief.confirmed
