"""Editor support for rules files: mistakes and completions."""

from __future__ import annotations

from collections.abc import Iterator

from visup.agent.model.errors import ErrorGroup, RuleError, SourceLocation, VisupError
from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.keywords import FUNCTIONS, KEYWORDS
from visup.rules.language.parser import parse_rules
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES
from visup.tasks.tools.editing import Completion


def rule_faults(text: str, file: str) -> list[Diagnostic]:
    """The mistakes of a rules file.

    Args:
        text: The file.
        file: Its name, for messages.
    """
    try:
        parse_rules(text, file)
    except ErrorGroup as group:
        return [_as_diagnostic(e) for e in group.errors]
    except RuleError as error:
        return [_as_diagnostic(error)]
    return []


def _as_diagnostic(error: VisupError) -> Diagnostic:
    where = error.where
    place = where if isinstance(where, SourceLocation) else SourceLocation(str(where or ""), 1, 1)
    return Diagnostic(error.code or "", error.what, place, error.expected, error.hint)


def rule_completions() -> Iterator[Completion]:
    """Every word of the rule language with its meaning."""
    for vocabulary in (PREDICATES, QUANTITIES):
        for name, word in vocabulary.items():
            yield Completion(name, "action", f"{', '.join(word.argument_kinds)}: {word.meaning}")
    for kind, entries in (("action", FUNCTIONS), ("keyword", KEYWORDS)):
        for name in sorted(entries):
            yield Completion(name, kind, ": ".join(entries[name]))
