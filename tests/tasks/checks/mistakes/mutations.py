"""Mistakes made mechanically from good texts of both languages: one systematic slip at one word of a text.

Each kind of slip is one that typists and users of other languages make. `counted.py` says how many are told
with a change that mends them, and how many changes give back what was meant.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from random import Random

TOKEN = re.compile(
    r"#[^\n]*|\"[^\"\n]*\"|::=|<[ ]*[^\W\d]\w*(?:\([\w ,]*\))?[ ]*>|px/s2|px/s|deg/s|m/s|\d+(?:\.\d+)?|\w+"
    r"|[<>=!]=|\.\.|\S"
)
UNITS = frozenset(
    ["s", "ms", "min", "h", "px", "px/s", "px/s2", "deg", "deg/s", "m", "cm", "mm", "m/s", "%"]
)
IN_WORDS = dict(
    pair.split("=")
    for pair in [
        "s=sec",
        "ms=msec",
        "min=minutes",
        "h=hours",
        "px=pixels",
        "px/s=pixels/s",
        "deg=degrees",
        "%=percent",
        "deg/s=degrees/s",
        "m=meters",
    ]
)
OF_OTHERS = dict(
    pair.split("~")
    for pair in [
        "and~&&",
        "or~||",
        "not~!",
        "implies~->",
        "once~O",
        "always~H",
        "eventually~F",
        "henceforth~G",
        "since~S",
        "until~U",
        "::=~:=",
        "<=~=<",
        ">=~=>",
        "==~=",
        "..~,",
        "when~if",
        "say~print",
        "unless~except",
        "&~and",
        "|~or",
        "exists~any",
        "forall~all",
        "fails~failed",
        "within~before",
        "for~during",
        "is~=",
        "hold~keep",
        "never~not",
    ]
)
"""Words of both languages, and of others for the same."""
BRACKETS = {"(": "[{", ")": "]}", "[": "({", "]": ")}"}
SEPARATORS = {
    ",": (";", "", " and"),
    ":": ("", " ->", ","),
    "::=": ("=", ":", "->"),
    "..": ("-", ":", "to"),
}
PUNCTUATION = {"(", ")", "[", "]", "{", "}", ",", ":", "::=", "?", "*", "+"}
KEYS = ("qwertyuiop", "asdfghjkl", "zxcvbnm")


@dataclass(frozen=True, slots=True)
class Token:
    """A word of a text, with its place."""

    begin: int
    text: str

    @property
    def end(self) -> int:
        """The offset behind it."""
        return self.begin + len(self.text)

    @property
    def is_word(self) -> bool:
        """Whether it is a keyword or a name."""
        return self.text.isidentifier() and self.text not in UNITS


@dataclass(frozen=True, slots=True)
class Mutation:
    """A text with one mistake.

    Attributes:
        kind: Of the mistake.
        good: The text without it.
        text: The text with it.
        begin: Where the mistake is.
    """

    kind: str
    good: str
    text: str
    begin: int


Edit = tuple[int, int, str]
"""Begin and end of what is replaced, and what stands there then."""


def tokens_of(text: str) -> list[Token]:
    """The words of a text, without comments."""
    return [Token(m.start(), m[0]) for m in TOKEN.finditer(text) if m[0][0] != "#"]


def mutations(good: str, chance: Random, of_each: int = 1) -> Iterator[Mutation]:
    """Mistaken forms of a good text: of each kind as many as asked for, where there is a place for it."""
    tokens = tokens_of(good)
    for kind, edits_at in KINDS.items():
        found = [e for n in range(len(tokens)) for e in edits_at(tokens, n, chance)]
        for begin, end, new in chance.sample(found, min(of_each, len(found))):
            text = good[:begin] + new + good[end:]
            if text.split() != good.split():
                yield Mutation(kind, good, text, begin)


def _left_out(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    yield tokens[n].begin, tokens[n].end, ""


def _doubled(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    yield tokens[n].end, tokens[n].end, f" {tokens[n].text}"


def _swapped(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    """Two words, numbers or signs of comparison in the wrong order."""
    pair = tokens[n : n + 2]
    if len(pair) == 2 and all(t.text not in PUNCTUATION and t.text[0] != '"' for t in pair):
        yield pair[0].begin, pair[1].end, f"{pair[1].text} {pair[0].text}"


def _mistyped(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    """A letter left out, doubled, swapped with the next, or a neighbour on the keyboard."""
    word = tokens[n].text
    if not tokens[n].is_word or len(word) < 4:
        return
    at = chance.randrange(1, len(word) - 1)
    near = next((row for row in KEYS if word[at] in row), None)
    key = near[(near.index(word[at]) + 1) % len(near)] if near else word[at]
    forms = (
        word[:at] + word[at + 1 :],
        word[: at + 1] + word[at:],
        word[:at] + word[at + 1] + word[at] + word[at + 2 :],
        word[:at] + key + word[at + 1 :],
    )
    yield tokens[n].begin, tokens[n].end, chance.choice(forms)


def _other_bracket(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    if tokens[n].text in BRACKETS:
        yield tokens[n].begin, tokens[n].end, chance.choice(BRACKETS[tokens[n].text])


def _without_unit(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    if n and tokens[n].text in UNITS and tokens[n - 1].text[0].isdigit():
        yield tokens[n - 1].end, tokens[n].end, ""


def _unit_in_words(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    if n and tokens[n].text in IN_WORDS and tokens[n - 1].text[0].isdigit():
        yield tokens[n].begin, tokens[n].end, IN_WORDS[tokens[n].text]


def _other_unit(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    if n and tokens[n].text in UNITS and tokens[n - 1].text[0].isdigit():
        yield tokens[n].begin, tokens[n].end, chance.choice(sorted(UNITS - {tokens[n].text}))


def _other_separator(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    if tokens[n].text in SEPARATORS:
        yield tokens[n].begin, tokens[n].end, chance.choice(SEPARATORS[tokens[n].text])


def _word_of_others(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    if tokens[n].text in OF_OTHERS:
        yield tokens[n].begin, tokens[n].end, OF_OTHERS[tokens[n].text]


def _other_case(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    if tokens[n].is_word and tokens[n].text.islower():
        word = tokens[n].text
        yield tokens[n].begin, tokens[n].end, chance.choice((word.capitalize(), word.upper()))


def _plural(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    word = tokens[n].text
    if tokens[n].is_word and len(word) > 2:
        yield tokens[n].begin, tokens[n].end, word[:-1] if word.endswith("s") else f"{word}s"


def _other_underscore(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    if tokens[n].is_word and "_" in tokens[n].text:
        yield tokens[n].begin, tokens[n].end, tokens[n].text.replace("_", chance.choice("- "))


def _argument_less(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    """`touching(a, b)` without one of its arguments."""
    if tokens[n].text == "," and n and tokens[n - 1].is_word and tokens[n + 1].is_word:
        yield tokens[n - 1].begin, tokens[n + 1].begin, ""
        yield tokens[n].begin, tokens[n + 1].end, ""


def _argument_more(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    if n > 1 and tokens[n].text == ")" and tokens[n - 1].is_word:
        yield tokens[n].begin, tokens[n].begin, f", {tokens[n - 1].text}"


def _unknown_name(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    if tokens[n].is_word and n and tokens[n - 1].text in ("(", ","):
        yield tokens[n].begin, tokens[n].end, "zz"


def _unknown_stage(tokens: Sequence[Token], n: int, _: Random) -> Iterator[Edit]:
    """A stage under another name: with a letter less, or in the plural."""
    word = tokens[n].text
    if word[0] == "<" and len(word) > 5:
        yield tokens[n].begin, tokens[n].end, f"{word[:-1]}s>"
        yield tokens[n].begin, tokens[n].end, word[:2] + word[3:]


def _bare_stage(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    word = tokens[n].text
    if word[0] == "<" and len(word) > 2:
        forms = (word[1:-1], f"({word[1:-1]})", f"[{word[1:-1]}]", word[:-1], f"{{{word[1:-1]}}}")
        yield tokens[n].begin, tokens[n].end, chance.choice(forms)


def _other_quotes(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    word = tokens[n].text
    if word[0] == '"' and len(word) > 2:
        forms = (f"'{word[1:-1]}'", word[:-1], word[1:], word[1:-1], f"\u201c{word[1:-1]}\u201d")
        yield tokens[n].begin, tokens[n].end, chance.choice(forms)


def _other_number(tokens: Sequence[Token], n: int, chance: Random) -> Iterator[Edit]:
    word = tokens[n].text
    if word[0].isdigit():
        said = {"1": "one", "2": "two", "3": "three", "5": "five", "10": "ten"}.get(word)
        forms = (word.replace(".", ","), f"-{word}", said or word)
        yield tokens[n].begin, tokens[n].end, chance.choice([f for f in forms if f != word])


KINDS: Mapping[str, Callable[[Sequence[Token], int, Random], Iterator[Edit]]] = {
    "left out": _left_out,
    "doubled": _doubled,
    "swapped": _swapped,
    "mistyped": _mistyped,
    "other bracket": _other_bracket,
    "without unit": _without_unit,
    "unit in words": _unit_in_words,
    "other unit": _other_unit,
    "other separator": _other_separator,
    "word of others": _word_of_others,
    "other case": _other_case,
    "plural": _plural,
    "other underscore": _other_underscore,
    "argument less": _argument_less,
    "argument more": _argument_more,
    "unknown name": _unknown_name,
    "unknown stage": _unknown_stage,
    "bare stage": _bare_stage,
    "other quotes": _other_quotes,
    "other number": _other_number,
}
