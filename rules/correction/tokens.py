"""Tokens of a faulty text, each with its possible terminals of the grammar."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

from lark import Lark

_WORD = re.compile(r"[^\W\d]\w*")
_LOOKAHEAD = re.compile(r"\(\?=(?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)\Z")
IGNORED = re.compile(r"(?:\s|#[^\n]*)+")


@dataclass(frozen=True, slots=True)
class Word:
    """A word of a text.

    Attributes:
        begin: Its offset.
        text: Its spelling.
        terminals: Possible terminals, most specific first; empty if the language has no such word.
        nearly: Terminals it would be if other words followed it.
    """

    begin: int
    text: str
    terminals: tuple[str, ...]
    nearly: tuple[str, ...] = ()

    @property
    def end(self) -> int:
        """The offset after it."""
        return self.begin + len(self.text)


@dataclass(frozen=True, slots=True)
class Terminal:
    """A terminal of a grammar.

    Attributes:
        name: Its name.
        pattern: Its pattern.
        alone: The same, without lookahead.
    """

    name: str
    pattern: re.Pattern[str]
    alone: re.Pattern[str]


Terminals = Sequence[Terminal]


@lru_cache(maxsize=4)
def terminals_of(parser: Lark) -> Terminals:
    """The terminals of a grammar, most specific first."""
    ordered = sorted(
        (t for t in parser.terminals if t.name not in parser.ignore_tokens),
        key=lambda t: (-t.priority, t.pattern.type != "str", t.name),
    )
    patterns = ((t.name, t.pattern.to_regexp()) for t in ordered)
    return [Terminal(n, re.compile(p), re.compile(_LOOKAHEAD.sub("", p))) for n, p in patterns]


def tokens_of(text: str, terminals: Terminals, loose: Container[str] = ()) -> Iterator[Word]:
    """The words of a text, without blanks and comments.

    Args:
        text: The text; it need not be in the grammar.
        terminals: See `terminals_of`.
        loose: Terminals so general that they do not split words.
    """
    at = 0
    while True:
        blank = IGNORED.match(text, at)
        at = blank.end() if blank else at
        if at >= len(text):
            return
        word = _WORD.match(text, at)
        found = [(m.end() - at, t) for t in terminals if (m := t.alone.match(text, at))]
        strict = [n for n, t in found if t.name not in loose]
        length = max([word.end() - at if word else 1, *strict])
        fitting = [t for n, t in found if n == length]
        sure = tuple(t.name for t in fitting if t.pattern.match(text, at))
        nearly = tuple(t.name for t in fitting if t.name not in sure)
        yield Word(at, text[at : at + length], sure, nearly)
        at += length
