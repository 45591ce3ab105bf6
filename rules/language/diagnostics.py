"""Diagnostics of rule and task files: errors with locations, and their conversion to exceptions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import lru_cache

from visup.agent.model.errors import ErrorGroup, SourceLocation, VisupError
from visup.rules.formula.units import NOWHERE, Span


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """An error in a file.

    Attributes:
        code: A stable code; empty in a language without codes.
        message: What is wrong, one clause.
        place: Its location.
        expected: What was expected instead.
        hint: How to correct it.
    """

    code: str
    message: str
    place: SourceLocation
    expected: str | None = None
    hint: str | None = None

    def error(self, kind: type[VisupError]) -> VisupError:
        """The exception for it."""
        what = f"[{self.code}] {self.message}" if self.code else self.message
        error = kind(what, where=self.place, expected=self.expected, hint=self.hint)
        error.code = self.code or None
        return error

    def __str__(self) -> str:
        """The message with the line and a caret under the error."""
        return str(self.error(VisupError))


def raise_all(diagnostics: Sequence[Diagnostic], kind: type[VisupError]) -> None:
    """Raise diagnostics, if any; see `raise_errors`."""
    raise_errors([d.error(kind) for d in diagnostics])


def raise_errors(errors: Sequence[VisupError]) -> None:
    """Raise errors, if any.

    Raises:
        VisupError: The error, when there is one.
        ErrorGroup: All of them, when there are several.
    """
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise ErrorGroup(list(errors))


class Source:
    """The lines of a file, to locate errors.

    Args:
        text: The whole text, as written by the user.
        file: Its name, for messages.

    Attributes:
        included: Included files, by name.
    """

    def __init__(self, text: str, file: str) -> None:
        self.file = file
        self.included: dict[str, Source] = {}
        self._lines = text.split("\n")

    def place(self, line: int, column: int, length: int = 1) -> SourceLocation:
        """The location at a line and column, counted from 1, clamped to the end."""
        if line > len(self._lines) or line < 1:
            line = len(self._lines)
            column = len(self._line(line)) + 1
        text = self._line(line)
        column = max(1, min(column, len(text) + 1))
        return SourceLocation(
            self.file, line, column, text, max(1, min(length, len(text) - column + 1))
        )

    def at(self, span: Span) -> SourceLocation:
        """The location of a node; for several lines, its part on the first."""
        if span == NOWHERE:
            return self.place(1, 1)
        if span.file:
            return self.included[span.file].at(replace(span, file=""))
        one_line = span.end_line == span.line
        return self.place(span.line, span.column, span.length if one_line else 10_000)

    def fault(
        self,
        code: str,
        what: str,
        span: Span,
        expected: str | None = None,
        hint: str | None = None,
    ) -> Diagnostic:
        """A diagnostic at the location of a node."""
        return Diagnostic(code, what, self.at(span), expected, hint)

    def _line(self, line: int) -> str:
        return self._lines[line - 1].rstrip("\r")


def either(words: Iterable[str]) -> str:
    """Words as alternatives: `a`, `a or b`, `a, b or c`."""
    *first, last = words
    return f"{', '.join(first)} or {last}" if first else last


def nearest(word: str, known: Iterable[str]) -> str:
    """All known words if few, else those spelt most similarly."""
    return _nearest_of(word, tuple(known))


@lru_cache(maxsize=4096)  # each tried edit repeats all errors of its file
def _nearest_of(word: str, names: tuple[str, ...]) -> str:
    if len(names) <= MAX_LISTED:
        return listed(names)
    near = get_close_matches(word, names, n=MAX_LISTED, cutoff=0.0)
    return f"{listed(near)}, or one of {len(names) - len(near)} more (docs/rules.md)"


MAX_LISTED = 8
"""Most words in a list."""


def listed(words: Iterable[str]) -> str:
    """Words as a list to choose from."""
    names = list(words)
    return "one of " + ", ".join(names) if len(names) > 1 else "".join(names) or "nothing"
