"""The culprit of a mistake: what a change of a text replaces, takes out, or puts something beside."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher

_TOKEN = re.compile(r"\d+(?:\.\d+)?|\w+(?:/\w+)?|::=|[<>=!]=|\.\.|[^\s]")
_AFTER = re.compile(r"[])}[,;:\"'>]")

Span = tuple[int, int]
"""Offsets of characters; the end is not included."""


@dataclass(frozen=True)
class ErrorSpan:
    """What of a text is wrong, by a change that mends it.

    Attributes:
        words: Each stretch of words that is replaced or taken out, and both neighbours of what is put in.
        shown: From the first to the last of them on the first line; of neighbours the one that is meant more.
    """

    words: tuple[Span, ...]
    shown: Span


def error_span(text: str, begin: int, end: int, new: str) -> ErrorSpan | None:
    """The words of a text that a change is about; None if only blanks are changed.

    Args:
        text: The text.
        begin: Offset of what is replaced.
        end: Offset of its end.
        new: What is put in its place.

    >>> error_span("speed(a) < 3 m/s", 0, 16, "speed(a) < 3 px/s")
    ErrorSpan(words=((13, 16),), shown=(13, 16))
    >>> error_span("gap(a b) < 3 px", 0, 8, "gap(a, b)")
    ErrorSpan(words=((4, 5), (6, 7)), shown=(4, 5))
    """
    begin, end, new = _with_neighbours(text, begin, end, new)
    found = list(_changed(text, begin, end, new))
    if not found:
        return None
    first = found[0][-1][0]
    stop = text.find("\n", first)
    last = max(end for *_, (start, end) in found if stop < 0 or start < stop)
    words = tuple(span for *some, _ in found for span in some)
    return ErrorSpan(words, (first, last if stop < 0 else min(last, stop)))


def _with_neighbours(text: str, begin: int, end: int, new: str) -> tuple[int, int, str]:
    """A change together with the words before and after it, by which it is seen what is put in where."""
    before = _word_before(text, begin)
    after = _TOKEN.search(text, end)
    stop = after.end() if after else end
    return before, stop, text[before:begin] + new + text[end:stop]


def _word_before(text: str, end: int) -> int:
    """The offset of the last word that begins before another offset, or that offset if there is none."""
    head = text[:end].rstrip()
    if not head:
        return end
    # No word holds a blank: words are found from the last blank on, however long the text is.
    start = len(head) - len(head.rsplit(maxsplit=1)[-1])
    return max(m.start() for m in _TOKEN.finditer(text, start, end))


def _changed(text: str, begin: int, end: int, new: str) -> Iterator[list[Span]]:
    """For each change what is wrong, or its neighbours, and then what of that is to be shown."""
    spans = [m.span() for m in _TOKEN.finditer(text, begin, end)]
    old, put = [text[s:e] for s, e in spans], _TOKEN.findall(new)
    for kind, a, b, c, _ in SequenceMatcher(None, old, put, autojunk=False).get_opcodes():
        if kind == "insert":
            yield [*spans[max(a - 1, 0) : a + 1], _neighbour_shown(text, spans, a, put[c])]
        elif kind != "equal":
            yield [(spans[a][0], spans[b - 1][1])] * 2


def _neighbour_shown(text: str, spans: list[Span], at: int, put: str) -> Span:
    """The word after which a bracket, a sign or a unit is missing, else the one before which something is."""
    if at == 0:
        return spans[0]
    if at == len(spans):
        return spans[-1]
    (start, end), (following, _) = spans[at - 1], spans[at]
    belongs = _AFTER.fullmatch(put) or text[start].isdigit() or "\n" in text[end:following]
    return spans[at - 1] if belongs else spans[at]
