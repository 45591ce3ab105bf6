"""References to the names of one rule: its variables, those of `exists` and `forall`, values of `let`."""

from __future__ import annotations

import re

from visup.rules.formula.units import Span
from visup.rules.language.keywords import FUNCTIONS, KEYWORDS
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES
from visup.tasks.tools.editing import NameUse

_RULE_START = re.compile(r"^[ \t]*rule\b", re.MULTILINE)
_IGNORED = re.compile(r"#[^\n]*|(?<=\")[^\"\n]*(?=\")")
_PLACEHOLDER = re.compile(r"\{\w+\}")
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?!\w|\s*\()")
_HEAD = re.compile(r"\s*rule\s+\w+\s*\(([^()]*)\)")
_BOUND = re.compile(r"\b(?:let|exists|forall)\s+(\w+)")


def rule_references(text: str, word: NameUse) -> list[NameUse]:
    """All references to the same variable or value as a word of a rule; none if it is unbound.

    Args:
        text: The text of a rule file.
        word: A name in it.
    """
    begin, rule = _rule_around(text, word.span)
    if word.name not in _bound(rule):
        return []
    first = text.count("\n", 0, begin)
    return [
        NameUse(word.name, "name", _span(rule, m.start(), m.end(), first))
        for m in _NAME.finditer(rule)
        if m[0] == word.name
    ]


def rule_rename_refusal(text: str, word: NameUse, new: str) -> str | None:
    """Why a name of a rule cannot be renamed, or None if it can."""
    if re.fullmatch(r"[A-Za-z_]\w*", new) is None or new == "is":
        return f"`{new}` is no name: letters, digits and `_`, beginning with a letter"
    reserved = {**KEYWORDS, **FUNCTIONS, **PREDICATES, **QUANTITIES}
    if new in reserved:
        return f"`{new}` is a word of the language"
    _, rule = _rule_around(text, word.span)
    if any(m[0] == new for m in _NAME.finditer(rule)):
        return f"there is something called `{new}` in this rule already"
    return None


def _rule_around(text: str, span: Span) -> tuple[int, str]:
    """Offset and text of the rule around a span, with everything but names blanked."""
    offset = sum(len(line) + 1 for line in text.split("\n")[: span.line - 1]) + span.column - 1
    starts = [m.start() for m in _RULE_START.finditer(text)]
    begin = max((s for s in starts if s <= offset), default=0)
    end = min((s for s in starts if s > offset), default=len(text))
    return begin, _IGNORED.sub(lambda m: _blank(m[0]), text[begin:end])


def _blank(ignored: str) -> str:
    """Blanks for a comment, or for a message except the names in it."""
    if ignored.startswith("#"):
        return " " * len(ignored)
    blanked = [" "] * len(ignored)
    for m in _PLACEHOLDER.finditer(ignored):
        blanked[m.start() : m.end()] = m[0]
    return "".join(blanked)


def _bound(rule: str) -> set[str]:
    head = _HEAD.match(rule)
    variables = re.findall(r"\w+", re.sub(r"\bmay\s+repeat\b", "", head[1])) if head else []
    return {*variables, *_BOUND.findall(rule)}


def _span(rule: str, begin: int, end: int, first: int) -> Span:
    line = first + rule.count("\n", 0, begin) + 1
    column = begin - rule.rfind("\n", 0, begin)
    return Span(line, column, line, column + end - begin)
