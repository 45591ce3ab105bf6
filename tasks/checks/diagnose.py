"""Diagnoses a task file: all mistakes of characters, syntax and semantics at once."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Set as AnySet
from functools import cache, partial

from visup.rules.language.diagnostics import Diagnostic, Source
from visup.rules.language.fixes import pointing
from visup.tasks.actions.actions import ALL_PERCEPTS, ActionDefinition, known_actions
from visup.tasks.checks.bounds import MAX_FAULTS, text_fault
from visup.tasks.checks.files import include_root, read_beside
from visup.tasks.checks.repairs import with_tested_hints
from visup.tasks.checks.semantics import check_semantics
from visup.tasks.diagnostics.includes import Read, join_included
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.diagnostics.recovery import parse
from visup.tasks.grammar.nodes import Task

FOREIGN_LANGUAGE_CODES = ("E121", "E127")  # text in another language is not checked for characters


def diagnose(
    text: str,
    file: str = "<text>",
    actions: Mapping[str, ActionDefinition] | None = None,
    percepts: AnySet[str] = ALL_PERCEPTS,
    read: Read | None = None,
) -> tuple[Task, list[Diagnostic]]:
    """Parse and check a text.

    Args:
        text: A task file.
        file: Its name, for messages; includes are relative to it.
        actions: The available actions; None for all known ones.
        percepts: The available kinds of percept.
        read: Reads included files; by default from the folder of this file and not outside it.

    Returns:
        The parsed tree with includes, and the first hundred faults in the order of the text, those of
        included files last; the tree is valid only without faults.
    """
    task, faults = _sorted_faults(text, file, actions, percepts, read)
    if not faults:
        return task, faults

    @cache  # several hints lead to the same text
    def check(changed: str) -> list[Diagnostic]:
        return _sorted_faults(changed, file, actions, percepts, read)[1]

    hinted = with_tested_hints(text, faults, check)
    return task, [pointing(text, f) if f.place.file == file else f for f in hinted]


def _sorted_faults(
    text: str,
    file: str,
    actions: Mapping[str, ActionDefinition] | None,
    percepts: AnySet[str],
    read: Read | None,
) -> tuple[Task, list[Diagnostic]]:
    """The tree and its ordered faults with the hints of their checks."""
    source = Source(text, file)
    if (fault := text_fault(text, source)) is not None:
        return Task(()), [fault]
    try:
        task, faults = _parsed_and_checked(text, source, actions, percepts, read)
    except RecursionError:
        what = "things are nested too deeply"
        return Task(()), [Diagnostic("E128", what, source.place(1, 1))]
    order = {name: i for i, name in enumerate((file, *source.included))}
    return task, sorted(faults, key=lambda f: _order(f, order))[:MAX_FAULTS]


def _parsed_and_checked(
    text: str,
    source: Source,
    actions: Mapping[str, ActionDefinition] | None,
    percepts: AnySet[str],
    read: Read | None,
) -> tuple[Task, list[Diagnostic]]:
    cleaned, odd_characters = normalise(text, source)
    read_default = partial(read_beside, root=include_root(source.file))
    parsed = join_included(parse(cleaned, source), source, read or read_default)
    foreign = {f.place.line for f in parsed.faults if f.code in FOREIGN_LANGUAGE_CODES}
    odd_characters = [f for f in odd_characters if f.place.line not in foreign]
    known = known_actions() if actions is None else actions
    faults = [*odd_characters, *parsed.faults, *check_semantics(parsed, source, known, percepts)]
    if not faults and not any(not s.span.file for s in parsed.task.stages):
        expected = "a rule such as `<dock> ::= converging(arm, satellite)`"
        faults = [Diagnostic("E129", "there is no rule", source.place(1, 1), expected=expected)]
    return parsed.task, faults


def _order(fault: Diagnostic, files: Mapping[str, int]) -> tuple[int, int, int, str]:
    place = fault.place
    return files.get(place.file, 0), place.line, place.column, fault.code
