"""Hints that have been tried: for each mistake of a task file the change that makes it go away.

What a mistake usually means is in one table, by its code; a change is offered only when the file has
fewer mistakes after it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import islice

from visup.rules.correction.edits import ALIKE, Repair, edits, hint_of
from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.fixes import fix_of
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.checks.additions import added
from visup.tasks.checks.corrections import corrected, said
from visup.tasks.checks.usual_meanings import NAME, USUAL
from visup.tasks.diagnostics.recovery import KEYWORDS
from visup.tasks.grammar.statement import RESERVED_WORDS
from visup.tasks.grammar.units import UNITS

CHARACTERS_TRIED = 60_000
"""Of changes of one file: of a long file with many mistakes only the first have a tried hint."""
MOST_HINTS = 12
MOST_CORRECTIONS, MOST_READINGS = 12, 3000
"""Of one statement: changes of several words that are tried, and readings followed to find them."""
READING_COST = 1
"""To follow a reading of a statement takes as long as to check so many characters of a file."""

Check = Callable[[str], Sequence[Diagnostic]]

WORDS = (*RESERVED_WORDS, *ACTIONS, *KEYWORDS, "leftmost", "rightmost", "ignored")
LONE_WORD = re.compile(rf"(?<![<\w.]){NAME}(?![\w>(])")
"""A word that is neither an action nor a stage."""
PHRASES = ("at least", "at most", "any order", "for each", "on failure of", "ends when", "fails when",
           "begins when", "pauses when", "progresses when", "each of", "each new")  # fmt: skip
MEANT_WORDS = (*KEYWORDS, *PHRASES, "during", "leftmost", "rightmost", "largest", "smallest", "highest",
               "lowest", "left", "right", "top", "bottom")  # fmt: skip
OTHER_WORDS = {"biggest": "largest", "tallest": "largest", "longest": "largest", "tiniest": "smallest",
               "topmost": "highest", "uppermost": "highest", "bottommost": "lowest"}  # fmt: skip
"""What people say in place of a word of the language, though it is spelt otherwise."""


def with_tried_hints(
    text: str, faults: Sequence[Diagnostic], check: Check
) -> tuple[Diagnostic, ...]:
    """The faults, each with a change that has been tried, where one is known.

    Args:
        text: The file.
        faults: Its faults.
        check: The faults of a text.
    """
    trial, found = _HintTrial(text, faults, check), []
    for number, fault in enumerate(faults):
        hint = None
        if number < MOST_HINTS and trial.left > 0 and not trial.helps(fault):
            hint = trial.mend(fault)
        said = None if fix_of(text, fault.place, fault.hint) else fault.hint  # what helps nothing
        found.append(fault if hint is None else replace(fault, hint=_joined(said, hint)))
    return tuple(found)


FAULT_COST = 100
"""A fault takes as long to explain as so many characters take to read, or longer."""
LONGEST_HINT = 400
"""Characters of a hint: what is longer, nobody reads."""
NOTHING, ONE_STEP, IN_PART, WHOLLY = range(4)
"""How much a change helps: not; so that the next fault lies further on; by what could not be read only; or
by a fault and to no new one."""


@dataclass
class _HintTrial:
    """Changes of a text, tried while there is patience.

    Attributes:
        text: The file.
        faults: Its faults.
        check: The faults of a text.
        left: Characters that may still be read.
    """

    text: str
    faults: Sequence[Diagnostic]
    check: Check
    left: int = CHARACTERS_TRIED

    def mend(self, fault: Diagnostic) -> str | None:
        """A hint that helps: what is usually meant before small edits, one step before none."""
        found: list[tuple[str | None, int]] = []
        for hints in (_hints(self.text, fault), self.corrected(fault), self.edited(fault)):
            keep = fault.code < "E2" and bool(found) and found[0][1] > ONE_STEP
            # What is usually meant, and helps in part, goes before leaving words out.
            hint, helps = self.best(
                fault, (h for h in hints if not (keep and h.startswith("leave")))
            )
            if helps == WHOLLY:
                return hint
            found.append((hint, helps))
        usual, _, edit = found
        return edit[0] if usual[1] <= ONE_STEP < edit[1] else usual[0]

    def edited(self, fault: Diagnostic) -> Iterator[str]:
        """Small edits; of what cannot be read first, since what else is wrong may follow from it."""
        if fault.code < "E2" or all(f.code >= "E2" for f in self.faults):
            yield from _edits(fault)

    def corrected(self, fault: Diagnostic) -> Iterator[str]:
        """Changes of several words of a statement that cannot be read."""
        readings = MOST_READINGS

        def may_go_on() -> bool:
            nonlocal readings
            readings -= 1
            self.left -= READING_COST
            return readings > 0 and self.left > 0

        if fault.code < "E2":
            yield from islice(corrected(self.text, fault.place, may_go_on), MOST_CORRECTIONS)

    def best(self, fault: Diagnostic, hints: Iterable[str]) -> tuple[str | None, int]:
        """The first hint that helps wholly, else the first that helps most; and how much."""
        partly: str | None = None
        most = NOTHING
        for hint in hints:
            if len(hint) > LONGEST_HINT or "..." in hint:
                continue
            self.left -= len(self.text) + FAULT_COST * len(self.faults)
            if self.left < 0:
                break
            helps = self.helps(replace(fault, hint=hint))
            if helps == WHOLLY:
                return hint, WHOLLY
            if helps > most:
                partly, most = hint, helps
        return partly, most

    def helps(self, fault: Diagnostic) -> int:
        """How much the change helps that a hint speaks of."""
        fix = fix_of(self.text, fault.place, fault.hint)
        if fix is None:
            return NOTHING
        after = self.check(fix.applied(self.text))
        known = told(self.faults)
        if len(after) < len(self.faults) and all((f.code, f.message) in known for f in after):
            return WHOLLY
        # What could not be read hid what comes to light now.
        unread = [sum(f.code < "E2" for f in found) for found in (after, self.faults)]
        if fault.code >= "E2":
            return self.left_over(fault, after)
        if unread[0] < unread[1]:
            return IN_PART
        new = [f for f in after if (f.code, f.message) not in known]
        further = all(_at(f) > _at(fault) for f in new) and len(after) <= len(self.faults)
        return ONE_STEP if further and (fault.code, fault.message) not in told(after) else NOTHING

    def left_over(self, fault: Diagnostic, after: Sequence[Diagnostic]) -> int:
        """How much a change helps after which only something stands there that nobody uses any more."""
        known = told(self.faults)
        new = {f.code for f in after if (f.code, f.message) not in known}
        gone = (fault.code, fault.message) not in told(after)
        return IN_PART if gone and new <= set(UNUSED) else NOTHING


UNUSED = ("E204", "E213", "E225")
"""Codes of what is defined and takes no part, which can always be left out."""


def told(faults: Sequence[Diagnostic]) -> set[tuple[str, str]]:
    """The messages of faults, regardless of position."""
    return {(f.code, f.message) for f in faults}


def _at(fault: Diagnostic) -> tuple[int, int]:
    return fault.place.line, fault.place.column


def _joined(said: str | None, hint: str) -> str:
    return hint if said is None else f"{said}; {hint}"


def _hints(text: str, fault: Diagnostic) -> Iterator[str]:
    line = fault.place.text
    if fault.code < "E2":
        yield from _misspelt(line, fault.place.column - 1)
    for usual in USUAL:
        if fault.code not in usual.codes:
            continue
        matches = list(usual.pattern.finditer(line))
        for match in sorted(matches, key=lambda m: _away(m, fault.place.column - 1)):
            new = match.expand(usual.new) if isinstance(usual.new, str) else usual.new(match)
            if new != match[0]:
                yield _placed(text, fault, match, new)
    yield from _as_expected(fault)
    yield from added(text, fault)


def _placed(text: str, fault: Diagnostic, match: re.Match[str], new: str) -> str:
    """A change as a hint; with words around it where without them it would mean another place."""
    line = fault.place.text
    plain = _hint(line, match, new, fault.place.column - 1)
    fix = fix_of(text, fault.place, plain)
    if fix is None or not match[0].strip() or fix.line != fault.place.line:
        return plain
    begin = sum(len(row) + 1 for row in text.split("\n")[: fault.place.line - 1])
    if (
        fix.column - 1 <= match.start() + len(match[0])
        and match.start() <= fix.column - 1 + fix.length
    ):
        return plain
    return said(text, fault.place, Repair(begin + match.start(), begin + match.end(), new)) or plain


def _misspelt(line: str, at: int) -> Iterator[str]:
    """Words of the language in the place of words that are spelt nearly so, nearest to the caret first."""
    for match in sorted(LONE_WORD.finditer(line), key=lambda m: _away(m, at)):
        if match[0] in OTHER_WORDS:
            yield _hint(line, match, OTHER_WORDS[match[0]], at)
        elif match[0] not in MEANT_WORDS:
            for meant in get_close_matches(match[0].lower(), MEANT_WORDS, n=3, cutoff=ALIKE):
                yield _hint(line, match, meant, at)


def _as_expected(fault: Diagnostic) -> Iterator[str]:
    """What is expected, where that is the same in other signs, or another unit."""
    at = fault.place.column - 1
    said = fault.place.text[at : at + fault.place.length].strip()
    shown = re.findall(r"`([^`]+)`", fault.expected or "")
    if len(shown) != 1 or not said:
        return
    if shown[0].startswith("<") and said.isidentifier():
        yield f"write `<{said}>` in place of `{said}`"
    amount = re.match(r"-?[\d.]+(?=\s*\S)", said)
    if amount and shown[0] in UNITS:
        yield f"write `{amount[0]} {shown[0]}` in place of `{said}`"
    elif set(re.findall(r"\w+", shown[0])) == set(re.findall(r"\w+", said)):
        yield f"write `{shown[0]}` in place of `{said}`"


def _edits(fault: Diagnostic) -> Iterator[str]:
    """Where nothing usual is meant: small edits next to the fault."""
    place = fault.place
    unread = fault.code < "E2"
    for repair in edits(place.text, place.column - 1, place.length, WORDS, unread=unread):
        hint = hint_of(place.text, repair)
        if hint is not None:
            yield hint


def _away(match: re.Match[str], at: int) -> int:
    """How far a match lies from the caret; 0 when it holds it."""
    return (
        0
        if match.start() <= at <= match.end()
        else min(abs(match.start() - at), abs(match.end() - at))
    )


def _hint(line: str, match: re.Match[str], new: str, at: int) -> str:
    """The change in words that `fix_of` understands, from the caret on or with the place named."""
    old = match[0]
    if not old.strip():
        before = re.search(r"\S+\s*$", line[: match.start()])
        word = before[0].strip() if before else ""
        return f"write `{word}{new.strip()}` in place of `{word}`"
    if not new.strip():
        return f"leave `{old.strip()}` out"
    return f"write `{' '.join(new.split())}` in place of `{' '.join(old.split())}`"
