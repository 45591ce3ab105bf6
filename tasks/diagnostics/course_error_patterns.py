"""Common errors inside a course; `error_patterns.py` defines the order of trial."""

from __future__ import annotations

import re

from visup.tasks.actions.actions import ACTIONS
from visup.tasks.grammar.statement import NAME, PARAMETERS, RESERVED_WORDS, RecognisedError


def open_angle(text: str) -> RecognisedError | None:
    """A reference with one angle bracket."""
    # A quantity may be compared with a parameter: `gap(arm, satellite) < reach`.
    m = re.search(rf"<(?:(?<!\))(?<!\) )[ ]*)?({NAME})(?!{PARAMETERS}[ ]*>|\w)", text)
    if m is not None:
        return RecognisedError(
            "E107", m.start(), len(m[0]), f"`<{m[1]}` is not closed", f"`<{m[1]}>`"
        )
    m = re.search(rf"(?<![<\w ])[ ]+({NAME})[ ]*>", text)
    if m is not None:
        what = f"`{m[1]}>` is not opened"
        return RecognisedError("E107", m.start(1), len(m[1]) + 1, what, f"`<{m[1]}>`")
    return None


def brackets(text: str) -> RecognisedError | None:
    """Brackets of the wrong kind, not closed, or not opened."""
    m = re.search(r"[\[\]{}]", text)
    if m is not None:
        what = f"`{m[0]}` is not a bracket of the language"
        hint = "what may be left out is written `( ... )?`, what is repeated `( ... )*`"
        return RecognisedError(
            "E112", m.start(), 1, what, "`(` and `)` for groups and actors", hint
        )
    opened: list[int] = []
    for m in re.finditer(r"[()]", text):
        if m[0] == "(":
            opened.append(m.start())
        elif opened:
            opened.pop()
        else:
            return RecognisedError("E111", m.start(), 1, "`)` has no `(` before it", "`(`")
    if opened:
        return RecognisedError("E110", opened[0], 1, "`(` is not closed", "`)`")
    return None


def action_in_angles(text: str) -> RecognisedError | None:
    """An action written `<converging>(arm, satellite)`."""
    m = re.search(rf"<[ ]*({NAME})[ ]*>[ ]*\((?=[ ]*{NAME}[ ]*,)", text)
    if m is None:
        return None
    what = f"action `{m[1]}` is written in angle brackets"
    return RecognisedError("E113", m.start(), len(m[0].rstrip("( ")), what, f"`{m[1]}(...)`")


JOINING = {"&": "and", "|": "or"}


def is_in_condition(text: str, at: int) -> bool:
    """Whether an offset is behind `when`, or in an invariant, where conditions are joined by words."""
    return re.search(r"\bwhen\b[^\n]*$|^\s*(?:never|always)\b[^\n]*$", text[:at]) is not None


def operators(text: str) -> RecognisedError | None:
    """Operators of other languages."""
    m = re.search(r"\|\||&&", text)
    if m is not None:
        if is_in_condition(text, m.start()):
            what = f"`{m[0]}` is a word in conditions"
            return RecognisedError("E122", m.start(), 2, what, f"`{JOINING[m[0][0]]}`")
        what = f"`{m[0]}` is written once in this language"
        return RecognisedError("E122", m.start(), 2, what, f"`{m[0][0]}`")
    m = re.search(r"(!|~|¬)(?=\s*[\w(<])", text)
    if m is not None:
        hint = (
            "a stage states what should hold: `decoupled`, `apart`, `gone`; conditions have `not`"
        )
        return RecognisedError(
            "E122", m.start(), 1, f"`{m[0]}` is not part of the language", None, hint
        )
    m = re.search(r"[>)\w]\s+(/)\s+[<(\w]", text)
    if m is not None:
        return RecognisedError("E122", m.start(1), 1, "`/` does not separate alternatives", "`|`")
    return None


def empty_part(text: str) -> RecognisedError | None:
    """A missing operand of `|` or `&`."""
    m = re.search(r"(?:::=|[(|&])\s*([|&])|([|&])\s*(?:\)|[|&]|$)|\(\s*\)(?<![\w]\))", text)
    if m is None:
        return None
    for group, side in ((1, "before"), (2, "after")):
        if m[group]:
            what = f"nothing stands {side} `{m[group]}`"
            return RecognisedError("E114", m.start(group), 1, what, "an action, a stage or a group")
    return None


def no_brackets(text: str) -> RecognisedError | None:
    """An action whose actors follow it without brackets."""
    m = re.search(rf"(?:::=|[|&>)])\s*({NAME})[ ]+({NAME})[ ]+({NAME})", text)
    if m is not None and m[2] in ACTIONS:
        what = f"`{m[2]}` is written between its actors"
        expected = f"`{m[2]}({m[1]}, {m[3]})`"
        return RecognisedError("E219", m.start(1), m.end(3) - m.start(1), what, expected)
    m = re.search(rf"(?:::=|[|&>)])\s*({NAME})[ ]+({NAME}(?:\s*,\s*{NAME})+)", text)
    if m is None or m[1] in RESERVED_WORDS:
        return None
    what = f"the actors of `{m[1]}` are written without brackets"
    return RecognisedError("E219", m.start(1), m.end(2) - m.start(1), what, f"`{m[1]}({m[2]})`")


def no_actors(text: str) -> RecognisedError | None:
    """Empty brackets."""
    m = re.search(rf"({NAME})[ ]*\(\s*\)", text)
    if m is not None:
        what = f"action `{m[1]}` has no actors"
        return RecognisedError("E118", m.start(1), len(m[0]), what, f"`{m[1]}(arm, satellite)`")
    m = re.search(r"\(\s*\)", text)
    if m is not None:
        return RecognisedError(
            "E114", m.start(), len(m[0]), "an empty group", "an action, a stage or a group"
        )
    return None


def clause(text: str) -> RecognisedError | None:
    """`for` or `within` without a proper duration."""
    m = re.search(r"\b(for|within|after|every)\b\s*(-\s*\d\S*)", text)
    if m is not None:
        return RecognisedError(
            "E115", m.start(2), len(m[2]), "a duration is never negative", "a number and a unit"
        )
    m = re.search(r"\b(for|within|after|every)\b(?!\s*[\d-])(?!\s*\()", text)
    if m is not None and re.match(r"for\s+each\b", text[m.start() :]):
        expected = (
            "such as `for each leg of (leg_1, leg_2)`, `for each of 4 legs` or `for each new leg`"
        )
        return RecognisedError("E115", m.start(1), 3, "`for each` is not complete", expected)
    if m is not None:
        what = f"`{m[1]}` is not followed by a duration"
        return RecognisedError("E115", m.start(1), len(m[1]), what, f"such as `{m[1]} 5 s`")
    m = re.search(r"([<>]=?)\s*(\d+(?:\.\d+)?)(?![\d.]|\s*[^\W\d]|\s*%)", text)
    if m is not None:
        what = f"`{m[2]}` has no unit"
        return RecognisedError(
            "E116", m.start(2), len(m[2]), what, "a unit, such as `5 px` or `3 px/s`"
        )
    m = re.search(r"\b(for|within|after|every)\s+(\d+(?:\.\d+)?)(?![\d.]|[ ]*[^\W\d])", text)
    if m is not None:
        what = f"`{m[0]}` has no unit"
        expected = f"`s`, `min`, `ms` or `h`, such as `{m[1]} {m[2]} s`"
        return RecognisedError("E116", m.start(2), len(m[2]), what, expected)
    return None


def commas(text: str) -> RecognisedError | None:
    """Missing or misplaced commas."""
    one = rf"(?!of\b)({NAME})"
    m = re.search(rf"{NAME}[ ]*\((?:[^()]*[(, ])?{one}[ ]+{one}[^()]*\)", text)
    if m is not None:
        what = f"actors `{m[1]}` and `{m[2]}` are not separated by a comma"
        length = m.end(2) - m.start(1)
        return RecognisedError("E117", m.start(1), length, what, f"`{m[1]}, {m[2]}`")
    m = re.search(r"\([^()]*?(,\s*)(?=[,)])|\(\s*(,)", text)
    if m is not None:
        start = m.start(1) if m[1] else m.start(2)
        return RecognisedError("E117", start, 1, "there is no actor next to this comma", "an actor")
    m = re.search(r"[>)?*+]\s*(,|;(?=\s*[<\w]))", text)
    if m is not None and not re.search(r"\bany\s+order\b", text):
        what = f"`{m[1]}` between stages"
        hint = "what comes next simply follows; at the same time is `&`"
        return RecognisedError("E119", m.start(1), 1, what, "the next stage", hint)
    return None


AGAIN = "such as `touching(wiper, glass) every 2 s to 4 s`"


def periodic(text: str) -> RecognisedError | None:
    """A periodic action in another form, or of more than one action."""
    m = re.search(r"\b(periodic|periodically|repeating|cyclic)\b", text)
    if m is not None:
        what = f"`{m[1]}` is not part of the language"
        return RecognisedError("E127", m.start(1), len(m[1]), what, AGAIN)
    m = re.search(r"\b(every|each)\s+(?=\d)", text)
    if m is None:
        return None
    if m[1] == "each":
        return RecognisedError(
            "E101", m.start(1), 4, "unexpected `each`", AGAIN, "did you mean `every`?"
        )
    before = text[: m.start()].rstrip()
    if re.search(rf"(?<![<>=] ){NAME}[ ]*\([^()]*\)$", before) is None:
        what = "`every` does not follow a single action"
        return RecognisedError("E101", m.start(1), 5, what, AGAIN)
    return None


STAGE_CONDITIONS = "`begins when`, `ends when`, `progresses when`, `fails when` or `pauses when`"
CONDITION_SYNONYMS = {
    "starts": "begins", "stops": "ends", "pause": "pauses", "paused": "pauses", "suspends": "pauses",
    "suspended": "pauses", "interrupted": "pauses", "interrupts": "pauses", "waits": "pauses",
    "halts": "pauses",
}  # fmt: skip
"""Synonyms of the words of stage conditions."""


def signs(text: str) -> RecognisedError | None:
    """A stage condition (`begins when`, ...) without a condition or without `when`."""
    m = re.search(
        rf"[>)?*+smh]\s+((?:begins|ends|progresses|fails|pauses|{'|'.join(CONDITION_SYNONYMS)})\b)"
        r"(?!\s+when\b)",
        text,
    )
    if m is not None:
        meant = CONDITION_SYNONYMS.get(m[1], m[1])
        what = f"`{m[1]}` is not followed by `when` and a condition"
        return RecognisedError(
            "E133", m.start(1), len(m[1]), what, f"`{meant} when touching(arm, satellite)`"
        )
    m = re.search(rf"\bwhen\b(?!\s+(?:not\b|\(|{NAME}\s*\())", text)
    if m is not None:
        what = "`when` is not followed by a condition"
        expected = "such as `when touching(arm, satellite) and not converging(arm, satellite)`"
        return RecognisedError("E133", m.start(), 4, what, expected)
    m = re.search(rf"\b({'|'.join(CONDITION_SYNONYMS)}|succeeds|completes)\s+when\b", text)
    if m is not None:
        what = f"`{m[1]} when` is not part of the language"
        return RecognisedError("E133", m.start(1), len(m[1]), what, STAGE_CONDITIONS)
    return None


def times(text: str) -> RecognisedError | None:
    """A count that is incomplete or in another form."""
    m = re.search(r"\b(for|within)\s+(at\s+(?:least|most))\b", text)
    if m is not None:
        what = f"`{m[1]}` already says that, without `{m[2]}`"
        return RecognisedError("E115", m.start(2), len(m[2]), what, f"such as `{m[1]} 5 s`")
    m = re.search(r"\bfor\s+each\s+of\s+([01])\b", text)
    if m is not None:
        what, expected = f"{m[1]} is not several", "a whole number of at least 2"
        return RecognisedError("E134", m.start(1), 1, what, expected)
    m = re.search(r"\brepeat(?:ed|s)?\b(?!\s*[(>])", text)
    if m is not None:
        what = f"`{m[0]}` is not how repetitions are written"
        expected = "`?`, `*`, `+` or `at least 2 times at most 3 times`"
        return RecognisedError("E134", m.start(), len(m[0]), what, expected)
    m = re.search(r"\bat\s+(least|most)\b(?!\s+\d{1,6}\s+times?\b)", text)
    if m is not None:
        what = f"`at {m[1]}` is not followed by a whole number and `times`"
        return RecognisedError("E134", m.start(), len(m[0]), what, f"`at {m[1]} 2 times`")
    m = re.search(r"[>)?*+]\s+((?:(?:exactly\s+)?\d+\s*(?:times?|x)|once|twice|thrice)\b)", text)
    if m is not None:
        what = f"`{m[1]}` is not how repetitions are written"
        word, number = m[1].split()[0], re.search(r"\d+", m[1])
        n = number[0] if number else {"once": "1", "twice": "2"}.get(word, "3")
        expected = f"`at least {n} times at most {n} times`"
        return RecognisedError("E134", m.start(1), len(m[1]), what, expected)
    return None


def any_order(text: str) -> RecognisedError | None:
    """`any order` without its list."""
    m = re.search(r"\b(?:in\s+)?any\s+order\b(?!\s*\([^()]*(?:\([^()]*\)[^()]*)*,)", text)
    m = m or re.search(r"\bin\s+any\s+order\b", text)
    if m is None:
        return None
    what = f"`{' '.join(m[0].split())}` is not followed by a list in brackets"
    if re.match(r"\s*\(", text[m.end() :]):
        what = "`any order` needs at least two things, separated by commas"
    if m[0].startswith("in"):
        what = "`in` is not written before `any order`"
    return RecognisedError("E135", m.start(), len(m[0]), what, "`any order (<a>, <b>)`")


def joining_word(text: str) -> RecognisedError | None:
    """`then`, `and` and the like between stages."""
    words = "and|then|or|with|next|followed"
    if re.search(r"\bwhen\b|^\s*(?:never|always)\b", text):
        words = "then|with|next|followed"  # conditions have `and` and `or`
    m = re.search(rf"(?:[>)?*+]|\d\s*[\w/%]+)\s+({words})\b(?=\s+[<\w(])", text, re.I)
    if m is None:
        return None
    hint = "in turn is `<a> <b>`, either is `<a> | <b>`, at the same time is `<a> & <b>`"
    what = f"`{m[1]}` between stages"
    return RecognisedError("E119", m.start(1), len(m[1]), what, "the next stage, `|` or `&`", hint)


def full_stop(text: str) -> RecognisedError | None:
    """A rule ending in `.` or `;`."""
    m = re.search(r"([.;])\s*$", text)
    if m is None:
        return None
    what = f"`{m[1]}` at the end of a rule"
    return RecognisedError(
        "E120", m.start(1), 1, what, hint="a rule ends where the next one begins"
    )


def repeat_in_front(text: str) -> RecognisedError | None:
    """A repetition mark without operand, or doubled."""
    m = re.search(r"(?:::=|[|&(])\s*([?*+])|([?*+])\s*([?*+])|\s([?*+])[ ]*(?=[<(\w])", text)
    if m is None:
        return None
    group = next(i for i in (1, 3, 4) if m[i])
    mark = m[group]
    what = f"`{mark}` does not follow the one thing that it repeats"
    expected = f"such as `<approach>{mark}` or `( ... ){mark}`"
    return RecognisedError("E126", m.start(group), 1, what, expected)


def mixed_names(text: str) -> RecognisedError | None:
    """A bare name among actions and stages."""
    m = re.search(rf"(?<![<\w(,])[ ]+({NAME})(?=\s+(?:<|\(|{NAME}\s*[(<])|\s*[|&?*+])", text)
    if m is None or m[1] in RESERVED_WORDS:
        return None
    start, what = m.start(1), f"`{m[1]}` is neither an action with actors nor a stage"
    return RecognisedError("E103", start, len(m[1]), what, f"`<{m[1]}>` or `{m[1]}(...)`")
