"""Mistakes that people make in a statement, each recognised by how it looks.

The first recogniser that finds its mistake names it, so the surest ones stand first. Those of a
statement as a whole stand here, those inside a course in `slips.py`.
"""

from __future__ import annotations

import re

from visup.tasks.chunk import NAME, WORDS, Chunk, Mistake, Recogniser
from visup.tasks.faults import Source, TaskFault
from visup.tasks.slips import (
    action_in_angles,
    brackets,
    clause,
    commas,
    empty_part,
    full_stop,
    joining_word,
    mixed_names,
    no_actors,
    open_angle,
    operators,
    repeat_in_front,
)


def name_mistake(chunk: Chunk, source: Source) -> TaskFault | None:
    """The fault of a statement when it is one that people make, or None."""
    for recognise in RECOGNISERS:
        m = recognise(chunk.text)
        if m is not None:
            place = source.place(*chunk.position(m.start), m.length)
            return TaskFault(m.code, m.what, place, expected=m.expected, hint=m.hint)
    return None


def _foreign_comment(text: str) -> Mistake | None:
    m = re.search(r"//|/\*|(?<!\S)--|(?m:^\s*[%;])", text)
    if m is None:
        return None
    mark = m[0].strip()
    start = m.end() - len(mark)
    return Mistake("E121", start, len(mark), f"`{mark}` does not begin a comment", "`#`")


def _not_in_language(text: str) -> Mistake | None:
    m = re.match(r"\s*(include|import|task|zone|param|parameter|stage)\b(?=[ ]+[\w<\"'./])", text)
    if m is not None:
        what = f"`{m[1]}` is not part of the language of task files"
        return Mistake("E127", m.start(1), len(m[1]), what, "a rule, `actor`, `never` or `always`")
    m = re.search(r"\b(?:at\s+(?:least|most)\b|(?:until|unless|after|before)\b)", text)
    if m is not None:
        what = f"`{' '.join(m[0].split())}` is not part of the language of task files"
        hint = "repetitions are written `?`, `*`, `+`; times `for` and `within`"
        return Mistake("E127", m.start(), len(m[0]), what, hint=hint)
    return None


def _definer(text: str) -> Mistake | None:
    m = re.match(rf"\s*<[ ]*{NAME}[ ]*>\s*(?!::=(?!=))(::==+|:=|==|=>|=|::(?!=)|:|->|→)", text)
    if m is None:
        return None
    what = f"`{m[1]}` stands where `::=` should"
    return Mistake("E102", m.start(1), len(m[1]), what, "`::=` after the name of a stage")


def _bare_head(text: str) -> Mistake | None:
    m = re.match(rf"\s*({NAME})\s*(?:::=|:=|=)", text)
    if m is None or m[1] in WORDS:
        return None
    what = f"the name of stage `{m[1]}` stands without angle brackets"
    return Mistake("E103", m.start(1), len(m[1]), what, f"`<{m[1]}> ::= ...`")


def _open_head(text: str) -> Mistake | None:
    m = re.match(rf"\s*(<[ ]*({NAME}))\s*(?:::=|:=|=)", text)
    if m is not None:
        return Mistake(
            "E107", m.start(1), len(m[1]), f"`<{m[2]}` is not closed", f"`<{m[2]}> ::= ...`"
        )
    m = re.match(rf"\s*({NAME})[ ]*>", text)
    if m is not None:
        what = f"`{m[1]}>` is not opened"
        return Mistake("E107", m.start(1), len(m[1]) + 1, what, f"`<{m[1]}>`")
    return None


def _not_a_name(text: str) -> Mistake | None:
    for m in re.finditer(r"<([^<>()|&\n]*)>", text):
        inner = m[1].strip()
        if re.fullmatch(NAME, inner):
            continue
        said = f"`{inner}` is not a name" if inner else "a name is missing between `<` and `>`"
        hint = None
        made = re.sub(r"\W+", "_", inner).strip("_")
        if re.fullmatch(NAME, made):
            hint = f"letters, digits and `_` make a name, such as `<{made}>`"
        expected = "a name that begins with a letter"
        return Mistake("E108", m.start(), len(m[0]), said, expected, hint)
    return None


def _empty_stage(text: str) -> Mistake | None:
    m = re.fullmatch(rf"\s*(<[ ]*({NAME})[ ]*>)\s*::=\s*", text)
    if m is None:
        return None
    return Mistake(
        "E109",
        m.start(1),
        len(m[1]),
        f"stage `<{m[2]}>` asks for nothing",
        "actions or stages after `::=`",
    )


def _word_as_name(text: str) -> Mistake | None:
    words = "|".join(WORDS)
    m = re.search(rf"\((?:[^()]*,)?\s*({words})\s*[,)]|\b({words})\s*\(", text)
    if m is None:
        return None
    word = m[1] or m[2]
    start = m.start(1) if m[1] else m.start(2)
    return Mistake("E123", start, len(word), f"`{word}` is a word of the language", "another name")


def _actor(text: str) -> Mistake | None:
    m = re.match(rf"\s*actor\b\s*({NAME})?\s*(\S*)", text)
    if m is None:
        return None
    expected = "`actor satellite is spartan or hubble`"
    if m[1] is None or m[1] in WORDS:
        return Mistake("E124", m.start(), 5, "the name of the actor is missing", expected)
    if m[2] == "is":
        hint = "several models are parted by `or`" if re.search(r"[,|/]|\band\b", text) else None
        what = f"actor `{m[1]}` is declared with something that is not a model"
        if not text[m.end() :].strip(" "):
            what = f"actor `{m[1]}` is declared without a model"
        return Mistake("E124", m.start(1), len(m[1]), what, expected, hint)
    what = f"`is` is missing after actor `{m[1]}`"
    return Mistake("E124", m.start(1), len(m[1]), what, expected)


def _invariant(text: str) -> Mistake | None:
    m = re.match(r"\s*(never|always)\b", text)
    if m is None:
        return None
    what = f"`{m[1]}` is not followed by one action"
    expected = f"`{m[1]} touching(arm, radiator)`, perhaps with `during <stage>`"
    return Mistake("E125", m.start(1), len(m[1]), what, expected)


RECOGNISERS: tuple[Recogniser, ...] = (
    _foreign_comment,
    _not_in_language,
    _definer,
    _bare_head,
    _open_head,
    _actor,
    _not_a_name,
    _empty_stage,
    open_angle,
    brackets,
    action_in_angles,
    _invariant,
    operators,
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
