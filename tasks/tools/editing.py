"""Editor support for task files: hover, definition, references, completion.

Independent of the Language Server Protocol; positions are lines and columns counted from 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from visup.rules.formula.units import Span
from visup.rules.language.diagnostics import Source
from visup.tasks.actions.actions import known_actions
from visup.tasks.actions.describe import described, written
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.checks.files import shipped_tasks
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.statement import NAME
from visup.tasks.grammar.templates import called
from visup.tasks.grammar.units import UNITS

STATEMENTS = (
    "actor",
    "optional actor",
    "bystander",
    "bystanders ignored",
    "ground is",
    "zone",
    "parameter",
    "include",
    "never",
    "always",
    "on failure of",
    "task",
)
WORDS = {
    "for": "must hold so long without a break: `for 5 s`",
    "within": "must be over so long after it began: `within 60 s`",
    "after": "begins so long after what comes before it is over: `after 10 s to 60 s`",
    "between": "a quantity stays within a range: `gap(arm, satellite) between 20 px and 100 px`",
    "every": "again and again, from one time to the next so long: `touching(wiper, glass) every 2 s to 4 s`",
    "at least": "how often at least: `at least 2 times`",
    "at most": "how often at most: `at most 5 times`",
    "any 2 of": "so many of them, one after the other: `any 2 of (<a>, <b>, <c>)`",
    "for each": "for each of some actors, in any order: `for each leg of (leg_1, leg_2) <mount(leg)>`",
    "already": "done also by what has been so since before its turn: `already touching(leg, top)`",
    "any order": "each once, one after the other: `any order (<a>, <b>)`",
    "begins when": "by what it begins: `begins when touching(arm, satellite)`",
    "ends when": "by what it ends",
    "progresses when": "what counts as progress",
    "fails when": "what counts as failure, in place of the contrary of the action",
    "pauses when": "while what work is paused: no clock runs, nothing is done or fails",
    "is": "what an actor may be: `is cup`, `is red`, `is the leftmost red`, `is part of arm`",
    "at": "the place of an actor in the image: `at (410, 160)`",
    "another": "an actor alike, but not the same: `is another red`",
    "what enters": "an actor by where it comes from: `is what enters from the left`",
    "what moves first": "an actor by its conduct",
    "what rests": "an actor by its conduct",
    "during": "for which stages an invariant is meant: `during <approach>`",
}


@dataclass(frozen=True, slots=True)
class NameUse:
    """A name in a file.

    Attributes:
        name: The name without brackets.
        kind: 'stage', 'action', 'name' (an actor, zone or parameter) or 'include'.
        span: Its position, without brackets.
    """

    name: str
    kind: str
    span: Span


@dataclass(frozen=True, slots=True)
class Completion:
    """A completion with its meaning."""

    text: str
    kind: str
    about: str


PATTERN = re.compile(
    rf'include\s*"(?P<include>[^"\n]*)"|"[^"\n]*"|<[ ]*(?P<stage>{NAME})[ ]*(?=[(>])'
    rf"|(?<!\w)(?P<action>{NAME})(?=\s*\()|(?<!\w)(?P<name>{NAME})"
)


def names(text: str) -> Iterator[NameUse]:
    """Every name of a file, even of one with mistakes; comments and strings are skipped."""
    code, _ = normalise(text, Source(text, ""))
    for number, line in enumerate(code.split("\n"), 1):
        for match in PATTERN.finditer(line):
            kind = match.lastgroup
            if kind is not None:
                start, end = match.span(kind)
                yield NameUse(match[kind], kind, Span(number, start + 1, number, end + 1))


def name_at(text: str, line: int, column: int) -> NameUse | None:
    """The name at or just before a position, or None."""
    for word in names(text):
        if word.span.line == line and word.span.column <= column <= word.span.end_column:
            return word
    return None


def hover(text: str, file: str, word: NameUse) -> str | None:
    """The meaning of a name in Markdown, or None."""
    task, _ = diagnose(text, file)
    action = known_actions().get(word.name)
    if word.kind == "stage":
        stage = next((s for s in task.stages if called(s.name)[0] == word.name), None)
        return f"```\n{stage}\n```" if stage else None
    if word.kind == "action" and action is not None:
        return described(action)
    for declared in task.declared:
        if declared.name == word.name:
            return f"`{declared}`"
    if word.kind == "name" and any(w.name == word.name for w in _actors(text)):
        return f"actor `{word.name}`: stands for the model of its own name"
    said = [f"`{w}`: {about}" for w, about in WORDS.items() if word.name in w.split()]
    return "\n\n".join(said) if word.kind == "name" and said else None


def definition(text: str, file: str, word: NameUse) -> Span | None:
    """The definition of a stage, actor, zone or parameter, or None; `span.file` is its file."""
    task, _ = diagnose(text, file)
    if word.kind == "include":
        return None
    if word.kind == "stage":
        return next((s.span for s in task.stages if called(s.name)[0] == word.name), None)
    declared = next((d.span for d in task.declared if d.name == word.name), None)
    # An undeclared actor is defined by its first use.
    first = next((w.span for w in _actors(text) if w.name == word.name), None)
    return declared or first


def references(text: str, word: NameUse) -> list[NameUse]:
    """All references in this file to the same stage, actor, zone or parameter.

    A stage in the strict form is also an action; both would change together, so neither can be renamed.
    """
    if word.kind not in ("stage", "name"):
        return []
    if word.kind == "stage" and word.name in known_actions():
        task, _ = diagnose(text)
        stage = task.stage(word.name)
        if stage is not None and not hasattr(stage.body, "span"):
            return []
    return [w for w in names(text) if (w.kind, w.name) == (word.kind, word.name)]


def completions(text: str, file: str, line: int, column: int) -> list[Completion]:
    """Completions at a position, from the text before it in its line."""
    rows = text.split("\n")
    before = rows[line - 1][: column - 1] if 0 < line <= len(rows) else ""
    task, _ = diagnose(text, file)
    if re.search(r"#", before):
        return []
    if re.search(r'\binclude\s+"[^"]*$', before):
        return [Completion(n, "file", "a task that ships with visup") for n in shipped_tasks()]
    if re.search(rf"<[ ]*(?:{NAME})?$", before):
        return [Completion(s.name, "stage", str(s)) for s in task.stages]
    if re.search(rf"\d\s*(?:{NAME})?$", before) and not re.search(rf"{NAME}$", before):
        return [Completion(u, "unit", d.replace("_", " ")) for u, (d, _) in UNITS.items()]
    if re.search(r"\([^()]*$", before):
        return _named(text, task)
    known = [
        Completion(m.name, "action", f"{written(m)}: {m.about}") for m in known_actions().values()
    ]
    said = [Completion(w, "keyword", about) for w, about in WORDS.items()]
    stages = [Completion(f"<{s.name}>", "stage", str(s)) for s in task.stages]
    starts = [Completion(w, "keyword", "begins a statement") for w in STATEMENTS]
    if re.fullmatch(rf"\s*(?:{NAME})?", before):
        return [*starts, *known, *stages]
    return [*known, *stages, *said, *_named(text, task, ("zones", "parameters"))]


def _named(
    text: str, task: Task, kinds: tuple[str, ...] = ("actors", "zones", "parameters")
) -> list[Completion]:
    declared = {d.name: str(d) for k in kinds for d in getattr(task, k)}
    if "actors" in kinds:
        for word in _actors(text):
            declared.setdefault(word.name, "an actor")
    return [Completion(n, "actor", about) for n, about in sorted(declared.items())]


def _actors(text: str) -> list[NameUse]:
    """Names in brackets, in the position of actors."""
    code, _ = normalise(text, Source(text, ""))
    rows = code.split("\n")
    inside = (w for w in names(text) if w.kind == "name")
    return [
        w for w in inside if re.search(r"\([^()]*$", rows[w.span.line - 1][: w.span.column - 1])
    ]
