"""Text edits from hints: what an editor applies when the user accepts a hint, in either language."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from visup.agent.model.errors import SourceLocation
from visup.rules.correction.error_span import ErrorSpan, error_span
from visup.rules.language.diagnostics import Diagnostic, Source


@dataclass(frozen=True, slots=True)
class TextFix:
    """An edit of a text, on one line or over several.

    Attributes:
        line: Line where it starts, from 1.
        column: Column, from 1.
        length: Number of characters to replace, with line ends counted as one.
        new: The replacement.
    """

    line: int
    column: int
    length: int
    new: str

    def applied(self, text: str) -> str:
        """The edited text."""
        lines = text.split("\n")
        at = sum(len(x) + 1 for x in lines[: self.line - 1]) + self.column - 1
        return text[:at] + self.new + text[at + self.length :]


_IN_PLACE = re.compile(r"write `([^`]+)` in place of `([^`]+)`")
_PUT = re.compile(r"put `([^`]+)` here")
_OUT = re.compile(r"leave `([^`]+)` out")
_LINE = re.compile(r"add the line `([^`]+)`")
_WRITE = re.compile(r"write `([^`]+)`")
_MEANT = re.compile(r"did you mean [`']([^`']+)[`']\?")
_NAME = re.compile(r"[^\W\d]\w*")


def fix_of(text: str, where: SourceLocation, hint: str | None) -> TextFix | None:
    """The edit described by a hint, or None if it describes none.

    Args:
        text: The faulty text.
        where: Location of the fault.
        hint: The hint of the message.
    """
    if hint is None:
        return None
    rest = "\n".join([where.text[where.column - 1 :], *text.split("\n")[where.line :]])
    if m := _IN_PLACE.search(hint):
        pattern = r"\s+".join(map(re.escape, m[2].split()))
        pattern = rf"\b{pattern}\b" if m[2].isidentifier() else pattern
        if old := re.match(rf"\s*{pattern}", rest):
            return _replacing(where, old, m[1])
        elsewhere = _on_line(where, pattern, m[1]) or _further(where, pattern, rest, m[1])
        return elsewhere or _anywhere(text, pattern, m[1])
    if m := _LINE.search(hint):
        return _at_the_end(text, m[1])
    if m := _PUT.search(hint):
        spaced = m[1] if m[1] in ",:)]" else f" {m[1]} "
        return TextFix(where.line, where.column, 0, spaced)
    if m := _OUT.search(hint):
        word = rf"\b{re.escape(m[1])}\b" if m[1].isidentifier() else re.escape(m[1])
        found = re.search(rf"{word}\s*,\s*|,\s*{word}|{word}", rest)
        if found is None or found.start() > len(where.text) - where.column + 1:
            return _on_line(where, word, "")
        return _replacing(where, found, "")
    if m := _MEANT.search(hint):
        return _renamed(where, rest, m[1])
    if m := _WRITE.search(hint):
        return TextFix(where.line, where.column, where.length, m[1])
    return None


def _at_the_end(text: str, new: str) -> TextFix:
    """A line appended to the text."""
    lines = text.split("\n")
    new = f"{new}\n" if text.endswith("\n") else f"\n{new}"
    return TextFix(len(lines), len(lines[-1]) + 1, 0, new)


def _on_line(where: SourceLocation, pattern: str, new: str) -> TextFix | None:
    """Replace a match elsewhere on the line, nearest to the caret."""
    found = list(re.finditer(pattern, where.text))
    if not found:
        return None
    nearest = min(found, key=lambda m: abs(m.start() - where.column + 1))
    return TextFix(where.line, nearest.start() + 1, nearest.end() - nearest.start(), new)


def _further(where: SourceLocation, pattern: str, rest: str, new: str) -> TextFix | None:
    """Replace a match on a later line, such as in the sentence of a rule."""
    found = re.search(pattern, rest)
    return None if found is None else _replacing(where, found, new)


def _anywhere(text: str, pattern: str, new: str) -> TextFix | None:
    """Replace a match before the fault, such as in a declaration, if it is the only one."""
    found = list(re.finditer(pattern, text))
    if len(found) != 1:
        return None
    line, column = (
        text.count("\n", 0, found[0].start()) + 1,
        found[0].start() - text.rfind("\n", 0, found[0].start()),
    )
    return TextFix(line, column, len(found[0][0]), new)


def _replacing(where: SourceLocation, old: re.Match[str], new: str) -> TextFix:
    return TextFix(where.line, where.column + old.start(), old.end() - old.start(), new)


def _renamed(where: SourceLocation, rest: str, new: str) -> TextFix:
    """Replace the name at the caret; for a call only its name."""
    found = _NAME.match(rest) if _NAME.match(new) else None
    length = len(found[0]) if found and " " not in new else where.length
    return TextFix(where.line, where.column, length, new)


def pointing(text: str, fault: Diagnostic) -> Diagnostic:
    """The fault with its caret at what its hint changes, unless it is there already.

    Args:
        text: The faulty text.
        fault: A fault with a place in that text.
    """
    fix = fix_of(text, fault.place, fault.hint)
    if fix is None or fault.hint is None or _LINE.search(fault.hint):
        return fault
    begin = _offset(text, fix.line, fix.column)
    at = _offset(text, fault.place.line, fault.place.column)
    if fault.code >= "E2" and begin <= at < begin + fix.length and _names_its_caret(fault):
        return fault
    found = error_span(text, begin, begin + fix.length, fix.new)
    if found is None or _is_at(at, fault.place.length, found):
        return fault
    span = found.shown
    line, column = text.count("\n", 0, span[0]) + 1, span[0] - text.rfind("\n", 0, span[0])
    place = Source(text, fault.place.file).place(line, column, span[1] - span[0])
    old = " ".join(text[begin : begin + fix.length].split())
    in_full = _SAID.sub(lambda _: f"write `{fix.new.strip()}` in place of `{old}`", fault.hint)
    wanted = fix.applied(text)
    for hint in (fault.hint, in_full):
        moved = fix_of(text, place, hint)
        if moved is not None and moved.applied(text) == wanted:
            return replace(fault, place=place, hint=hint)
    return fault


def _names_its_caret(fault: Diagnostic) -> bool:
    """Whether a message of meaning is about exactly the word under its caret."""
    begin = fault.place.column - 1
    return f"`{fault.place.text[begin : begin + fault.place.length]}`" in fault.message


_SAID = re.compile(r"write `[^`]+`(?: in place of `[^`]+`)?|did you mean [`'][^`']+[`']\?")


LITTLE_MORE, LONG = 8, 30
"""Characters that a caret may cover beside the culprit; and in all, if something is missing after its end."""


def _is_at(begin: int, length: int, found: ErrorSpan) -> bool:
    """Whether a caret covers something of the culprit, and little else."""
    first, last = found.shown
    at = any(start < begin + length and begin < end for start, end in found.words)
    after_bracket = last - first == 1 and begin + length == last and length <= LONG
    return at and (length <= last - first + LITTLE_MORE or after_bracket)


def _offset(text: str, line: int, column: int) -> int:
    return sum(len(row) + 1 for row in text.split("\n")[: line - 1]) + column - 1
