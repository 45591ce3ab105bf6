"""Candidate edits near an error for which no usual slip is known.

This is independent of the language: words are inserted, replaced and dropped, nearest to the error first, and
the caller tries each (local error repair after Burke and Fisher 1987).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from visup.agent.model.did_you_mean import close_matches
from visup.rules.correction.everyday_phrases import NUMBERS

TOKEN = re.compile(r"::=|<[^<>\n]*>|\"[^\"\n]*\"|\w+(?:\.\d+)?|[<>=!]=|\S")
NEAR = 3
"""Words considered on either side of an error."""
WITHIN = (", 2 s", ", 20 px", ", b")
BEHIND_CALL = (" > 0", " < 5 px", " < 5 s", ")")
BEHIND_WORD = ("()", ")")
BETWEEN = (")", "(", ",", ">", "<", ":")
UNITS = ("s", "px", "px/s", "%", "samples")
ALIKE = 0.7
_OPERAND = re.compile(r"(?:\w+\([^()]*\)|<[^<>]*>|\b\w+)\s*\Z")
CONNECTIVES = ("and", "or", "&", "|", "implies", "iff", "xor", ",")


@dataclass(frozen=True, slots=True)
class Repair:
    """An edit of a text.

    begin: Start offset of the replaced text.
    end: Its end; equal to the start for an insertion.
    new: The replacement.
    old: The replaced text.
        old: What stood there.
    """

    begin: int
    end: int
    new: str
    old: str = ""

    def applied(self, text: str) -> str:
        """The edited text."""
        return text[: self.begin] + self.new + text[self.end :]

    def hint(self, text: str) -> str:
        """The edit in words."""
        old, new = " ".join(text[self.begin : self.end].split()), " ".join(self.new.split())
        if not old:
            return f"put `{new}` here"
        return f"write `{new}` in place of `{old}`" if new else f"leave `{old}` out"


def edits(
    line: str, begin: int, length: int, words: Sequence[str], *, unread: bool = True
) -> Iterator[Repair]:
    """Edits of a line, least destructive first.

    Args:
        line: The line of the error.
        begin: Start of the error in it.
        length: Length of the error.
        words: Possible meanings of an unknown word.
        unread: Whether the line does not parse, so that a sign may be missing.
    """
    end = min(len(line), begin + max(1, length))
    tokens = [(m.start(), m.end(), m[0]) for m in TOKEN.finditer(line)]
    # Words are dropped whole.
    end = max([end, *(stop for start, stop, _ in tokens if start < end <= stop)])
    yield from (Repair(at, at, new) for at, new in _insertions(line, begin, end))
    tokens.sort(key=lambda t: _distance(t, begin, end))
    near = tokens[: 2 * NEAR + 1]
    yield from _move_words(line, near, words)
    for _, stop, word in tokens:
        if word[:1].isdigit() and begin <= stop <= end:
            yield from (Repair(stop, stop, f" {unit}") for unit in UNITS)
    for start, stop, word in near:
        if word in NUMBERS:
            yield Repair(start, stop, NUMBERS[word])
        if word.isidentifier() and word not in words:
            yield from (Repair(start, stop, meant) for meant in _ranked(word, words))
    yield from _call_edits(line, begin)
    for start, _, _ in near if unread else ():
        yield from (Repair(start, start, f"{new} ") for new in BETWEEN)
    yield from (Repair(start, stop, "") for start, stop, _ in near)
    yield from _drop_unknown_words(line, near, words)
    yield from _drop_parts(line, begin, end, near)


def _move_words(
    line: str, near: Iterable[tuple[int, int, str]], words: Sequence[str]
) -> Iterator[Repair]:
    """A word of the language before the call or name that it follows."""
    for start, stop, word in near:
        before = _OPERAND.search(line[:start]) if word in words else None
        if before is not None and line[stop : stop + 1] != "(":
            yield Repair(before.start(), stop, f"{word} {before[0].rstrip()}")


def _ranked(word: str, words: Sequence[str]) -> list[str]:
    """Words spelt similarly, best first."""
    return close_matches(word, words, n=5, cutoff=ALIKE) if len(word) > 2 else []


def _insertions(line: str, begin: int, end: int) -> Iterator[tuple[int, str]]:
    if line[begin:end].endswith(")"):
        yield from ((end - 1, new) for new in WITHIN)
        yield from ((end, new) for new in BEHIND_CALL)
    elif line[begin:end].isidentifier():
        yield from ((end, new) for new in BEHIND_WORD)


def _call_edits(line: str, begin: int) -> Iterator[Repair]:
    """Drop an argument of a call, or the call around an argument."""
    name = re.compile(r"\w+\s*\(").match(line, begin)
    parts = list(_arguments(line, name.end())) if name else []
    if name is None or not parts or line[parts[-1][1] : parts[-1][1] + 1] != ")":
        return
    end = parts[-1][1] + 1
    said = [line[start:stop].strip() for start, stop in parts]
    for n in reversed(range(len(said))) if len(said) > 1 else ():
        left = ", ".join(said[:n] + said[n + 1 :])
        yield Repair(begin, end, f"{name[0]}{left})")
    for part in said:
        if not part.isidentifier():
            yield from (Repair(begin, end, f"{part}{more}") for more in ("", " > 0", " < 5 px"))


def _arguments(line: str, at: int) -> Iterator[tuple[int, int]]:
    """Start and end of each argument of a call, from after its bracket."""
    depth, start = 0, at
    for n in range(at, len(line)):
        depth += (line[n] == "(") - (line[n] == ")")
        if depth < 0 or (depth == 0 and line[n] == ","):
            yield start, n
            start = n + 1
        if depth < 0:
            return


def _drop_unknown_words(
    line: str, near: Iterable[tuple[int, int, str]], words: Sequence[str]
) -> Iterator[Repair]:
    """Drop several unknown words in a row, or replace them by a connective."""
    known, run = {*words, *CONNECTIVES}, r"[A-Za-z_]\w*(?:[ ]+[A-Za-z_]\w*)+(?![\w(])"
    places = {start for start, _, _ in near}
    for found in re.finditer(run, line):
        some = [m for m in re.finditer(r"\w+", found[0]) if m[0] not in known]
        if len(some) > 1 and any(found.start() <= at < found.end() for at in places):
            begin, end = found.start() + some[0].start(), found.start() + some[-1].end()
            joins = not line[:begin].rstrip().endswith(("(", ","))
            yield from (Repair(begin, end, new) for new in (("", "and", "&") if joins else ("",)))


def _drop_parts(
    line: str, begin: int, end: int, near: Iterable[tuple[int, int, str]]
) -> Iterator[Repair]:
    """Drop the error with its connective, then everything from a nearby word to the end of the line."""
    joints = "|".join(rf"\b{j}\b" if j.isalpha() else re.escape(j) for j in CONNECTIVES)
    before = re.search(rf"(?:{joints})\s*$", line[:begin])
    after = re.compile(rf"\s*(?:{joints})\s*").match(line, end)
    if before is not None:
        yield Repair(before.start(), end, "")
    if after is not None:
        yield Repair(begin, after.end(), "")
    yield Repair(begin, end, "")
    yield from _drop_clause(line, begin, end, joints)
    last = len(line.rstrip())
    for start, _, _ in sorted(near, key=lambda t: -t[0]):
        if start < last:
            yield Repair(start, last, "")


def _drop_clause(line: str, begin: int, end: int, joints: str) -> Iterator[Repair]:
    """Drop the clause between the connectives around an error, with one of them."""
    before = list(re.finditer(joints, line[:begin]))
    after = re.compile(joints).search(line, end)
    start = before[-1].start() if before else None
    if start is not None:
        yield Repair(start, after.start() if after else len(line.rstrip()), "")
    if after is not None:
        yield Repair(before[-1].end() + 1 if before else begin, after.end() + 1, "")


def _distance(token: tuple[int, int, str], begin: int, end: int) -> int:
    """Distance of a word from the error; 0 inside it."""
    start, stop, _ = token
    return max(0, start - end + 1, begin - stop + 1)


def hint_of(line: str, repair: Repair) -> str | None:
    """An edit in the words that `fix_of` understands; None if it cannot be anchored."""
    old, new = line[repair.begin : repair.end], repair.new
    if not old.strip():
        tokens = [m for m in TOKEN.finditer(line) if m.end() <= repair.begin]
        if not tokens:
            return None
        word = tokens[-1][0]
        gap = " " if new[:1].isalnum() or new[:1] == " " else ""
        # A sign alone may stand elsewhere as well, so all that is written together with it is named.
        word = word if word.isalnum() else line[: tokens[-1].end()].split()[-1]
        return f"write `{word}{gap}{new.strip()}` in place of `{word}`"
    if not new.strip() and old.isprintable():
        return f"leave `{' '.join(old.split())}` out"
    if not old.isprintable():
        return None
    return f"write `{new.strip()}` in place of `{' '.join(old.split())}`"


def offset_before(at: int, repairs: Sequence[Repair]) -> int:
    """Map an offset of a repaired text back to the text before all repairs."""
    for repair in reversed(repairs):
        if at >= repair.begin + len(repair.new):
            at -= len(repair.new) - len(repair.old)
        elif at > repair.begin:
            at = min(at, repair.begin + len(repair.old))
    return at
