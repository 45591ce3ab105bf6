"""Checks a text edited in the page: mistakes, meaning, and completions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from visup.agent import Zone
from visup.agent.model.errors import ErrorGroup, TaskError, VisupError
from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.parser import parse_rules
from visup.runs.inputs.zones import read_zones
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.grammar.structure import tasks_of
from visup.tasks.tools.editing import Completion, completions
from visup.tasks.tools.outline import Branch, outline
from visup.tasks.tools.rule_editing import rule_completions, rule_faults

MAX_DRAFT_LENGTH = 100_000
DRAFT_NAME = "the text"
"""Its name in messages."""


class DraftKind(StrEnum):
    """Kind of text."""

    TASK = "task"
    RULES = "rules"
    ZONES = "zones"


@dataclass(frozen=True, slots=True)
class DraftFault:
    """A mistake.

    Attributes:
        line: Line, from 1; 0 for the whole text.
        text: The mistake, what was expected, and how to correct it.
    """

    line: int
    text: str


@dataclass(frozen=True, slots=True)
class DraftCheck:
    """The result of a check.

    Attributes:
        faults: Mistakes in order.
        tree: Meaning of a text without mistakes.
        zones: Its zones.
    """

    faults: tuple[DraftFault, ...] = ()
    tree: tuple[Branch, ...] = ()
    zones: tuple[Zone, ...] = ()


def check_draft(kind: DraftKind, text: str) -> DraftCheck:
    """Check a text; an empty one has neither mistakes nor meaning.

    Args:
        kind: Kind of text.
        text: The text; includes are refused, since it comes from a page.
    """
    if not text.strip():
        return DraftCheck()
    if len(text) > MAX_DRAFT_LENGTH:
        return DraftCheck((DraftFault(0, f"it is too long: at most {MAX_DRAFT_LENGTH} letters"),))
    if kind is DraftKind.TASK:
        return _task(text)
    return _rules(text) if kind is DraftKind.RULES else _zones(text)


def _task(text: str) -> DraftCheck:
    task, faults = diagnose(text, DRAFT_NAME, read=_refuse_include)
    if faults:
        return DraftCheck(_located(faults))
    return DraftCheck(tree=tuple(outline(one) for one in tasks_of(task)))


def _refuse_include(path: str, including: str) -> tuple[str, str]:
    raise TaskError("what is written here cannot include another file", where=path[:80])


def _rules(text: str) -> DraftCheck:
    faults = rule_faults(text, DRAFT_NAME)
    if faults:
        return DraftCheck(_located(faults))
    rules = parse_rules(text, DRAFT_NAME)
    return DraftCheck(
        tree=tuple(Branch(r.name, "stage", inside=(Branch(str(r.when), "action"),)) for r in rules)
    )


def _zones(text: str) -> DraftCheck:
    try:
        zones = read_zones(text, DRAFT_NAME)
    except ErrorGroup as group:
        return DraftCheck(tuple(DraftFault(0, str(e)) for e in group.errors))
    except VisupError as fault:
        return DraftCheck((DraftFault(0, str(fault)),))
    tree = tuple(
        Branch(z.name, "stage", inside=(Branch(f"{len(z.polygon)} corners", "words"),))
        for z in zones
    )
    return DraftCheck(tree=tree, zones=zones)


def _located(faults: Sequence[Diagnostic]) -> tuple[DraftFault, ...]:
    return tuple(DraftFault(f.place.line, _message(f)) for f in faults)


def _message(fault: Diagnostic) -> str:
    expected = f"; expected: {fault.expected}" if fault.expected else ""
    hint = f"; {fault.hint}" if fault.hint else ""
    return f"{fault.message}{expected}{hint}"


def completions_at(kind: DraftKind, text: str, caret: int) -> list[Completion]:
    """Completions at a position.

    Args:
        kind: Kind of text.
        text: The text.
        caret: Offset of the caret in characters.
    """
    if kind is DraftKind.ZONES or len(text) > MAX_DRAFT_LENGTH:
        return []
    before = text[: max(0, caret)]
    line, column = before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1
    prefix = completion_prefix(before)
    found = (
        completions(text, DRAFT_NAME, line, column)
        if kind is DraftKind.TASK
        else list(rule_completions())
    )
    return [c for c in found if c.text.strip("<>").startswith(prefix.strip("<>"))]


def completion_prefix(before: str) -> str:
    """The unfinished word at the end of a text."""
    length = 0
    while length < len(before) and (before[-1 - length].isalnum() or before[-1 - length] == "_"):
        length += 1
    return before[len(before) - length :]
