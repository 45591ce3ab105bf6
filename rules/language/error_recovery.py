"""Parsing with error recovery: one error hides no others, and every hint has been verified."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib.resources import files
from math import inf
from typing import Any

from lark import Lark, UnexpectedInput
from lark.parsers.lalr_parser_state import ParseConf

from visup.agent.model.errors import SourceLocation
from visup.rules.correction.local_edits import Repair, edits, hint_of, offset_before
from visup.rules.correction.meaning_loss import COMMON_FIX_BONUS, SMALL_LOSS, meaning_lost
from visup.rules.correction.repair_search import least_cost_repairs
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.rules.language.edit_costs import edit_costs
from visup.rules.language.fixes import TextFix, fix_of
from visup.rules.language.keywords import expected_words, near_word
from visup.rules.language.repair import (
    MAX_COMPARED,
    MAX_REPAIRS,
    WORDS,
    common_fixes,
    end_before,
    find_repair,
    place_of,
)
from visup.rules.language.transform import read_tree
from visup.rules.language.typecheck import TypeChecker
from visup.rules.predicates.definitions import Vocabulary
from visup.rules.predicates.vocabulary import RULES

CHARACTERS_TRIED = 200_000
"""Characters parsed to find repairs of one file; errors beyond this budget get no hints."""
TEXTS_KEPT = 8  # last texts whose trees are kept: the chosen repair of a text is parsed again


@dataclass
class RepairBudget:
    """The remaining budget for repairs of a file; counted work, so that messages are reproducible.

    Attributes:
        left: Characters that may still be parsed.
    """

    left: int = CHARACTERS_TRIED

    def spend(self, text: str, start: str) -> UnexpectedInput | None:
        """The syntax error of a text, or None; once the budget is spent every text counts as faulty."""
        self.left -= len(text)
        if self.left < 0:
            return _syntax_fault("", "formula")
        return _syntax_fault(text, start)

    def least_cost_repairs(self, text: str, start: str, since: int) -> Iterator[Repair]:
        """Least-cost corrections of a text from an offset on, while the budget lasts."""
        least = max(0, self.left - MAX_READINGS * READING_COST)

        def may_go_on() -> bool:
            self.left -= READING_COST
            return self.left > least

        yield from least_cost_repairs(text, since, edit_costs(_parser(), start, text), may_go_on)


MAX_READINGS = 4000
"""Most parser configurations explored in a search for corrections."""
READING_COST = 5
"""Cost of one configuration, in parsed characters."""


def grammar() -> str:
    """The text of `rules.lark`."""
    return files("visup.rules.language").joinpath("rules.lark").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def _parser() -> Lark:
    starts = ["start", "formula"]
    return Lark(
        grammar(), start=starts, parser="lalr", propagate_positions=True, maybe_placeholders=True
    )


@dataclass
class RepairedText:
    """A parsed rule or formula, possibly after repairs.

    Attributes:
        tree: Rules, or a formula; empty when it could not be parsed.
        file: Its name.
        text: The text after all repairs.
        repairs: In the order in which they were made, each relative to the text left by earlier ones.
        faults: Other errors, located in the repaired text.
        syntax: The syntax error at each repair, and the final one.
    """

    tree: Any
    file: str
    text: str
    repairs: list[Repair]
    faults: Sequence[Diagnostic]
    syntax: list[Diagnostic]

    def diagnostics(self, whole: str) -> list[Diagnostic]:
        """All diagnostics, located in the original text."""
        source = Source(whole, self.file)
        return [*self.syntax, *(self._placed(f, source) for f in self.faults)]

    def _placed(self, fault: Diagnostic, source: Source) -> Diagnostic:
        if not self.repairs:
            return fault
        lines = self.text.split("\n")
        at = sum(len(x) + 1 for x in lines[: fault.place.line - 1]) + fault.place.column - 1
        begin = offset_before(at, self.repairs)
        end = offset_before(at + fault.place.length, self.repairs)
        line, column = _line_of(self._original(), begin)
        return replace(fault, place=source.place(line, column, max(1, end - begin)))

    def _original(self) -> str:
        text = self.text
        for repair in reversed(self.repairs):
            text = text[: repair.begin] + repair.old + text[repair.begin + len(repair.new) :]
        return text


def read_repaired(
    block: str, start: str, file: str, vocabulary: Vocabulary, budget: RepairBudget
) -> RepairedText:
    """Parse a rule or a formula; errors are reported and repaired, and parsing continues.

    Args:
        block: The text.
        start: Start symbol: 'start' for rules, or 'formula'.
        file: Its name, for messages.
        vocabulary: The names it may use.
        budget: The budget for repairs.
    """
    text, repairs, syntax = block, list[Repair](), list[Diagnostic]()
    while True:
        # Most texts have no error: they are parsed only once.
        with suppress(UnexpectedInput):
            found, diagnostics = _semantic(text, start, file, vocabulary)
            return RepairedText(found, file, text, repairs, diagnostics, syntax)
        fault = _syntax_fault(text, start)
        assert fault is not None
        repair = None
        if len(repairs) < MAX_REPAIRS and budget.left >= 0:
            repair = find_repair(
                text,
                fault,
                lambda t: budget.spend(t, start),
                lambda t: not _semantic(t, start, file, vocabulary)[1],
                partial(budget.least_cost_repairs, text, start),
            )
        syntax.append(_syntax_error(fault, _Place(block, text, tuple(repairs), file), repair))
        if repair is None:
            return RepairedText([], file, text, repairs, [], syntax)
        repairs.append(repair)
        text = repair.applied(text)


@lru_cache(maxsize=TEXTS_KEPT)
def _semantic(
    text: str, start: str, file: str, vocabulary: Vocabulary
) -> tuple[Any, Sequence[Diagnostic]]:
    """The tree of a text without syntax errors, and its semantic errors."""
    found, faults = read_tree(_parser().parse(text, start=start), file)
    checker = TypeChecker(text, file, vocabulary)
    diagnostics = tuple(checker.fault(*f) for f in faults)
    return found, diagnostics or tuple(_checked(checker, found))


def _checked(checker: TypeChecker, found: Any) -> Iterator[Diagnostic]:
    if isinstance(found, list):
        for rule in found:
            yield from checker.rule(rule)
    else:
        yield from checker.formula(found)


def _syntax_fault(text: str, start: str) -> UnexpectedInput | None:
    reading = _parser().parse_interactive(text, start=start)
    state = reading.parser_state
    state.parse_conf = _without_tree(state.parse_conf)
    try:
        reading.parser.parse_from_state(state)
    except UnexpectedInput as fault:
        return fault
    return None


def _without_tree(conf: ParseConf[Any]) -> ParseConf[Any]:
    """A parser that only checks: building trees is most of the work, and repairs try many texts."""
    found = copy(conf)
    found.callbacks = {}
    return found


def _line_of(text: str, at: int) -> tuple[int, int]:
    """Line and column of an offset, counted from 1."""
    return text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)


Weight = tuple[int, int]
"""Badness of a text: 1 and its unparsed length, or 0 and its number of semantic errors."""
OUT_OF_BUDGET: Weight = (2, 0)
SOUND: Weight = (0, 0)


def weight(text: str, file: str, budget: RepairBudget) -> Weight:
    """Badness of a rule's text; the worst once the budget is spent."""
    budget.left -= len(text)
    if budget.left < 0:
        return OUT_OF_BUDGET
    try:
        return 0, len(_semantic(text, "start", file, RULES)[1])
    except UnexpectedInput as fault:
        return 1, len(text) - place_of(text, fault)[0]


def with_tried_edits(
    block: str, faults: Sequence[Diagnostic], weigh: Callable[[str], Weight], unread: int = 0
) -> list[Diagnostic]:
    """The errors of a rule; those without an applicable hint get a small edit that helps, if there is one.

    Args:
        block: The rule, its lines numbered as in the file.
        faults: Its errors.
        weigh: Badness of a text.
        unread: Number of leading errors that are syntax errors; while there are any, no edits are
            sought for the others, which may follow from them.
    """
    diagnostics = list(faults)
    if not diagnostics:
        return diagnostics
    before = weigh(block)
    if before == OUT_OF_BUDGET:
        return diagnostics
    with suppress(_OutOfBudgetError):
        for n, fault in enumerate(faults[: unread or None]):
            diagnostics[n] = _with_edit(block, fault, before, weigh)
    return diagnostics


class _OutOfBudgetError(Exception):
    """The budget is spent: a search for further edits would be slow and in vain."""


def _with_edit(
    block: str, fault: Diagnostic, before: Weight, weigh: Callable[[str], Weight]
) -> Diagnostic:
    def tried(fix: TextFix) -> Weight:
        found = weigh(fix.applied(block))
        if found == OUT_OF_BUDGET:
            raise _OutOfBudgetError
        return found

    place = fault.place
    own = fix_of(block, place, fault.hint)
    helps = None if own is None else tried(own)
    if helps is not None and (helps[0] == 0 or helps <= before):
        return fault
    line, begin, length = place.text, place.column - 1, place.length
    known = ((repair, COMMON_FIX_BONUS) for repair in common_fixes(line, begin, length))
    others = ((repair, 0.0) for repair in edits(line, begin, length, EDIT_WORDS))
    best, least, fewest = None, (before, inf), MAX_COMPARED
    for repair, granted in (*known, *others):
        hint = hint_of(place.text, repair)
        fix = None if hint is None else fix_of(block, place, hint)
        found = before if fix is None else tried(fix)
        if fix is None or found >= before:
            continue
        lost = meaning_lost(block, fix.applied(block)) - granted
        best, least = min((best, least), (hint, (found, lost)), key=lambda tried: tried[1])
        fewest -= found == SOUND or before[0] == 0
        if fewest == 0 or (least[1] <= SMALL_LOSS and (found == SOUND or before[0] == 0)):
            break
    if best is None:
        return fault
    return replace(fault, hint=best if fault.hint is None or own else f"{fault.hint}; {best}")


EDIT_WORDS = (*RULES.quantities, *RULES.predicates, *WORDS)


@dataclass(frozen=True, slots=True)
class _Place:
    """Location of a syntax error: the original text, the text repaired so far, the repairs, the file."""

    written: str
    text: str
    repairs: tuple[Repair, ...]
    file: str

    def at(self, begin: int, length: int) -> SourceLocation:
        """The location of some characters of the repaired text."""
        line, column = _line_of(self.written, offset_before(begin, self.repairs))
        return Source(self.written, self.file).place(line, column, max(1, length))


def _syntax_error(fault: UnexpectedInput, where: _Place, repair: Repair | None) -> Diagnostic:
    at, length = place_of(where.text, fault)
    found = where.text[at : at + length]
    wanted = getattr(fault, "accepts", None) or getattr(fault, "expected", None)
    wanted = wanted or getattr(fault, "allowed", set()) or set()
    if "COMMA" in wanted and _NAME_IN_CALL.search(where.text[:at]):
        # Arithmetic would need the name of a value, but none is bound.
        wanted = {"COMMA", "RPAR"}
    what = f"'{found}' does not belong here" if found else "the rule ends too early"
    if repair is None:
        begin = at if found else end_before(where.text, len(where.text))
        hint = near_word(found, wanted)
        return Diagnostic("", what, where.at(begin, length), expected_words(wanted), hint)
    if repair.begin == repair.end and repair.begin < at:
        # For an insertion the caret marks where it goes, not the next word.
        what = f"{_put(repair.new)} is missing" if repair.new.strip() else what
    span = max(1, repair.end - repair.begin)
    hint = repair.hint(where.text)
    return Diagnostic("", what, where.at(repair.begin, span), expected_words(wanted), hint)


_NAME_IN_CALL = re.compile(r"\A(?![\s\S]*\blet\b)[\s\S]*[(,]\s*[A-Za-z_]\w*\s*\Z")
"""A text without `let` that ends with a bare name inside a call."""


def _put(new: str) -> str:
    return f"'{new.strip()}'"
