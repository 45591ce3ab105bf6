"""Whether a message points at the culprit: at what is written otherwise than it was meant.

Written and meant are compared token by token (difflib). What is wrong or too much must be under the caret;
where something is missing the caret must touch a neighbour of that place.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

from visup.agent.model.errors import SourceLocation

_TOKEN = re.compile(r"#[^\n]*|\d+(?:\.\d+)?|\w+(?:/\w+)?|::=|[<>=!]=|\.\.|[^\s]")


@dataclass(frozen=True)
class Span:
    """Characters of a text, from 0; the end is not included."""

    start: int
    end: int

    def meets(self, other: Span) -> bool:
        """Whether the two have a character in common."""
        return self.start < other.end and other.start < self.end


def points_at_culprit(place: SourceLocation, written: str, meant: str) -> bool:
    """Whether the caret of a message is at something that is written otherwise than meant."""
    caret = _span_of(place, written)
    return any(caret.meets(culprit) for culprit in changed_spans(written, meant))


def changed_spans(written: str, meant: str) -> Iterator[Span]:
    """The places of the written text that differ; both neighbours of a place where something is missing."""
    old, new = _tokens(written), _tokens(meant)
    words, others = [w for w, _ in old], [w for w, _ in new]
    for kind, a, b, c, d in SequenceMatcher(None, words, others, autojunk=False).get_opcodes():
        if kind == "insert":
            for at in _slid(others, c, d):
                yield from _beside(old, a + at - c)
        elif kind == "replace":
            yield from (span for _, span in old[a:b])
        elif kind == "delete":
            for first in _slid(words, a, b):
                yield from (span for _, span in old[first : first + b - a])


def _beside(tokens: Sequence[tuple[str, Span]], at: int) -> Iterator[Span]:
    """The two tokens between which something is missing, with the space up to the next character."""
    for _, span in tokens[max(at - 1, 0) : at + 1]:
        yield Span(span.start - 1, span.end + 1)


def _slid(words: Sequence[str], first: int, end: int) -> Iterator[int]:
    """Where a stretch that is left out or put in may begin with the same result, as in `and and`."""
    count = end - first
    start = first
    while start > 0 and words[start - 1] == words[start + count - 1]:
        start -= 1
    yield start
    while start + count < len(words) and words[start] == words[start + count]:
        start += 1
        yield start


def _tokens(text: str) -> list[tuple[str, Span]]:
    return [(m[0], Span(m.start(), m.end())) for m in _TOKEN.finditer(text)]


def _span_of(place: SourceLocation, text: str) -> Span:
    lines = text.split("\n")
    start = sum(len(row) + 1 for row in lines[: place.line - 1]) + place.column - 1
    return Span(start, start + max(1, place.length))
