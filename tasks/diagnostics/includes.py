"""`include`: inserts the statements of other files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import cast

from visup.agent.model.errors import LONGEST_QUOTE, TaskError
from visup.rules.formula.units import Span
from visup.rules.language.diagnostics import Source
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.diagnostics.recovery import ParsedFile, parse
from visup.tasks.grammar.conditions import Name
from visup.tasks.grammar.nodes import Include, Task

Read = Callable[[str, str], tuple[str, str]]
"""(path, including file) -> (name of the file, its text); raises TaskError."""


def join_included(parsed: ParsedFile, source: Source, read: Read) -> ParsedFile:
    """A file with the statements of its includes appended.

    Args:
        parsed: The file.
        source: For positions; included files are added to it.
        read: Reads files.

    Returns:
        The file without includes; each file is included once. The tasks of an included file become stages.
    """
    if not parsed.task.includes:
        return parsed
    return _Joiner(source, read).join(parsed, (source.file,))


DEEPEST = 30  # nesting of includes
MAX_FILES = 100
MAX_CHARACTERS = 600_000


@dataclass
class _Joiner:
    source: Source
    read: Read
    taken: set[str] = field(default_factory=set)
    room: int = MAX_CHARACTERS

    def join(self, parsed: ParsedFile, chain: tuple[str, ...]) -> ParsedFile:
        whole = replace(parsed, task=replace(parsed.task, includes=()))
        for include in parsed.task.includes:
            whole = _merged_files(whole, self.included(include, chain))
        return whole

    def included(self, include: Include, chain: tuple[str, ...]) -> ParsedFile:
        try:
            file, text = self.read(include.path, chain[-1])
        except TaskError as e:
            more = "..." if len(include.path) > LONGEST_QUOTE else ""
            what = f"`{include.path[:LONGEST_QUOTE]}{more}` cannot be included: {e.what}"
            return self.fault("E221", what, include, e.expected, e.hint)
        if file in chain or len(chain) > DEEPEST:
            circle = " includes ".join(
                f"`{f}`" for f in (*chain[chain.index(file) if file in chain else 0 :], file)
            )
            hint = "move what both need to a third file"
            return self.fault("E222", f"files include each other: {circle}", include, None, hint)
        if file in self.taken:
            return ParsedFile(Task(()))
        self.taken.add(file)
        self.room -= len(text)
        if self.room < 0 or len(self.taken) > MAX_FILES:
            what = "the included files are larger than a task may be"
            expected = f"at most {MAX_FILES} files, and {MAX_CHARACTERS} characters"
            return self.fault("E137", what, include, expected, None)
        source = self.source.included[file] = Source(text, file)
        code, odd = normalise(text, source)
        parsed = parse(code, source)
        task = _relocated(parsed.task, file)
        stages = tuple(replace(s, is_task=False) for s in task.stages)
        told = replace(parsed, task=replace(task, stages=stages), faults=(*odd, *parsed.faults))
        return self.join(told, (*chain, file))

    def fault(
        self, code: str, what: str, include: Include, expected: str | None, hint: str | None
    ) -> ParsedFile:
        return ParsedFile(Task(()), (self.source.fault(code, what, include.span, expected, hint),))


def _merged_files(one: ParsedFile, other: ParsedFile) -> ParsedFile:
    a, b = one.task, other.task
    task = replace(
        a,
        stages=(*a.stages, *b.stages),
        actors=(*a.actors, *b.actors),
        invariants=(*a.invariants, *b.invariants),
        zones=(*a.zones, *b.zones),
        parameters=(*a.parameters, *b.parameters),
        grounds=(*a.grounds, *b.grounds),
        bystanders=(*a.bystanders, *b.bystanders),
    )
    return ParsedFile(
        task, (*one.faults, *other.faults), one.defined | other.defined, one.used | other.used
    )


def _relocated(task: Task, file: str) -> Task:
    """The same tree with every span in an included file."""
    return cast("Task", _moved(task, file))


def _moved(node: object, file: str) -> object:
    if isinstance(node, Span):
        return replace(node, file=file)
    if isinstance(node, Name):
        return Name(node, replace(node.span, file=file))
    if isinstance(node, tuple):
        return tuple(_moved(n, file) for n in node)
    fields = getattr(node, "__dataclass_fields__", None)
    if fields is None:
        return node
    return replace(node, **{f: _moved(getattr(node, f), file) for f in fields})  # type: ignore[type-var]
