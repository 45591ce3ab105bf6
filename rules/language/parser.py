"""Parser of rule files, which reports all errors of a file at once."""

from __future__ import annotations

import re
from functools import cache, partial
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import cast

from visup.agent.model.errors import RuleError
from visup.agent.storage.text_file import read_text_file
from visup.rules.formula.nodes import Formula, Rule
from visup.rules.language.diagnostics import Diagnostic, raise_all
from visup.rules.language.error_recovery import (
    RepairBudget,
    read_repaired,
    weight,
    with_tried_edits,
)
from visup.rules.language.fixes import pointing
from visup.rules.language.typecheck import TypeChecker
from visup.rules.predicates.definitions import Vocabulary
from visup.rules.predicates.vocabulary import RULES

_HEAD = re.compile(r"^[ \t]*rule\b", re.MULTILINE)


def parse_rules(text: str, file: str = "<rules>") -> tuple[Rule, ...]:
    """Read rules from text.

    Args:
        text: A whole rule file.
        file: Its name, for messages.

    Returns:
        The rules in the order of the text; `parse_rules(str(rule)) == (rule,)`.

    Raises:
        RuleError: The text has one error; the message has its location, what was expected and a fix.
        ManyErrors: It has several; each rule is parsed separately, so that a syntax error in one rule
            hides no errors of others.
    """
    check_length(text, file)
    try:
        return _parsed(text, file)
    except RecursionError:
        raise RuleError("things are nested too deeply", where=file) from None


def _parsed(text: str, file: str) -> tuple[Rule, ...]:
    errors: list[Diagnostic] = []
    rules: list[Rule] = []
    budget = RepairBudget()
    for block in _blocks(text):
        found = read_repaired(block, "start", file, RULES, budget)
        diagnostics = found.diagnostics(text)
        errors += with_tried_edits(
            block, diagnostics, partial(weight, file=file, budget=budget), len(found.syntax)
        )
        rules += found.tree
    errors += TypeChecker(text, file).twice(rules)
    errors = [pointing(text, error) for error in errors]
    raise_all(sorted(errors, key=_position)[:MAX_FAULTS], RuleError)
    return tuple(rules)


LONGEST_FILE = 200_000
"""Most characters in a rule file, twenty times the one that ships."""
LONG_NUMBER = re.compile(r"[\d_]{41}|\d[eE]\+?\d{3}")
"""Numbers that would become infinite or lose digits."""
LONGEST_RULE = 10_000
MAX_RULES = 1_000
MAX_FAULTS = 100
"""Most errors reported of a file."""


def check_length(text: str, file: str) -> None:
    """Reject a text that would take long to parse.

    Raises:
        RuleError: It, or one of its rules, is too long.
    """
    if len(text) > LONGEST_FILE:
        what = f"the file has {len(text)} characters"
        raise RuleError(what, where=file, expected=f"at most {LONGEST_FILE}")
    if LONG_NUMBER.search(text):
        raise RuleError(
            "a number has more digits than a number can", where=file, expected="at most 40 digits"
        )
    starts = [m.start() for m in _HEAD.finditer(text)]
    if len(starts) > MAX_RULES:
        what = f"the file has {len(starts)} rules"
        raise RuleError(what, where=file, expected=f"at most {MAX_RULES}")
    longest = max(b - a for a, b in pairwise([0, *starts, len(text)]))
    if longest > LONGEST_RULE:
        what = f"a rule has {longest} characters"
        raise RuleError(what, where=file, expected=f"at most {LONGEST_RULE}")


def parse_formula(text: str, vocabulary: Vocabulary = RULES) -> Formula:
    """Parse one formula without object variables, such as one over signals.

    Args:
        text: The formula.
        vocabulary: The names it may use.

    Returns:
        Its tree.

    Raises:
        RuleError: It has one error.
        ManyErrors: It has several.
    """
    file = "<formula>"
    check_length(text, file)
    try:
        return _formula(text, file, vocabulary)
    except RecursionError:
        raise RuleError("things are nested too deeply", where=file) from None


def _formula(text: str, file: str, vocabulary: Vocabulary) -> Formula:
    found = read_repaired(text, "formula", file, vocabulary, RepairBudget())
    errors = [pointing(text, error) for error in found.diagnostics(text)]
    raise_all(sorted(errors, key=_position), RuleError)
    return cast("Formula", found.tree)


def load_rules(path: str | Path) -> tuple[Rule, ...]:
    """Read a rule file.

    Args:
        path: A text file in UTF-8.

    Returns:
        Its rules.

    Raises:
        RuleError: It cannot be read or has an error.
        ManyErrors: It has several errors.
    """
    try:
        text = read_text_file(Path(path))
    except UnicodeDecodeError:
        raise RuleError("this is not text", where=str(path), expected="UTF-8") from None
    except OSError as fault:
        what = f"the rule file cannot be read: {fault.strerror or fault}"
        raise RuleError(what, where=str(path), hint="check the path") from None
    return parse_rules(text, str(path))


@cache
def shipped_rules() -> tuple[Rule, ...]:
    """The rules of `safety.rules`, which ships with visup; read once per process."""
    text = files("visup.rules.safety").joinpath("safety.rules").read_text(encoding="utf-8")
    return parse_rules(text, "safety.rules")


def _blocks(text: str) -> list[str]:
    """The text of each rule, preceded by blank lines so that line numbers are preserved."""
    starts = [m.start() for m in _HEAD.finditer(text)]
    if not starts or text[: starts[0]].strip():
        starts = [0, *starts]
    ends = [*starts[1:], len(text)]
    return ["\n" * text.count("\n", 0, s) + text[s:e] for s, e in zip(starts, ends, strict=True)]


def _position(found: Diagnostic) -> tuple[int, int]:
    return found.place.line, found.place.column
