"""From the text of a rule file to rules, with every fault of the file told at once."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import cast

from lark import Lark, UnexpectedCharacters, UnexpectedEOF, UnexpectedInput

from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import RuleError
from visup.agent.storage.text_file import read_text_file
from visup.rules.formula.nodes import Formula, Rule
from visup.rules.language.diagnostics import Diagnostic, Source, either, raise_all
from visup.rules.language.transform import read_tree
from visup.rules.language.typecheck import TypeChecker
from visup.rules.predicates.vocabulary import RULES, Vocabulary

_HEAD = re.compile(r"^[ \t]*rule\b", re.MULTILINE)
_WANTED = {
    "LPAR": "'('",
    "RPAR": "')'",
    "COLON": "':'",
    "COMMA": "','",
    "SEVERITY": "info, warning or critical",
    "NAME": "a name",
    "NUMBER": "a number",
    "UNIT": "a unit (ms, s, min, h, px, px/s, px/s2, %, deg, deg/s, /s)",
    "STRING": "a sentence in double quotes on one line",
    "OPERATOR": "<, <=, > or >=",
    "LSQB": "'['",
    "RSQB": "']'",
    "__ANON_0": "'..'",
    "PLUS": "'+'",
    "MINUS": "'-'",
    "TIMES": "'*'",
    "OVER": "'/'",
    "PAST": "'once', 'always'",
    "FUTURE": "'eventually', 'henceforth'",
    "QUANTIFIER": "'exists', 'forall'",
    "REPEAT": "'may repeat'",
    "$END": "the end of the file",
}


def parse_rules(text: str, file: str = "<rules>") -> tuple[Rule, ...]:
    """Read rules from text.

    Args:
        text: A whole rule file.
        file: Its name, for messages.

    Returns:
        The rules in the order of the text; `parse_rules(str(rule)) == (rule,)`.

    Raises:
        RuleError: The text has one fault; says where, what was expected and what to do.
        ManyErrors: It has several; each rule is read by itself, so that one syntax fault in a rule
            hides nothing of the others.
    """
    check_length(text, file)
    try:
        return _parsed(text, file)
    except RecursionError:
        raise RuleError("things stand inside one another too deep", where=file) from None


def _parsed(text: str, file: str) -> tuple[Rule, ...]:
    checker = TypeChecker(text, file)
    errors: list[Diagnostic] = []
    rules: list[Rule] = []
    sound: list[Rule] = []
    for block in _blocks(text):
        try:
            tree = _parser().parse(block, start="start")
        except UnexpectedInput as fault:
            errors.append(_syntax_error(fault, text, checker.source))
            continue
        found, faults = read_tree(tree, file)
        errors += [checker.fault(*f) for f in faults]
        rules += found
        sound += () if faults else found
    errors += [*checker.twice(rules), *(fault for rule in sound for fault in checker.rule(rule))]
    raise_all(sorted(errors, key=_position)[:MOST_FAULTS], RuleError)
    return tuple(rules)


LONGEST_FILE = 200_000
"""Characters of a rules file; that which ships has a twentieth of it."""
LONG_NUMBER = re.compile(r"[\d_]{41}|\d[eE]\+?\d{3}")
"""What would be read as infinity, or with other digits than it has."""
LONGEST_RULE = 10_000
MOST_RULES = 1_000
MOST_FAULTS = 100
"""Faults of a file that are told; who made more knows enough."""


def check_length(text: str, file: str) -> None:
    """Refuse a text that takes long to read.

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
    if len(starts) > MOST_RULES:
        what = f"the file has {len(starts)} rules"
        raise RuleError(what, where=file, expected=f"at most {MOST_RULES}")
    longest = max(b - a for a, b in pairwise([0, *starts, len(text)]))
    if longest > LONGEST_RULE:
        what = f"a rule has {longest} characters"
        raise RuleError(what, where=file, expected=f"at most {LONGEST_RULE}")


def parse_formula(text: str, vocabulary: Vocabulary = RULES) -> Formula:
    """Read one formula without object variables, such as one of signals.

    Args:
        text: The formula.
        vocabulary: What it may name.

    Returns:
        Its tree.

    Raises:
        RuleError: It has one fault.
        ManyErrors: It has several.
    """
    file = "<formula>"
    check_length(text, file)
    try:
        return _formula(text, file, vocabulary)
    except RecursionError:
        raise RuleError("things stand inside one another too deep", where=file) from None


def _formula(text: str, file: str, vocabulary: Vocabulary) -> Formula:
    try:
        tree = _parser().parse(text, start="formula")
    except UnexpectedInput as fault:
        raise _syntax_error(fault, text, Source(text, file)).error(RuleError) from None
    checker = TypeChecker(text, file, vocabulary)
    found, faults = read_tree(tree, file)
    errors = [checker.fault(*f) for f in faults] or list(checker.formula(found))
    raise_all(sorted(errors, key=_position), RuleError)
    return cast("Formula", found)


def load_rules(path: str | Path) -> tuple[Rule, ...]:
    """Read a rule file.

    Args:
        path: A text file in UTF-8.

    Returns:
        Its rules.

    Raises:
        RuleError: It cannot be read or has a fault.
        ManyErrors: It has several faults.
    """
    try:
        text = read_text_file(Path(path))
    except UnicodeDecodeError:
        raise RuleError("this is not text", where=str(path), expected="UTF-8") from None
    except OSError as fault:
        what = f"the rule file cannot be read: {fault.strerror or fault}"
        raise RuleError(what, where=str(path), hint="check the path") from None
    return parse_rules(text, str(path))


def shipped_rules() -> tuple[Rule, ...]:
    """The rules of `safety.rules`, which ships with visup."""
    text = files("visup.rules.safety").joinpath("safety.rules").read_text(encoding="utf-8")
    return parse_rules(text, "safety.rules")


@lru_cache(maxsize=1)
def _parser() -> Lark:
    grammar = files("visup.rules.language").joinpath("rules.lark").read_text(encoding="utf-8")
    starts = ["start", "formula"]
    return Lark(
        grammar, start=starts, parser="lalr", propagate_positions=True, maybe_placeholders=True
    )


def _blocks(text: str) -> list[str]:
    """The text of each rule by itself, each with the lines before it blank so that places hold."""
    starts = [m.start() for m in _HEAD.finditer(text)]
    if not starts or text[: starts[0]].strip():
        starts = [0, *starts]
    ends = [*starts[1:], len(text)]
    return ["\n" * text.count("\n", 0, s) + text[s:e] for s, e in zip(starts, ends, strict=True)]


def _position(found: Diagnostic) -> tuple[int, int]:
    return found.place.line, found.place.column


def _syntax_error(fault: UnexpectedInput, text: str, source: Source) -> Diagnostic:
    lines = text.splitlines() or [""]
    if isinstance(fault, UnexpectedEOF) or fault.line < 1:
        line, column, found = len(lines), len(lines[-1]) + 1, ""
    else:
        line, column = fault.line, fault.column
        token = getattr(fault, "token", None)
        found = "" if token is None or token.type == "$END" else str(token)
        if isinstance(fault, UnexpectedCharacters):
            found = lines[line - 1][column - 1 : column]
    if getattr(getattr(fault, "token", None), "type", "") == "$END":
        line, column = _end_before(lines, line)
    wanted = getattr(fault, "accepts", None) or getattr(fault, "expected", None)
    wanted = wanted or getattr(fault, "allowed", set()) or set()
    place = source.place(line, column, max(1, len(found)))
    what = f"'{found}' does not belong here" if found else "the rule ends too early"
    return Diagnostic("", what, place, _expected(wanted), _slip(found, wanted))


def _end_before(lines: list[str], line: int) -> tuple[int, int]:
    at = min(line, len(lines))
    while at > 1 and not lines[at - 1].split("#")[0].strip():
        at -= 1
    return at, len(lines[at - 1].split("#")[0].rstrip()) + 1


def _expected(wanted: set[str]) -> str:
    return either(sorted({_WANTED.get(w, f"'{w.lower()}'") for w in wanted}))


def _slip(found: str, wanted: set[str]) -> str | None:
    known = [w.lower() for w in wanted if w not in _WANTED]
    known += ["info", "warning", "critical"] if "SEVERITY" in wanted else []
    return did_you_mean(found, known) if found else None
