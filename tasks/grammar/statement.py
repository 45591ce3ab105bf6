"""A statement with a syntax error, and a mistake recognised in it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

NAME = r"[^\W\d]\w*"
PARAMETERS = r"(?:[ ]*\([\w ,]*\))?"
"""The actors of a stage that is said of any: `<mount(leg)>`."""
RESERVED_WORDS = (
    "actor", "is", "or", "never", "always", "during", "for", "within", "include", "parameter",
    "zone",
)  # fmt: skip
QUOTED = re.compile(r'"[^"\n]*"')


def blank_strings(text: str) -> str:
    """A text with the content of string literals blanked, so that it is not taken for code."""
    return QUOTED.sub(lambda m: " " * len(m[0]), text) if '"' in text else text


@dataclass(frozen=True, slots=True)
class StatementText:
    """A statement with a syntax error and its position in the file (counted from 1).

    Attributes:
        text: The statement with string literals blanked.
        line: Its line.
        column: Its column.
        raw: The original statement.
    """

    text: str
    line: int
    column: int
    raw: str = ""

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset in the statement."""
        row = self.text.count("\n", 0, offset)
        start = self.text.rfind("\n", 0, offset) + 1
        return self.line + row, offset - start + (self.column if row == 0 else 1)

    @property
    def end(self) -> tuple[int, int]:
        """Line and column just after its last character."""
        return self.position(len(self.text))


@dataclass(frozen=True, slots=True)
class RecognisedError:
    """A recognised mistake: offsets in the statement, and the message."""

    code: str
    start: int
    length: int
    what: str
    expected: str | None = None
    hint: str | None = None


ErrorPattern = Callable[[str], RecognisedError | None]
"""Finds a mistake in the text of a statement, or returns None."""
