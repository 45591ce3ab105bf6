"""Common errors in declarations of actors."""

from __future__ import annotations

import re

from visup.agent.model.did_you_mean import did_you_mean
from visup.rules.traits.colours import TERMS
from visup.tasks.grammar.statement import NAME, RESERVED_WORDS, RecognisedError

RANKS = ("largest", "smallest", "leftmost", "rightmost", "highest", "lowest")
_RANKS_MEANT = {
    "biggest": "largest", "tallest": "largest", "left": "leftmost", "right": "rightmost",
    "topmost": "highest", "uppermost": "highest", "top": "highest", "bottom": "lowest",
    "bottommost": "lowest", "tiniest": "smallest",
}  # fmt: skip
_ACTOR = re.compile(rf"\s*(?:(?:optional\s+)?actor|bystander)\b\s*({NAME})?\s*(\S*)")
_ARTICLES = (
    "a",
    "an",
    "the",
    "of",
    "with",
    "bright",
    "vivid",
    "pale",
    "deep",
    "color",
    "colour",
    "colored",
    "coloured",
)
_BLANK = re.compile(r"\bis\s+([\w.\-]+)[ ]+(?!or\b|and\b|size\b)([\w.\-]+)")


def criteria(text: str) -> RecognisedError | None:
    """Errors in the criteria of an actor, by their first words."""
    if _ACTOR.match(text) is None:
        return None
    return _order(text) or _conduct(text) or _extent(text) or _place(text) or _part(text)


def bystanders(text: str) -> RecognisedError | None:
    """Errors in the `bystanders` statement."""
    m = re.match(r"\s*(bystanders)\b(?!\s+ignored\b)", text)
    if m is None:
        return None
    what = "`bystanders` is not followed by `ignored`"
    expected = "`bystanders ignored`, or `bystander person` for some of them"
    return RecognisedError("E124", m.start(1), len(m[1]), what, expected)


def actor(text: str) -> RecognisedError | None:
    """Errors in the declaration of an actor as a whole."""
    m = _ACTOR.match(text)
    if m is None:
        return None
    expected = "`actor satellite is spartan or hubble`"
    if m[1] is None or m[1] in RESERVED_WORDS:
        start = m.end() - len(m[0].lstrip())
        return RecognisedError("E124", start, 5, "the name of the actor is missing", expected)
    size = re.search(r"\bsize\b(?!\s*\d+(?:\.\d+)?\s*[^\W\d])", text)
    if size is not None:
        what = "`size` is not followed by a number and a unit"
        return RecognisedError("E124", size.start(), 4, what, "such as `size 1.6 m`")
    if m[2] == "is":
        hint = "several models are separated by `or`" if re.search(r"[,|/]", text) else None
        spaced = _BLANK.search(text)
        if hint is None and spaced is not None and spaced[1] not in _ARTICLES:
            one, two = spaced.groups()
            hint = f"the name of a model has no blanks, such as `{one}_{two}`"
            if one in TERMS or two in TERMS:
                change = f"write `{one} and {two}` in place of `{one} {two}`"
                hint = f"criteria of an actor are joined by `and`; {change}"
        what = f"actor `{m[1]}` is declared with something that is not a model"
        if not text[m.end() :].strip(" "):
            what = f"actor `{m[1]}` is declared without a model"
        return RecognisedError("E124", m.start(1), len(m[1]), what, expected, hint)
    what = f"`is` is missing after actor `{m[1]}`"
    return RecognisedError("E124", m.start(1), len(m[1]), what, expected)


def _order(text: str) -> RecognisedError | None:
    m = re.search(r"(?<!from)\s\bthe\s+([^\W\d]\w*)", text)
    if m is None or m[1] in (*RANKS, "other"):
        return None
    near = _RANKS_MEANT.get(m[1])
    hint = f"did you mean `the {near}`?" if near else did_you_mean(m[1], RANKS, "`the {}`")
    expected = ", ".join(f"`the {r}`" for r in RANKS) + " or `the other`"
    what = f"`the {m[1]}` is not an order that visup knows"
    return RecognisedError("E124", m.start() + 1, m.end() - m.start() - 1, what, expected, hint)


def _conduct(text: str) -> RecognisedError | None:
    m = re.search(r"\b(?:what|who|which|that)\s+([^\W\d]\w*)", text)
    right = r"\bwhat\s+(?:enters(?:\s+from\s+the\s+(?:left|right|top|bottom)\b|(?!\s+\w))"
    if m is None or re.search(right + r"|moves\s+first\b|rests\b)", text):
        return None
    expected = "`what enters from the left`, `what moves first` or `what rests`"
    what = f"`{m[0]}` is not a way to identify an actor"
    return RecognisedError("E124", m.start(), m.end() - m.start(), what, expected)


def _extent(text: str) -> RecognisedError | None:
    m = re.search(
        r"\b(larger|smaller|bigger|longer|shorter)\b(?!\s*(?:or|and|size)\b)(?=\s+\S)", text
    )
    right = r"\b(?:larger|smaller)\s+than\s+(?:\d+(?:\.\d+)?\s*[^\W\d]|[^\W\d])"
    if m is None or re.search(right, text):
        return None
    meant = "smaller" if m[1] in ("smaller", "shorter") else "larger"
    what = f"`{m[1]}` is not followed by `than`, a number and a unit"
    if m[1] not in ("larger", "smaller"):
        what = f"`{m[1]}` is not a word for sizes"
    return RecognisedError("E124", m.start(), len(m[1]), what, f"`{meant} than 40 px`")


def _place(text: str) -> RecognisedError | None:
    m = re.search(r"\bat\b(?!\s*\(\s*\d+(?:\.\d+)?\s*,\s*\d+(?:\.\d+)?\s*\))", text)
    if m is None:
        return None
    what = "`at` is not followed by a place"
    return RecognisedError("E124", m.start(), 2, what, "`at (410, 160)`, in pixels")


def _part(text: str) -> RecognisedError | None:
    m = re.search(rf"\bpart\s+of\b(?!\s+{NAME})", text)
    if m is None:
        return None
    what = "`part of` is not followed by the actor that is the machine"
    return RecognisedError("E124", m.start(), m.end() - m.start(), what, "`part of arm`")
