"""The words of a text that cannot be read, each with the terminals of the grammar that it may be."""

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
        text: How it is written.
        terminals: What it is, the surest first; nothing when the language has no such word.
        nearly: What it would be if other words followed it.
    """

    begin: int
    text: str
    terminals: tuple[str, ...]
    nearly: tuple[str, ...] = ()

    @property
    def end(self) -> int:
        """The offset behind it."""
        return self.begin + len(self.text)


@dataclass(frozen=True, slots=True)
class Terminal:
    """A terminal of a grammar.

    Attributes:
        name: Its name.
        pattern: What it is.
        alone: The same, whatever follows.
    """

    name: str
    pattern: re.Pattern[str]
    alone: re.Pattern[str]


Terminals = Sequence[Terminal]


@lru_cache(maxsize=4)
def terminals_of(parser: Lark) -> Terminals:
    """The terminals of a grammar, the surest first."""
    ordered = sorted(
        (t for t in parser.terminals if t.name not in parser.ignore_tokens),
        key=lambda t: (-t.priority, t.pattern.type != "str", t.name),
    )
    patterns = ((t.name, t.pattern.to_regexp()) for t in ordered)
    return [Terminal(n, re.compile(p), re.compile(_LOOKAHEAD.sub("", p))) for n, p in patterns]


def words_of(text: str, terminals: Terminals, loose: Container[str] = ()) -> Iterator[Word]:
    """The words of a text, blanks and comments left out.

    Args:
        text: It need not be in the grammar.
        terminals: See `terminals_of`.
        loose: Terminals that take in so much that words are not cut by them.
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
