"""The exceptions of visup: one hierarchy, with messages for the user.

An error says what is wrong, where, what was expected and what to do. The command turns each into
one clear message and exit code 2; none of them is ever shown as a traceback.
"""

from __future__ import annotations

from dataclasses import dataclass

LONGEST_QUOTE = 200
"""Most characters of a faulty line to show, around the fault."""


@dataclass(frozen=True, slots=True)
class SourceLocation:
    """Position of a fault in a text.

    Attributes:
        file: Name of the file, as the user gave it.
        line: Line, counted from 1.
        column: Column, counted from 1.
        text: The line itself, for the caret.
        length: Number of characters to underline.
    """

    file: str
    line: int
    column: int
    text: str = ""
    length: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"

    def caret(self) -> str:
        """The faulty line with carets under the fault; tabs are preserved so that they line up."""
        first = (
            max(0, self.column - 1 - LONGEST_QUOTE // 2) if len(self.text) > LONGEST_QUOTE else 0
        )
        text = self.text[first : first + LONGEST_QUOTE]
        before = self.text[first : self.column - 1]
        lead = "".join("\t" if c == "\t" else " " for c in before)
        marked = max(1, min(self.length, len(text) - len(before)))
        return f"    {text}\n    {lead}{'^' * marked}"


class VisupError(Exception):
    """Base class of all errors that the user can fix.

    Args:
        what: What is wrong, one sentence without a full stop.
        where: A file, or a place in a file.
        expected: What was expected instead.
        hint: What to do about it.
    """

    code: str | None = None
    """A stable error code, if there is one."""

    def __init__(
        self,
        what: str,
        *,
        where: str | SourceLocation | None = None,
        expected: str | None = None,
        hint: str | None = None,
    ) -> None:
        super().__init__(what)
        self.what = what
        self.where = where
        self.expected = expected
        self.hint = hint

    def __str__(self) -> str:
        lines = [f"{self.where}: {self.what}" if self.where else self.what]
        if isinstance(self.where, SourceLocation) and self.where.text:
            lines.append(self.where.caret())
        if self.expected:
            lines.append(f"  expected: {self.expected}")
        if self.hint:
            lines.append(f"  hint: {self.hint}")
        return "\n".join(lines)


class SourceError(VisupError):
    """A video source cannot be opened or read."""


class DatabaseError(VisupError):
    """A model database cannot be read or written."""


class RuleError(VisupError):
    """A rules file is invalid."""


class TaskError(VisupError):
    """A task file is invalid."""


class BehaviourError(VisupError):
    """A behaviour violates its contract, or cannot be loaded."""


class SettingsError(VisupError):
    """A setting or an argument is invalid."""


class OutputError(VisupError):
    """An output folder or file cannot be written."""


class ExtraMissingError(VisupError):
    """A part of visup needs an extra that is not installed.

    Args:
        what: The part that was requested.
        extra: Name of the extra, as in ``visup[render]``.
    """

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(
            f"{what} needs the extra '{extra}', which is not installed",
            hint=f"pip install 'visup[{extra}]'",
        )


class ErrorGroup(VisupError):
    """All errors of one file, reported together.

    Args:
        errors: At least one error, in order of position.
    """

    def __init__(self, errors: list[VisupError]) -> None:
        super().__init__("\n".join(str(e) for e in errors))
        self.errors = tuple(errors)
