"""Tested hints: for each mistake of a task file a change that removes it.

A table maps the codes of mistakes to their usual meanings; a change is offered only if the file has fewer
mistakes after it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from math import inf

from visup.agent.model.did_you_mean import close_matches
from visup.rules.correction.local_edits import ALIKE, Repair, edits, hint_of
from visup.rules.correction.meaning_loss import COMMON_FIX_BONUS, SMALL_LOSS, meaning_lost
from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.fixes import fix_of
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.checks.additions import added, by_names
from visup.tasks.checks.edit_costs import corrected, said
from visup.tasks.checks.foreign_forms import FOREIGN_FORMS
from visup.tasks.checks.usual_meanings import USUAL, recoveries
from visup.tasks.diagnostics.recovery import KEYWORDS
from visup.tasks.grammar.statement import NAME, RESERVED_WORDS
from visup.tasks.grammar.units import UNITS

CHARACTERS_TRIED = 60_000
"""Budget for the changes of one file: in a long file with many mistakes only the first have tested hints."""
MOST_HINTS = 12
MOST_COMPARED = 4
"""Changes that help completely and are compared by what they lose."""
MOST_CORRECTIONS, MOST_READINGS = 12, 3000
"""Per statement: corrections of several words that are tested, and parser states explored to find them."""
READING_COST = 1
"""Cost of exploring a parser state, in checked characters."""

Check = Callable[[str], Sequence[Diagnostic]]

WORDS = (*RESERVED_WORDS, *ACTIONS, *KEYWORDS, "leftmost", "rightmost", "ignored")
LONE_WORD = re.compile(rf"(?<![<\w.]){NAME}(?![\w>(])")
"""Matches a word that is neither an action nor a stage."""
PHRASES = ("at least", "at most", "any order", "for each", "on failure of", "ends when", "fails when",
           "begins when", "pauses when", "progresses when", "each of", "each new")  # fmt: skip
MEANT_WORDS = (*KEYWORDS, *PHRASES, "during", "leftmost", "rightmost", "largest", "smallest", "highest",
               "lowest", "left", "right", "top", "bottom")  # fmt: skip
OTHER_WORDS = {"biggest": "largest", "tallest": "largest", "longest": "largest", "tiniest": "smallest",
               "topmost": "highest", "uppermost": "highest", "bottommost": "lowest"}  # fmt: skip
"""Synonyms of words of the language."""


def with_tried_hints(
    text: str, faults: Sequence[Diagnostic], check: Check
) -> tuple[Diagnostic, ...]:
    """The faults, with a tested change as their hint if one is found.

    Args:
        text: The file.
        faults: Its faults.
        check: Returns the faults of a text.
    """
    trial, found = _HintTrial(text, faults, check), []
    for number, fault in enumerate(faults):
        hint = None
        if number < MOST_HINTS and trial.left > 0 and not trial.helps(fault):
            hint = trial.mend(fault)
        said = (
            None if fix_of(text, fault.place, fault.hint) else fault.hint
        )  # drop hints that do not help
        found.append(fault if hint is None else replace(fault, hint=_joined(said, hint)))
    return tuple(found)


FAULT_COST = 100
"""Least cost of explaining a fault, in checked characters."""
LONGEST_HINT = 400
"""Maximum characters of a hint; longer ones are not read."""
NOTHING, ONE_STEP, IN_PART, WHOLLY = range(4)
"""How much a change helps: not at all; it moves the next fault further on; it removes only syntax errors; or
it removes a fault and causes no new one."""


@dataclass
class _HintTrial:
    """Tests changes of a text within a budget.

    Attributes:
        text: The file.
        faults: Its faults.
        check: Returns the faults of a text.
        left: Remaining characters of the budget.
    """

    text: str
    faults: Sequence[Diagnostic]
    check: Check
    left: int = CHARACTERS_TRIED

    def mend(self, fault: Diagnostic) -> str | None:
        """A hint that helps: usual meanings before small edits, partial help before none."""
        found: list[tuple[str | None, int]] = []
        granted = COMMON_FIX_BONUS
        for hints in (_hints(self.text, fault), self.corrected(fault), self.edited(fault)):
            keep = fault.code < "E2" and bool(found) and found[0][1] > ONE_STEP
            # A usual meaning that helps partly is preferred to deleting words.
            hint, helps = self.best(
                fault, (h for h in hints if not (keep and h.startswith("leave"))), granted
            )
            if helps == WHOLLY and self.lost(fault, hint) - granted <= SMALL_LOSS:
                return hint
            found.append((hint, helps))
            granted = 0.0
        usual, _, edit = found
        whole = [hint for hint, helps in found if helps == WHOLLY]
        if whole:
            # What only leaves a definition unused may lose less than what removes the fault wholly.
            apart = [usual[0]] if fault.code >= "E2" and usual[1] == IN_PART else []
            return min(
                (*whole, *apart),
                key=lambda hint: (
                    self.lost(fault, hint) - (COMMON_FIX_BONUS if hint == usual[0] else 0.0)
                ),
            )
        return edit[0] if usual[1] <= ONE_STEP < edit[1] else usual[0]

    def edited(self, fault: Diagnostic) -> Iterator[str]:
        """Small edits; for syntax errors first, since other faults may follow from them."""
        if fault.code < "E2" or all(f.code >= "E2" for f in self.faults):
            yield from _edits(fault)

    def corrected(self, fault: Diagnostic) -> Iterator[str]:
        """Corrections of several words of a statement with a syntax error."""
        readings = MOST_READINGS

        def may_go_on() -> bool:
            nonlocal readings
            readings -= 1
            self.left -= READING_COST
            return readings > 0 and self.left > 0

        if fault.code < "E2":
            yield from islice(corrected(self.text, fault.place, may_go_on), MOST_CORRECTIONS)

    def best(
        self, fault: Diagnostic, hints: Iterable[str], granted: float
    ) -> tuple[str | None, int]:
        """The hint that helps most, and how much; of those that help wholly the first to lose little."""
        partly: str | None = None
        most = NOTHING
        whole: list[tuple[float, str]] = []
        for hint in hints:
            if len(hint) > LONGEST_HINT or "..." in hint:
                continue
            self.left -= len(self.text) + FAULT_COST * len(self.faults)
            if self.left < 0:
                break
            helps = self.helps(replace(fault, hint=hint))
            if helps == WHOLLY:
                whole.append((self.lost(fault, hint) - granted, hint))
                if whole[-1][0] <= SMALL_LOSS or len(whole) == MOST_COMPARED:
                    break
            elif helps > most:
                partly, most = hint, helps
        if whole:
            return min(whole, key=lambda found: found[0])[1], WHOLLY
        return partly, most

    def lost(self, fault: Diagnostic, hint: str | None) -> float:
        """What the change of a hint loses of the file."""
        fix = fix_of(self.text, fault.place, hint)
        return inf if fix is None else meaning_lost(self.text, fix.applied(self.text))

    def helps(self, fault: Diagnostic) -> int:
        """How much the change of a hint helps."""
        fix = fix_of(self.text, fault.place, fault.hint)
        if fix is None:
            return NOTHING
        after = self.check(fix.applied(self.text))
        known = told(self.faults)
        if len(after) < len(self.faults) and all((f.code, f.message) in known for f in after):
            return WHOLLY
        # Removing a syntax error may reveal hidden faults.
        unread = [sum(f.code < "E2" for f in found) for found in (after, self.faults)]
        if fault.code >= "E2":
            return self.left_over(fault, after)
        if unread[0] < unread[1]:
            return IN_PART
        new = [f for f in after if (f.code, f.message) not in known]
        further = all(_at(f) > _at(fault) for f in new) and len(after) <= len(self.faults)
        return ONE_STEP if further and (fault.code, fault.message) not in told(after) else NOTHING

    def left_over(self, fault: Diagnostic, after: Sequence[Diagnostic]) -> int:
        """How much a change helps that only leaves an unused definition behind."""
        known = told(self.faults)
        new = {f.code for f in after if (f.code, f.message) not in known}
        gone = (fault.code, fault.message) not in told(after)
        return IN_PART if gone and new <= set(UNUSED) else NOTHING


UNUSED = ("E204", "E213", "E225")
"""Codes of unused definitions, which can always be deleted."""


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
        for match, new in recoveries(text, line):
            yield _placed(text, fault, match, new)
        yield from _misspelt(line, fault.place.column - 1)
    yield from by_names(text, fault)
    for usual in (*FOREIGN_FORMS, *USUAL):
        if fault.code not in usual.codes:
            continue
        matches = list(usual.found(line))
        for match in sorted(matches, key=lambda m: _distance(m, fault.place.column - 1)):
            new = match.expand(usual.new) if isinstance(usual.new, str) else usual.new(match)
            if new != match[0]:
                yield _placed(text, fault, match, new)
    yield from _as_expected(fault)
    yield from added(text, fault)


def _placed(text: str, fault: Diagnostic, match: re.Match[str], new: str) -> str:
    """A change as a hint; with surrounding words if it would be ambiguous."""
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
    """Replacements of misspelt words of the language, nearest to the caret first."""
    for pair in re.finditer(r"(?=\b([a-z]+)\s+([a-z]+)\b)", line):
        turned = f"{pair[2]} {pair[1]}"
        for meant in close_matches(turned, PHRASES, n=1, cutoff=ALIKE):
            yield f"write `{meant}` in place of `{pair[1]} {pair[2]}`"
    for match in sorted(LONE_WORD.finditer(line), key=lambda m: _distance(m, at)):
        if match[0] in OTHER_WORDS:
            yield _hint(line, match, OTHER_WORDS[match[0]], at)
        elif match[0] not in MEANT_WORDS:
            for meant in close_matches(match[0].lower(), MEANT_WORDS, n=3, cutoff=ALIKE):
                yield _hint(line, match, meant, at)


def _as_expected(fault: Diagnostic) -> Iterator[str]:
    """The expected text, if it is the same in other characters or another unit."""
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
    """Small edits next to the fault, if there is no usual meaning."""
    place = fault.place
    unread = fault.code < "E2"
    for repair in edits(place.text, place.column - 1, place.length, WORDS, unread=unread):
        hint = hint_of(place.text, repair)
        if hint is not None and not hint.startswith("leave `::="):  # two stages would be made one
            yield hint


def _distance(match: re.Match[str], at: int) -> int:
    """Distance of a match from the caret; 0 if it contains it."""
    return (
        0
        if match.start() <= at <= match.end()
        else min(abs(match.start() - at), abs(match.end() - at))
    )


def _hint(line: str, match: re.Match[str], new: str, at: int) -> str:
    """A change as a hint that `fix_of` parses, at the caret or with a named position."""
    old = match[0]
    if not old.strip():
        before = re.search(r"\S+\s*$", line[: match.start()])
        word = before[0].strip() if before else ""
        return f"write `{word}{new.strip()}` in place of `{word}`"
    if not new.strip():
        return f"leave `{old.strip()}` out"
    return f"write `{' '.join(new.split())}` in place of `{' '.join(old.split())}`"
