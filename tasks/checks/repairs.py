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
from visup.tasks.checks.additions import definition_hints, name_hints
from visup.tasks.checks.edit_costs import correction_hints, hint_for
from visup.tasks.checks.foreign_forms import FOREIGN_FORMS
from visup.tasks.checks.usual_meanings import USUAL, recoveries
from visup.tasks.diagnostics.recovery import KEYWORDS
from visup.tasks.grammar.statement import NAME, RESERVED_WORDS
from visup.tasks.grammar.units import UNITS

CHARACTERS_TRIED = 60_000
"""Budget for the changes of one file: in a long file with many mistakes only the first have tested hints."""
MAX_HINTS = 12
MAX_COMPARED = 4
"""Changes that help completely and are compared by what they lose."""
MAX_CORRECTIONS, MAX_READINGS = 12, 3000
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
SYNONYMS = {"biggest": "largest", "tallest": "largest", "longest": "largest", "tiniest": "smallest",
               "topmost": "highest", "uppermost": "highest", "bottommost": "lowest"}  # fmt: skip
"""Synonyms of words of the language."""


def with_tested_hints(
    text: str, faults: Sequence[Diagnostic], check: Check
) -> tuple[Diagnostic, ...]:
    """The faults, with a tested change as their hint if one is found.

    Args:
        text: The file.
        faults: Its faults.
        check: Returns the faults of a text.
    """
    tester, found = _HintTester(text, faults, check), []
    for number, fault in enumerate(faults):
        hint = None
        if number < MAX_HINTS and tester.budget > 0 and not tester.help_of(fault):
            hint = tester.best_hint(fault)
        own_hint = (
            None if fix_of(text, fault.place, fault.hint) else fault.hint
        )  # drop hints that do not help
        found.append(fault if hint is None else replace(fault, hint=_joined_hints(own_hint, hint)))
    return tuple(found)


FAULT_COST = 100
"""Least cost of explaining a fault, in checked characters."""
LONGEST_HINT = 400
"""Maximum characters of a hint; longer ones are not read."""
NO_HELP, NEXT_FAULT, PARTIAL, COMPLETE = range(4)
"""How much a change helps: not at all; the next fault is further on; only syntax errors are removed; or a
fault is removed and no new one appears."""


@dataclass
class _HintTester:
    """Tests changes of a text within a budget.

    Attributes:
        text: The file.
        faults: Its faults.
        check: Returns the faults of a text.
        budget: Remaining characters of the budget.
    """

    text: str
    faults: Sequence[Diagnostic]
    check: Check
    budget: int = CHARACTERS_TRIED

    def best_hint(self, fault: Diagnostic) -> str | None:
        """A hint that helps: usual meanings before small edits, partial help before none."""
        found: list[tuple[str | None, int]] = []
        bonus = COMMON_FIX_BONUS
        for hints in (
            _hints(self.text, fault),
            self.correction_hints(fault),
            self.edit_hints(fault),
        ):
            no_deletion = fault.code < "E2" and bool(found) and found[0][1] > NEXT_FAULT
            # A usual meaning that helps partly is preferred to deleting words.
            hint, helps = self.most_helpful(
                fault, (h for h in hints if not (no_deletion and h.startswith("leave"))), bonus
            )
            if helps == COMPLETE and self.meaning_loss(fault, hint) - bonus <= SMALL_LOSS:
                return hint
            found.append((hint, helps))
            bonus = 0.0
        usual, _, edit = found
        complete = [hint for hint, helps in found if helps == COMPLETE]
        if complete:
            # A change that leaves a definition unused may lose less meaning than a complete fix.
            unused_left = [usual[0]] if fault.code >= "E2" and usual[1] == PARTIAL else []
            return min(
                (*complete, *unused_left),
                key=lambda hint: (
                    self.meaning_loss(fault, hint) - (COMMON_FIX_BONUS if hint == usual[0] else 0.0)
                ),
            )
        return edit[0] if usual[1] <= NEXT_FAULT < edit[1] else usual[0]

    def edit_hints(self, fault: Diagnostic) -> Iterator[str]:
        """Small edits; for syntax errors first, since other faults may follow from them."""
        if fault.code < "E2" or all(f.code >= "E2" for f in self.faults):
            yield from _edits(fault)

    def correction_hints(self, fault: Diagnostic) -> Iterator[str]:
        """Corrections of several words of a statement with a syntax error."""
        readings = MAX_READINGS

        def may_go_on() -> bool:
            nonlocal readings
            readings -= 1
            self.budget -= READING_COST
            return readings > 0 and self.budget > 0

        if fault.code < "E2":
            yield from islice(correction_hints(self.text, fault.place, may_go_on), MAX_CORRECTIONS)

    def most_helpful(
        self, fault: Diagnostic, hints: Iterable[str], bonus: float
    ) -> tuple[str | None, int]:
        """The hint that helps most, and how much; of complete fixes the first that loses little meaning."""
        partial: str | None = None
        most = NO_HELP
        complete: list[tuple[float, str]] = []
        for hint in hints:
            if len(hint) > LONGEST_HINT or "..." in hint:
                continue
            self.budget -= len(self.text) + FAULT_COST * len(self.faults)
            if self.budget < 0:
                break
            helps = self.help_of(replace(fault, hint=hint))
            if helps == COMPLETE:
                complete.append((self.meaning_loss(fault, hint) - bonus, hint))
                if complete[-1][0] <= SMALL_LOSS or len(complete) == MAX_COMPARED:
                    break
            elif helps > most:
                partial, most = hint, helps
        if complete:
            return min(complete, key=lambda found: found[0])[1], COMPLETE
        return partial, most

    def meaning_loss(self, fault: Diagnostic, hint: str | None) -> float:
        """How much of the meaning of the file the change of a hint loses."""
        fix = fix_of(self.text, fault.place, hint)
        return inf if fix is None else meaning_lost(self.text, fix.applied(self.text))

    def help_of(self, fault: Diagnostic) -> int:
        """How much the change of a hint helps."""
        fix = fix_of(self.text, fault.place, fault.hint)
        if fix is None:
            return NO_HELP
        after = self.check(fix.applied(self.text))
        known = messages(self.faults)
        if len(after) < len(self.faults) and all((f.code, f.message) in known for f in after):
            return COMPLETE
        # Removing a syntax error may reveal hidden faults.
        syntax_errors = [sum(f.code < "E2" for f in found) for found in (after, self.faults)]
        if fault.code >= "E2":
            return self.help_leaving_unused(fault, after)
        if syntax_errors[0] < syntax_errors[1]:
            return PARTIAL
        new = [f for f in after if (f.code, f.message) not in known]
        further = all(_position(f) > _position(fault) for f in new) and len(after) <= len(
            self.faults
        )
        return (
            NEXT_FAULT
            if further and (fault.code, fault.message) not in messages(after)
            else NO_HELP
        )

    def help_leaving_unused(self, fault: Diagnostic, after: Sequence[Diagnostic]) -> int:
        """How much a change helps that may leave an unused definition."""
        known = messages(self.faults)
        new = {f.code for f in after if (f.code, f.message) not in known}
        is_fixed = (fault.code, fault.message) not in messages(after)
        return PARTIAL if is_fixed and new <= set(UNUSED) else NO_HELP


UNUSED = ("E204", "E213", "E225")
"""Codes of unused definitions, which can always be deleted."""


def messages(faults: Sequence[Diagnostic]) -> set[tuple[str, str]]:
    """The messages of faults, regardless of position."""
    return {(f.code, f.message) for f in faults}


def _position(fault: Diagnostic) -> tuple[int, int]:
    return fault.place.line, fault.place.column


def _joined_hints(own_hint: str | None, tested: str) -> str:
    return tested if own_hint is None else f"{own_hint}; {tested}"


def _hints(text: str, fault: Diagnostic) -> Iterator[str]:
    line = fault.place.text
    if fault.code < "E2":
        for match, new in recoveries(text, line):
            yield _unambiguous_hint(text, fault, match, new)
        yield from _misspelt(line, fault.place.column - 1)
    yield from name_hints(text, fault)
    for usual in (*FOREIGN_FORMS, *USUAL):
        if fault.code not in usual.codes:
            continue
        matches = list(usual.matches(line))
        for match in sorted(matches, key=lambda m: _distance(m, fault.place.column - 1)):
            new = match.expand(usual.new) if isinstance(usual.new, str) else usual.new(match)
            if new != match[0]:
                yield _unambiguous_hint(text, fault, match, new)
    yield from _as_expected(fault)
    yield from definition_hints(text, fault)


def _unambiguous_hint(text: str, fault: Diagnostic, match: re.Match[str], new: str) -> str:
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
    return (
        hint_for(text, fault.place, Repair(begin + match.start(), begin + match.end(), new))
        or plain
    )


def _misspelt(line: str, at: int) -> Iterator[str]:
    """Replacements of misspelt words of the language, nearest to the caret first."""
    for pair in re.finditer(r"(?=\b([a-z]+)\s+([a-z]+)\b)", line):
        swapped = f"{pair[2]} {pair[1]}"
        for phrase in close_matches(swapped, PHRASES, n=1, cutoff=ALIKE):
            yield f"write `{phrase}` in place of `{pair[1]} {pair[2]}`"
    for match in sorted(LONE_WORD.finditer(line), key=lambda m: _distance(m, at)):
        if match[0] in SYNONYMS:
            yield _hint(line, match, SYNONYMS[match[0]], at)
        elif match[0] not in MEANT_WORDS:
            for phrase in close_matches(match[0].lower(), MEANT_WORDS, n=3, cutoff=ALIKE):
                yield _hint(line, match, phrase, at)


def _as_expected(fault: Diagnostic) -> Iterator[str]:
    """The expected text, if it is the same in other characters or another unit."""
    at = fault.place.column - 1
    quoted = fault.place.text[at : at + fault.place.length].strip()
    examples = re.findall(r"`([^`]+)`", fault.expected or "")
    if len(examples) != 1 or not quoted:
        return
    if examples[0].startswith("<") and quoted.isidentifier():
        yield f"write `<{quoted}>` in place of `{quoted}`"
    amount = re.match(r"-?[\d.]+(?=\s*\S)", quoted)
    if amount and examples[0] in UNITS:
        yield f"write `{amount[0]} {examples[0]}` in place of `{quoted}`"
    elif set(re.findall(r"\w+", examples[0])) == set(re.findall(r"\w+", quoted)):
        yield f"write `{examples[0]}` in place of `{quoted}`"


def _edits(fault: Diagnostic) -> Iterator[str]:
    """Small edits next to the fault, if there is no usual meaning."""
    place = fault.place
    has_syntax_error = fault.code < "E2"
    for repair in edits(place.text, place.column - 1, place.length, WORDS, unread=has_syntax_error):
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
    """A change as a hint that `fix_of` parses."""
    old = match[0]
    if not old.strip():
        before = re.search(r"\S+\s*$", line[: match.start()])
        word = before[0].strip() if before else ""
        return f"write `{word}{new.strip()}` in place of `{word}`"
    if not new.strip():
        return f"leave `{old.strip()}` out"
    return f"write `{' '.join(new.split())}` in place of `{' '.join(old.split())}`"
