"""Everyday phrases: signs in words, connectives in other natural languages, filler words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType

NUMBERS: Mapping[str, str] = MappingProxyType(
    {
        "two": "2", "three": "3", "four": "4", "five": "5", "six": "6", "seven": "7", "eight": "8",
        "nine": "9", "ten": "10", "twenty": "20", "thirty": "30", "fifty": "50", "hundred": "100",
    }
)  # fmt: skip
_SIGNS = {
    "<": "below|under|beneath|less than|smaller than|lower than|fewer than|shorter than|closer than"
    "|nearer than|slower than|lt|lower|smaller",
    "<=": "smaller or equal|less or equal|less than or equal to|smaller than or equal to|at most"
    "|no more than|not more than|up to|maximum|not exceeding|no longer than|le|leq",
    ">": "above|over|beyond|exceeds|exceeding|surpasses|more than|greater than|larger than|higher than"
    "|longer than|greater|larger|faster than|bigger than|further than|farther than|gt",
    ">=": "greater or equal|larger or equal|greater than or equal to|at least"
    "|no less than|not less than|minimum|ge|geq",
    "==": "equals|equal to|same as",
}
_CONNECTIVES = {
    "and": "und|et|y|e|og|och|en|also|plus|but|yet|while|whilst|with|as well as|and also|и",
    "or": "oder|ou|o|of|eller|else|otherwise|alternatively|или",
    "not": "nicht|kein|keine|pas|non|no|nao|não|ikke|isnt|never|не",
    "when": "wenn|si|if|quand|lorsque|cuando|cuándo|whenever|als|quando|wanneer|trigger|condition|если",
    "for": "für|fuer|pour|por|during|durante|während|pendant|lasting|voor|for at least",
    "unless": "except|except when|except if|sauf si|ausser|außer|salvo",
    "leave": "hysteresis",
    "say": "print|message|report|tell|text|output|log|sag|sage|dis|notify|description|msg",
}
FILLERS = frozenset(
    [
        "a",
        "an",
        "the",
        "is",
        "are",
        "was",
        "were",
        "be",
        "been",
        "being",
        "it",
        "its",
        "that",
        "this",
        "there",
        "then",
        "has",
        "have",
        "had",
        "does",
        "do",
        "did",
        "should",
        "must",
        "shall",
        "will",
        "would",
        "can",
        "of",
        "at",
        "to",
        "so",
        "just",
        "only",
        "both",
        "either",
        "stays",
        "stay",
        "remains",
        "remain",
        "gets",
        "get",
        "becomes",
        "become",
        "drops",
        "drop",
        "falls",
        "fall",
        "rises",
        "rise",
        "goes",
        "go",
        "value",
        "current",
        "please",
        "let",
        "lets",
        "immediately",
    ]
)
"""Words that may be dropped without loss."""


def _phrases(table: Mapping[str, str]) -> Iterator[tuple[str, tuple[tuple[str, ...], str]]]:
    for meant, said in table.items():
        for phrase in said.split("|"):
            words = tuple(phrase.split())
            yield words[0], (words, meant)


def _by_first_word(
    *tables: Mapping[str, str],
) -> Mapping[str, tuple[tuple[tuple[str, ...], str], ...]]:
    found: dict[str, list[tuple[tuple[str, ...], str]]] = {}
    for table in tables:
        for first, phrase in _phrases(table):
            found.setdefault(first, []).append(phrase)
    return MappingProxyType({first: tuple(some) for first, some in found.items()})


PHRASES = _by_first_word(_SIGNS, _CONNECTIVES)


def meanings_of(words: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Meanings of the first words: how many of them, and the sign or connective.

    >>> list(meanings_of(["at", "least", "20"]))
    [(2, '>=')]
    """
    said = [w.casefold() for w in words]
    for phrase, meant in PHRASES.get(said[0], ()) if said else ():
        if tuple(said[: len(phrase)]) == phrase:
            yield len(phrase), meant
    if said and said[0] in NUMBERS:
        yield 1, NUMBERS[said[0]]


_PARTS_SAID = {"half": "0.5", "quarter": "0.25", "a": "1", "one": "1", "couple": "2", "few": "3"}
_OF_TIME = {"s": "s", "m": "min", "h": "h"}
AMOUNT_SAID = re.compile(
    r"\b(?:(half|quarter)\s+(?:of\s+)?an?|(?:a\s+)?(couple|few)(?:\s+of)?|(an?|one))\s+(second|sec|minute|min|hour)s?\b",
    re.IGNORECASE,
)
"""Amounts of time in words, without a number."""


def amount_said(match: re.Match[str]) -> str:
    """The amount of time that words mean.

    >>> amount_said(AMOUNT_SAID.search("for half a second"))
    '0.5 s'
    """
    word = (match[1] or match[2] or "one").casefold()
    return f"{_PARTS_SAID[word]} {_OF_TIME[match[4][0].casefold()]}"
