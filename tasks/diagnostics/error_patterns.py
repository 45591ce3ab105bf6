"""Common errors in statements, each recognised by a pattern of the text.

The first matching pattern determines the error, so the most reliable ones come first. Patterns of whole
statements are here, those inside a course in `course_error_patterns.py`.
"""

from __future__ import annotations

import re

from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.diagnostics.actor_error_patterns import actor, bystanders, criteria
from visup.tasks.diagnostics.course_error_patterns import (
    action_in_angles,
    any_order,
    brackets,
    clause,
    commas,
    empty_part,
    full_stop,
    joining_word,
    mixed_names,
    no_actors,
    no_brackets,
    open_angle,
    operators,
    periodic,
    repeat_in_front,
    signs,
    times,
)
from visup.tasks.grammar.statement import (
    NAME,
    PARAMETERS,
    RESERVED_WORDS,
    ErrorPattern,
    RecognisedError,
    StatementText,
)


def recognise_error(chunk: StatementText, source: Source) -> Diagnostic | None:
    """The fault of a statement if it is a common one, or None."""
    for recognise in PATTERNS:
        m = recognise(chunk.text)
        if m is not None:
            place = source.place(*chunk.position(m.start), m.length)
            return Diagnostic(m.code, m.what, place, expected=m.expected, hint=m.hint)
    return None


def _foreign_comment(text: str) -> RecognisedError | None:
    m = re.search(r"//|/\*|(?<!\S)--|(?m:^\s*[%;])", text)
    if m is None:
        return None
    mark = m[0].strip()
    start = m.end() - len(mark)
    return RecognisedError("E121", start, len(mark), f"`{mark}` does not begin a comment", "`#`")


def _not_in_language(text: str) -> RecognisedError | None:
    m = re.match(r"\s*(import|param|stage)\b(?=[ ]+[\w<\"'./])", text)
    if m is not None:
        what = f"`{m[1]}` is not part of the language of task files"
        meant = {"import": '`include "common.task"`', "stage": "`<approach> ::= ...`"}
        expected = meant.get(m[1], "`parameter patience is 90 s`")
        return RecognisedError("E127", m.start(1), len(m[1]), what, expected)
    m = re.search(
        r"(?<=[\s)>])(?:until|unless|after(?!\s*[\d-])|before|while|if)\b(?!\s*[,)])", text
    )
    if m is not None:
        what = f"`{m[0]}` is not part of the language of task files"
        hint = "in turn is `<a> <b>`, at the same time `<a> & <b>`; a stage `ends when ...`"
        return RecognisedError("E127", m.start(), len(m[0]), what, hint=hint)
    return None


def _heading(text: str) -> RecognisedError | None:
    m = re.match(r"\s*((task|actor|stage|zone|parameter)s?)\s*:(?!:=)", text, re.I)
    if m is None:
        return None
    meant = {
        "task": "`task <dock> ::= ...`",
        "stage": "`<approach> ::= ...`",
        "zone": "`zone berth is (100, 50) (300, 50) (300, 200)`",
        "parameter": "`parameter patience is 90 s`",
    }
    expected = meant.get(m[2].lower(), "`actor satellite is spartan or hubble`")
    what = f"`{m[1]}:` does not begin a statement"
    return RecognisedError("E127", m.start(1), m.end() - m.start(1), what, expected)


def _definer(text: str) -> RecognisedError | None:
    m = re.match(
        rf"\s*<[ ]*{NAME}{PARAMETERS}[ ]*>\s*(?!::=(?!=))(::==+|:=|==|=>|=|::(?!=)|:|->|→)", text
    )
    if m is None:
        return None
    what = f"`{m[1]}` stands where `::=` should"
    return RecognisedError("E102", m.start(1), len(m[1]), what, "`::=` after the name of a stage")


def _bare_head(text: str) -> RecognisedError | None:
    m = re.match(rf"\s*({NAME}{PARAMETERS})\s*(?:::=|:=|=)", text)
    if m is None or m[1] in RESERVED_WORDS:
        return None
    what = f"the name of stage `{m[1]}` is written without angle brackets"
    return RecognisedError("E103", m.start(1), len(m[1]), what, f"`<{m[1]}> ::= ...`")


def _open_head(text: str) -> RecognisedError | None:
    m = re.match(rf"\s*[\[({{]\s*({NAME}{PARAMETERS})\s*[\])}}]\s*(?:::=|:=|=)", text)
    if m is not None:
        what = f"the name of stage `{m[1]}` is not written in angle brackets"
        return RecognisedError("E103", m.start(1), len(m[1]), what, f"`<{m[1]}> ::= ...`")
    m = re.match(rf"\s*(<[ ]*({NAME}{PARAMETERS}))\s*(?:::=|:=|=)", text)
    if m is not None:
        return RecognisedError(
            "E107", m.start(1), len(m[1]), f"`<{m[2]}` is not closed", f"`<{m[2]}> ::= ...`"
        )
    m = re.match(rf"\s*({NAME})[ ]*>", text)
    if m is not None:
        what = f"`{m[1]}>` is not opened"
        return RecognisedError("E107", m.start(1), len(m[1]) + 1, what, f"`<{m[1]}>`")
    return None


def _not_a_name(text: str) -> RecognisedError | None:
    for m in re.finditer(r"<([^<>()|&\n]*)>", text):
        inner = m[1].strip()
        if re.fullmatch(rf"{NAME}{PARAMETERS}", inner):
            continue
        said = f"`{inner}` is not a name" if inner else "a name is missing between `<` and `>`"
        hint = None
        made = re.sub(r"\W+", "_", inner).strip("_")
        if re.fullmatch(NAME, made):
            hint = f"letters, digits and `_` make a name, such as `<{made}>`"
        expected = "a name that begins with a letter"
        return RecognisedError("E108", m.start(), len(m[0]), said, expected, hint)
    return None


def _empty_stage(text: str) -> RecognisedError | None:
    m = re.fullmatch(rf"\s*(<[ ]*({NAME}{PARAMETERS})[ ]*>)\s*::=\s*", text)
    if m is None:
        return None
    return RecognisedError(
        "E109",
        m.start(1),
        len(m[1]),
        f"stage `<{m[2]}>` asks for nothing",
        "actions or stages after `::=`",
    )


def _word_as_name(text: str) -> RecognisedError | None:
    words = "|".join(RESERVED_WORDS)
    m = re.search(rf"\((?:[^()]*,)?\s*({words})\s*[,)]|\b({words})\s*\(", text)
    if m is None:
        return None
    word = m[1] or m[2]
    start = m.start(1) if m[1] else m.start(2)
    return RecognisedError("E123", start, len(word), f"`{word}` is a reserved word", "another name")


def _include(text: str) -> RecognisedError | None:
    m = re.match(r"\s*(include)\b", text)
    if m is None:
        return None
    what = "`include` is not followed by a file name in double quotes"
    return RecognisedError("E130", m.start(1), 7, what, '`include "common.task"`')


def _zone(text: str) -> RecognisedError | None:
    m = re.match(rf"\s*(zone)\b\s*({NAME})?\s*(is\b)?", text)
    if m is None:
        return None
    what = "the name of the zone is missing"
    if m[2]:
        corner = r"\(\s*[\d.]+\s*(?:[^\W\d]+\s*)?,\s*[\d.]+\s*(?:[^\W\d]+\s*)?\)"
        corners = len(re.findall(corner, text))
        what = f"zone `{m[2]}` is drawn with something that is not a corner"
        what = f"zone `{m[2]}` has fewer than three corners" if corners < 3 else what
        what = what if m[3] else f"`is` is missing after zone `{m[2]}`"
    start = m.start(2) if m[2] else m.start(1)
    expected = f"`zone {m[2] or 'berth'} is (100, 50) (300, 50) (300, 200)`, in pixels"
    return RecognisedError("E131", start, len(m[2] or m[1]), what, expected)


def _ground(text: str) -> RecognisedError | None:
    m = re.match(r"\s*(ground)\b\s*(is\b)?", text)
    if m is None:
        return None
    pair = (
        r"\(\s*[\d.]+\s*,\s*[\d.]+\s*\)\s*=\s*\(\s*[\d.]+\s*[^\W\d]+\s*,\s*[\d.]+\s*[^\W\d]+\s*\)"
    )
    points = len(re.findall(pair, text))
    what = "`ground` is given something that is not a point of the image and its place on the floor"
    what = "`ground` is given fewer than four points" if points < 4 and m[2] else what
    what = what if m[2] else "`is` is missing after `ground`"
    expected = "`ground is (80, 400) = (0 m, 0 m), ...`, four points or more"
    return RecognisedError("E136", m.start(1), 6, what, expected)


def _parameter(text: str) -> RecognisedError | None:
    m = re.match(rf"\s*(parameter)\b\s*({NAME})?\s*(is\b)?", text)
    if m is None:
        return None
    what = "the name of the parameter is missing"
    if m[2]:
        what = f"parameter `{m[2]}` is not given a number and a unit"
        what = what if m[3] else f"`is` is missing after parameter `{m[2]}`"
    start = m.start(2) if m[2] else m.start(1)
    expected = f"`parameter {m[2] or 'patience'} is 90 s`"
    return RecognisedError("E132", start, len(m[2] or m[1]), what, expected)


def _invariant(text: str) -> RecognisedError | None:
    m = re.match(r"\s*(never|always)\b", text)
    if m is None:
        return None
    place = re.search(r"\b(?:in|while|at)\s+(?=<)", text)
    if place is not None:
        what = f"`{place[0].strip()}` stands where `during` should"
        return RecognisedError(
            "E125", place.start(), len(place[0].strip()), what, "`during <approach>`"
        )
    what = f"`{m[1]}` is not followed by a condition"
    expected = f"`{m[1]} touching(arm, radiator)`, perhaps with `during <stage>`"
    return RecognisedError("E125", m.start(1), len(m[1]), what, expected)


PATTERNS: tuple[ErrorPattern, ...] = (
    _foreign_comment,
    _heading,
    _include,
    _zone,
    _ground,
    _parameter,
    signs,
    periodic,
    _not_in_language,
    _definer,
    _bare_head,
    _open_head,
    criteria,
    bystanders,
    actor,
    _not_a_name,
    _empty_stage,
    open_angle,
    brackets,
    action_in_angles,
    times,
    any_order,
    _invariant,
    operators,
    no_brackets,
    no_actors,
    empty_part,
    _word_as_name,
    clause,
    commas,
    joining_word,
    full_stop,
    repeat_in_front,
    mixed_names,
)
