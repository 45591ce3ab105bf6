"""Faults of task files: each has a stable code, a place, and a word on how to mend it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from difflib import get_close_matches

from visup.agent.model.errors import SourceLocation, TaskError
from visup.tasks.grammar.nodes import Span

CODES = {
    "E101": "text that is not part of the language",
    "E102": "`::=` is missing or written otherwise",
    "E103": "the name of a stage without angle brackets",
    "E104": "a character that does not belong in text",
    "E105": "quotes or typographic characters",
    "E106": "tabs",
    "E107": "an angle bracket that is not closed",
    "E108": "something between angle brackets that is not a name",
    "E109": "a stage that asks for nothing",
    "E110": "a bracket that is not closed",
    "E111": "a closing bracket without an opening one",
    "E112": "brackets of the wrong kind",
    "E113": "an action in angle brackets",
    "E114": "an alternative or a part that is empty",
    "E115": "a clause without a duration",
    "E116": "a duration without a unit",
    "E117": "actors that are not parted by commas",
    "E118": "an action without actors",
    "E119": "commas or words between stages",
    "E120": "a full stop or semicolon at the end of a rule",
    "E121": "a comment of another language",
    "E122": "an operator of another language",
    "E123": "a word of the language used as a name",
    "E124": "a declaration of an actor that is not complete",
    "E125": "an invariant that is not complete",
    "E126": "a repetition mark in the wrong place",
    "E127": "a part of the language that visup does not have",
    "E128": "brackets nested too deep",
    "E129": "a file without a rule",
    "E130": "an include without a file name in quotes",
    "E131": "a zone that is not drawn rightly",
    "E132": "a parameter that is not complete",
    "E133": "`when` without a condition, or a sign without `when`",
    "E134": "a number of times that is not complete",
    "E135": "`any order` without its list",
    "E201": "an unknown action",
    "E202": "a stage that is not defined",
    "E203": "a stage defined twice",
    "E204": "a stage that the task never comes to",
    "E205": "the wrong number of actors",
    "E206": "a stage that begins with itself",
    "E207": "a stage that can never end",
    "E208": "clauses that contradict each other",
    "E209": "actions that can never hold at the same time",
    "E210": "an invariant that the task itself breaks",
    "E211": "an action between an actor and itself",
    "E212": "an actor declared twice",
    "E213": "an actor that takes no part",
    "E214": "an actor that looks like a slip of the pen",
    "E215": "a repetition of what may be left out",
    "E216": "`for` on things that follow one another",
    "E217": "a duration of nothing",
    "E218": "an unknown unit",
    "E219": "actors of an action without brackets",
    "E220": "stages referred to without angle brackets",
    "E221": "an included file that cannot be read",
    "E222": "files that include each other",
    "E223": "a parameter that is not declared",
    "E224": "a name declared twice",
    "E225": "a declaration that nothing uses",
    "E226": "an amount of the wrong kind",
    "E227": "a quantity that is not compared",
    "E228": "a comparison of what is no quantity",
    "E229": "a zone where an actor belongs, or the other way round",
    "E230": "stages that no observation can tell apart",
    "E231": "an action that can never be observed",
    "E232": "`begins` or `ends` on things that follow one another",
    "E233": "numbers of times that contradict each other",
    "E234": "too many things in any order",
    "E235": "a sign said twice",
}
"""Every code with what it stands for; a code never changes its meaning."""


class Diagnostic(TaskError):
    """A mistake in a task file.

    Args:
        code: One of `CODES`.
        message: What is wrong, one clause.
        where: Its place in the file.
        expected: What was expected instead.
        hint: How to mend it.
    """

    def __init__(
        self,
        code: str,
        message: str,
        where: SourceLocation,
        *,
        expected: str | None = None,
        hint: str | None = None,
    ) -> None:
        super().__init__(f"[{code}] {message}", where=where, expected=expected, hint=hint)
        self.code = code
        self.message = message
        self.place = where


class Source:
    """The lines of a file, to find the places of faults.

    Args:
        text: The whole text, as the user wrote it.
        file: Its name, for messages.

    Attributes:
        included: The files that it includes, by name.
    """

    def __init__(self, text: str, file: str) -> None:
        self.file = file
        self.included: dict[str, Source] = {}
        self._lines = text.split("\n")

    def place(self, line: int, column: int, length: int = 1) -> SourceLocation:
        """The place at a line and column, counted from 1; past the end it is the end."""
        if line > len(self._lines) or line < 1:
            line = len(self._lines)
            column = len(self._line(line)) + 1
        text = self._line(line)
        column = max(1, min(column, len(text) + 1))
        return SourceLocation(
            self.file, line, column, text, max(1, min(length, len(text) - column + 1))
        )

    def at(self, span: Span) -> SourceLocation:
        """The place of a node; of a node over several lines, its part of the first."""
        if span.file:
            return self.included[span.file].at(replace(span, file=""))
        one_line = span.end_line == span.line
        length = span.end_column - span.column if one_line else 10_000
        return self.place(span.line, span.column, length)

    def fault(
        self,
        code: str,
        what: str,
        span: Span,
        expected: str | None = None,
        hint: str | None = None,
    ) -> Diagnostic:
        """A fault at the place of a node."""
        return Diagnostic(code, what, self.at(span), expected=expected, hint=hint)

    def _line(self, line: int) -> str:
        return self._lines[line - 1].rstrip("\r")


def did_you_mean(word: str, known: Iterable[str], form: str = "`{}`") -> str | None:
    """The hint that names the nearest known word, or None when none is near."""
    near = closest(word, known)
    return f"did you mean {form.format(near)}?" if near else None


def closest(word: str, known: Iterable[str]) -> str | None:
    """The known word nearest to one, or None."""
    by_folded = {k.casefold(): k for k in known}
    near = get_close_matches(word.casefold(), by_folded, n=1, cutoff=0.6)
    return by_folded[near[0]] if near else None
