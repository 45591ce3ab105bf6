"""Mistakes that people make, each recognised by how it looks in a statement that does not parse.

The first recogniser that finds its mistake names it, so the surest ones stand first.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from visup.tasks.faults import Source, TaskFault

NAME = r"[^\W\d]\w*"
WORDS = ("actor", "is", "or", "never", "always", "during", "for", "within")


@dataclass(frozen=True, slots=True)
class Chunk:
    """A statement that does not parse, and where it begins in its file (counted from 1)."""

    text: str
    line: int
    column: int

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column in the file of an offset in the statement."""
        row = self.text.count("\n", 0, offset)
        start = self.text.rfind("\n", 0, offset) + 1
        return self.line + row, offset - start + (self.column if row == 0 else 1)

    @property
    def end(self) -> tuple[int, int]:
        """Line and column just behind its last character."""
        return self.position(len(self.text))


@dataclass(frozen=True, slots=True)
class Mistake:
    """A recognised mistake: offsets in the statement, and what is said of it."""

    code: str
    start: int
    length: int
    what: str
    expected: str | None = None
    hint: str | None = None


Recogniser = Callable[[str], Mistake | None]


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


def _open_angle(text: str) -> Mistake | None:
    m = re.search(rf"<[ ]*({NAME})(?![ ]*>|\w)", text)
    if m is not None:
        return Mistake("E107", m.start(), len(m[0]), f"`<{m[1]}` is not closed", f"`<{m[1]}>`")
    m = re.search(rf"(?<![<\w ])[ ]+({NAME})[ ]*>", text)
    if m is not None:
        what = f"`{m[1]}>` is not opened"
        return Mistake("E107", m.start(1), len(m[1]) + 1, what, f"`<{m[1]}>`")
    return None


def _brackets(text: str) -> Mistake | None:
    m = re.search(r"[\[\]{}]", text)
    if m is not None:
        what = f"`{m[0]}` is no bracket of the language"
        hint = "what may be left out is written `( ... )?`, what is repeated `( ... )*`"
        return Mistake("E112", m.start(), 1, what, "`(` and `)` for groups and actors", hint)
    opened: list[int] = []
    for m in re.finditer(r"[()]", text):
        if m[0] == "(":
            opened.append(m.start())
        elif opened:
            opened.pop()
        else:
            return Mistake("E111", m.start(), 1, "`)` has no `(` before it")
    if opened:
        return Mistake("E110", opened[0], 1, "`(` is not closed", "`)`")
    return None


def _action_in_angles(text: str) -> Mistake | None:
    m = re.search(rf"<[ ]*({NAME})[ ]*>[ ]*\((?=[ ]*{NAME}[ ]*,)", text)
    if m is None:
        return None
    what = f"action `{m[1]}` is written in angle brackets"
    return Mistake("E113", m.start(), len(m[0].rstrip("( ")), what, f"`{m[1]}(...)`")


def _operators(text: str) -> Mistake | None:
    m = re.search(r"\|\||&&", text)
    if m is not None:
        what = f"`{m[0]}` is written once in this language"
        return Mistake("E122", m.start(), 2, what, f"`{m[0][0]}`")
    m = re.search(r"[>)\w]\s+(/)\s+[<(\w]", text)
    if m is not None:
        return Mistake("E122", m.start(1), 1, "`/` does not part alternatives", "`|`")
    return None


def _empty_part(text: str) -> Mistake | None:
    m = re.search(r"(?:::=|[(|&])\s*([|&])|([|&])\s*(?:\)|[|&]|$)|\(\s*\)(?<![\w]\))", text)
    if m is None:
        return None
    for group, side in ((1, "before"), (2, "after")):
        if m[group]:
            what = f"nothing stands {side} `{m[group]}`"
            return Mistake("E114", m.start(group), 1, what, "an action, a stage or a group")
    return None


def _no_actors(text: str) -> Mistake | None:
    m = re.search(rf"({NAME})[ ]*\(\s*\)", text)
    if m is not None:
        what = f"action `{m[1]}` has no actors"
        return Mistake("E118", m.start(1), len(m[0]), what, f"`{m[1]}(arm, satellite)`")
    m = re.search(r"\(\s*\)", text)
    if m is not None:
        return Mistake(
            "E114", m.start(), len(m[0]), "an empty group", "an action, a stage or a group"
        )
    return None


def _clause(text: str) -> Mistake | None:
    m = re.search(r"\b(for|within)\b\s*(-\s*\d\S*)", text)
    if m is not None:
        return Mistake(
            "E115", m.start(2), len(m[2]), "a duration is never negative", "a number and a unit"
        )
    m = re.search(r"\b(for|within)\b(?!\s*[\d-])(?!\s*\()", text)
    if m is not None:
        what = f"`{m[1]}` is not followed by a duration"
        return Mistake("E115", m.start(1), len(m[1]), what, f"such as `{m[1]} 5 s`")
    m = re.search(r"\b(for|within)\s+(\d+(?:\.\d+)?)(?![\d.]|[ ]*[^\W\d])", text)
    if m is not None:
        what = f"`{m[0]}` has no unit"
        expected = f"`s`, `min`, `ms` or `h`, such as `{m[1]} {m[2]} s`"
        return Mistake("E116", m.start(2), len(m[2]), what, expected)
    return None


def _commas(text: str) -> Mistake | None:
    m = re.search(rf"{NAME}[ ]*\([^()]*?({NAME})[ ]+({NAME})[^()]*\)", text)
    if m is not None:
        what = f"actors `{m[1]}` and `{m[2]}` are not parted by a comma"
        length = m.end(2) - m.start(1)
        return Mistake("E117", m.start(1), length, what, f"`{m[1]}, {m[2]}`")
    m = re.search(r"\([^()]*?(,\s*)(?=[,)])|\(\s*(,)", text)
    if m is not None:
        start = m.start(1) if m[1] else m.start(2)
        return Mistake("E117", start, 1, "no actor stands beside this comma", "an actor")
    m = re.search(r"[>)?*+]\s*(,|;(?=\s*[<\w]))", text)
    if m is not None:
        what = f"`{m[1]}` between stages"
        hint = "what comes next simply follows; at the same time is `&`"
        return Mistake("E119", m.start(1), 1, what, "the next stage", hint)
    return None


def _joining_word(text: str) -> Mistake | None:
    m = re.search(r"[>)?*+]\s+(and|then|or|while|with|next|followed)\b(?=\s+[<\w(])", text, re.I)
    if m is None:
        return None
    hint = "in turn is `<a> <b>`, either is `<a> | <b>`, at the same time is `<a> & <b>`"
    what = f"`{m[1]}` between stages"
    return Mistake("E119", m.start(1), len(m[1]), what, "the next stage, `|` or `&`", hint)


def _full_stop(text: str) -> Mistake | None:
    m = re.search(r"([.;])\s*$", text)
    if m is None:
        return None
    what = f"`{m[1]}` at the end of a rule"
    return Mistake("E120", m.start(1), 1, what, hint="a rule ends where the next one begins")


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


def _repeat_in_front(text: str) -> Mistake | None:
    m = re.search(r"(?:::=|[|&(])\s*([?*+])|([?*+])\s*([?*+])|\s([?*+])[ ]*(?=[<(\w])", text)
    if m is None:
        return None
    group = next(i for i in (1, 3, 4) if m[i])
    mark = m[group]
    what = f"`{mark}` does not stand behind one thing that it repeats"
    expected = f"such as `<approach>{mark}` or `( ... ){mark}`"
    return Mistake("E126", m.start(group), 1, what, expected)


def _mixed_names(text: str) -> Mistake | None:
    m = re.search(rf"(?<![<\w(,])[ ]+({NAME})(?=\s+(?:<|\(|{NAME}\s*[(<])|\s*[|&?*+])", text)
    if m is None or m[1] in WORDS:
        return None
    start, what = m.start(1), f"`{m[1]}` stands alone: neither an action with actors nor a stage"
    return Mistake("E103", start, len(m[1]), what, f"`<{m[1]}>` or `{m[1]}(...)`")


RECOGNISERS: tuple[Recogniser, ...] = (
    _foreign_comment,
    _not_in_language,
    _definer,
    _bare_head,
    _open_head,
    _actor,
    _not_a_name,
    _empty_stage,
    _open_angle,
    _brackets,
    _action_in_angles,
    _invariant,
    _operators,
    _no_actors,
    _empty_part,
    _word_as_name,
    _clause,
    _commas,
    _joining_word,
    _full_stop,
    _repeat_in_front,
    _mixed_names,
)
