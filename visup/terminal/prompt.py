"""The prompt of `visup step`: completion, history, help."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from visup.agent import Presence, Truth
from visup.agent.contract.phases import Phase
from visup.rules.predicates.snapshot import RELATION_NAMES
from visup.rules.predicates.vocabulary import RULES
from visup.stepping.explanations import questions as asking
from visup.terminal.session import Session
from visup.terminal.session_commands import COMMANDS
from visup.wording import EVENT_KINDS

if TYPE_CHECKING:
    from prompt_toolkit.completion import CompleteEvent, Completer, Completion
    from prompt_toolkit.document import Document

Words = Callable[[Session], Iterable[str]]


def _objects(session: Session) -> list[str]:
    return [str(i) for i in sorted(session.stepper.mind.objects)]


def _names(session: Session) -> list[str]:
    names = session.stepper.names
    return [*names.stages, *names.rules]


_WORDS: Mapping[str, Words] = {
    "stop": lambda s: [
        *("until", "event", "rule", "stage", "object", "frame", "when", "change"),
        *(p.value for p in Phase),
        *EVENT_KINDS,
        *_names(s),
    ],
    "why": lambda s: [
        *("not", *asking.WHY_TOPICS, *asking.WHY_NOT_TOPICS),
        *_names(s),
        *RELATION_NAMES,
        *_objects(s),
        *(str(a.id) for a in s.stepper.mind.alerts),
    ],
    "object": lambda s: [
        *("object", "unknown", *_objects(s), *s.stepper.mind.actors, *s.agent.models),
        *(p.value for p in Presence),
    ],
    "relation": lambda s: [*RELATION_NAMES, *(t.value for t in Truth)],
    "break": lambda s: [str(n) for n in s.stepper.breakpoints],
    "mark": lambda s: ["start", "end", *s.marks],
    "file": lambda s: ["rules", "task"],
    "command": lambda s: list(COMMANDS),
    "expression": lambda s: [*RULES.predicates, *RULES.quantities],
}


def completions(session: Session, line: str) -> list[str]:
    """Completions of the last word of a line.

    Args:
        session: Provides objects, stages, rules, breakpoints and marks.
        line: The text typed so far.
    """
    *before, last = line.split(" ")
    if not before:
        return [w for w in session.words() if w.startswith(last) and w != "until"]
    command = COMMANDS.get(before[0].removesuffix("!"))
    found = [w for kind in (command.completes if command else ()) for w in _WORDS[kind](session)]
    return list(dict.fromkeys(w for w in found if w.startswith(last)))


def read_commands(session: Session) -> Iterator[str]:
    """Lines that the user enters, with history and completion on a terminal, plain from a pipe."""
    if not sys.stdin.isatty():
        yield from sys.stdin
        return
    from prompt_toolkit import PromptSession
    from prompt_toolkit.auto_suggest import AutoSuggestFromHistory
    from prompt_toolkit.history import FileHistory, InMemoryHistory

    history_path = history_file()
    prompt: PromptSession[str] = PromptSession(
        completer=_completer(session),
        history=FileHistory(str(history_path)) if history_path else InMemoryHistory(),
        auto_suggest=AutoSuggestFromHistory(),
        bottom_toolbar=lambda: toolbar(session),
    )
    while True:
        try:
            yield prompt.prompt("visup> ")
        except (EOFError, KeyboardInterrupt):
            return


def toolbar(session: Session) -> str:
    """The position of the session in one line of at most 80 characters."""
    stepper = session.stepper
    branch = f"  branch from {stepper.begin}" if len(session.timelines) > 1 else ""
    inside = f"  after {stepper.paused.phase.value}" if stepper.paused else ""
    position = f" step {stepper.at} of {stepper.made}{inside}{branch}  {stepper.mind.time:.2f} s"
    return f"{position}  Tab completes, 'help step' explains"[:80]


def history_file() -> Path | None:
    """File of the command history; None if nothing can be written."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    try:
        (base / "visup").mkdir(parents=True, exist_ok=True)
        path = base / "visup" / "step-history"
        path.touch()
    except OSError:
        return None
    return path


def _completer(session: Session) -> Completer:
    from prompt_toolkit.completion import Completer, Completion

    class LastWordCompleter(Completer):
        """Completes the last word of the line."""

        def get_completions(
            self, document: Document, complete_event: CompleteEvent
        ) -> Iterator[Completion]:
            line = document.text_before_cursor
            last = line.split(" ")[-1]
            for word in completions(session, line):
                yield Completion(word, start_position=-len(last))

    return LastWordCompleter()
