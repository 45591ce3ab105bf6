"""Corrections of several words that make a statement parse, worded as hints."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from visup.agent.model.errors import SourceLocation
from visup.rules.correction.edits import TOKEN, Repair
from visup.rules.correction.search import corrections
from visup.rules.language.diagnostics import Source
from visup.rules.language.fixes import fix_of
from visup.tasks.checks.spelling import speller
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.diagnostics.recovery import split
from visup.tasks.grammar.statement import StatementText

WIDENED, MOST_SAID = 6, 120
"""How often a change is widened by a word to be unambiguous, and its maximum length in characters."""
LONGEST = 1500
"""Maximum characters of a statement that is searched completely for the cause of an error."""


def corrected(text: str, place: SourceLocation, may_go_on: Callable[[], bool]) -> Iterator[str]:
    """Hints that make the statement at a position parse, smallest changes first.

    Args:
        text: The whole file.
        place: Position of the fault.
        may_go_on: Asked before each candidate is explored.

    Yields:
        Hints, including those that only delete words.
    """
    cleaned = normalise(text, Source(text, place.file))[0]
    tidy = _tidied(text, cleaned, place)
    if tidy is not None:
        hint = said(text, place, tidy)
        yield from () if hint is None else (hint,)
        return
    chunk = _statement(cleaned, place)
    if chunk is None or len(chunk.raw) > LONGEST:
        return
    begin = _offset(text, chunk.line, chunk.column)
    for repair in corrections(chunk.raw, 0, speller(cleaned), may_go_on):
        hint = said(text, place, Repair(repair.begin + begin, repair.end + begin, repair.new))
        if hint is not None:
            yield hint


def _tidied(text: str, cleaned: str, place: SourceLocation) -> Repair | None:
    """The line of a fault with look-alike characters replaced."""
    begin = _offset(text, place.line, 1)
    code = place.text.split("#")[0].rstrip()
    odd = [n for n, char in enumerate(code) if char != cleaned[begin + n]]
    if not odd:
        return None
    start = code.rfind(" ", 0, odd[0]) + 1
    end = code.find(" ", odd[-1])
    end = len(code) if end < 0 else end
    meant = re.sub(r"\s+", " ", cleaned[begin + start : begin + end])
    meant = re.sub(r"(?<=[(<]) | (?=[,)>])", "", meant).strip()
    return Repair(begin + start, begin + end, meant)


def _statement(text: str, place: SourceLocation) -> StatementText | None:
    """The statement at a position."""
    before = [c for c in split(text) if (c.line, c.column) <= (place.line, place.column)]
    return before[-1] if before else None


def _offset(text: str, line: int, column: int) -> int:
    return sum(len(row) + 1 for row in text.split("\n")[: line - 1]) + column - 1


def said(text: str, place: SourceLocation, repair: Repair) -> str | None:
    """A change as a hint; with surrounding words if it would be ambiguous."""
    wanted = repair.applied(text).split()
    for _ in range(WIDENED):
        old, new = " ".join(text[repair.begin : repair.end].split()), repair.new.strip()
        hint = f"write `{new}` in place of `{old}`" if new else f"leave `{old}` out"
        fix = fix_of(text, place, hint) if old and "`" not in old + new else None
        if fix is not None and fix.applied(text).split() == wanted:
            return hint
        wider = _wider(text, repair)
        if wider is None or len(old) > MOST_SAID:
            return None
        repair = wider
    return None


def _wider(text: str, repair: Repair) -> Repair | None:
    """The same change with the preceding word, or at the beginning of a line with the following one."""
    line = text.rfind("\n", 0, repair.begin) + 1
    before = list(TOKEN.finditer(text, line, repair.begin))
    if before:
        start = before[-1].start()
        kept = text[start : repair.begin]
        kept = kept if repair.new.strip() and repair.new[0] in ",)]:" else f"{kept.rstrip()} "
        return Repair(start, repair.end, kept + repair.new.lstrip())
    behind = TOKEN.search(text, repair.end)
    if behind is None or "\n" in text[repair.end : behind.start()] or "#" in behind[0]:
        return None
    return Repair(repair.begin, behind.end(), f"{repair.new.rstrip()} {behind[0]}".lstrip())
