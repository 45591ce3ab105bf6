"""Syntax repair: the smallest edit after which parsing can continue.

Each repair is tried before it is offered, so that a hint is always legal, and further errors in the same rule
are reported as well.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from math import inf

from lark import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from visup.agent.model.did_you_mean import closest
from visup.rules.correction.local_edits import Repair, edits
from visup.rules.correction.meaning_loss import COMMON_FIX_BONUS, SMALL_LOSS, meaning_lost
from visup.rules.language.common_mistakes import MISTAKE_PATTERNS
from visup.rules.language.keywords import KEYWORDS

MAX_REPAIRS = 12
MAX_COMPARED = 4
"""Edits that make a text correct and are compared by what they lose."""
MAX_CORRECTIONS = 16
"""Most corrections tried per error, cheapest first."""
NEAR = 60
"""Characters before an error that are searched for its cause; the whole line always is."""
MUCH_FURTHER = 8
"""A usual slip whose fix lets this many more characters parse is accepted, whatever else is wrong."""


WORDS = (
    *(w for w in KEYWORDS if w not in ("may", "repeat")),
    *("may repeat", "info", "warning", "critical"),
)
PUT_IN = (
    ")",
    " s",
    " px",
    ":",
    " samples",
    ": info",
    "(",
    ",",
    " and",
    "]",
    ' say "{a}"',
    "[5 s]",
    " when",
)
AMOUNTS = ("0", "20 px", "2 s", "20 px/s", "20 deg", "20 deg/s", "2 m")
"""Amounts to insert after a comparison sign without a right side."""
Parses = Callable[[str], UnexpectedInput | None]
"""The syntax error of a text, or None."""


def find_repair(
    text: str,
    error: UnexpectedInput,
    error_of: Parses,
    is_sound: Callable[[str], bool],
    corrected: Callable[[int], Iterable[Repair]],
) -> Repair | None:
    """The first edit after which a text parses further than before.

    Args:
        text: A text with a syntax error.
        error: The error.
        error_of: Parses a text.
        is_sound: Whether a text without syntax errors is also semantically correct.
        corrected: Corrections from an offset on, cheapest first.

    Returns:
        An edit after which the text is correct, else has no syntax error, else only later ones.
    """
    at, length = place_of(text, error)
    trial = _RepairTrial(text, at, length, error_of, is_sound)
    known = trial.best(common_fixes(text, at, length, *_around(text, at)), COMMON_FIX_BONUS)
    if trial.lost <= SMALL_LOSS:
        return known
    sound = (trial.lost, known)
    usual = trial.best(_candidates(text, at, length))
    if trial.lost <= SMALL_LOSS:
        return usual
    sound = min(sound, (trial.lost, usual), key=lambda found: found[0])
    further, trial.moved = trial.moved, 0.0
    since = max(0, min(at - NEAR, text.rfind("\n", 0, at) + 1))
    least = trial.best(islice(corrected(since), MAX_CORRECTIONS))
    lost, whole = min(sound, (trial.lost, least), key=lambda found: found[0])
    if lost <= SMALL_LOSS or (lost == inf and usual is not None and further > MUCH_FURTHER):
        return whole or usual
    places = dict.fromkeys((at, max(0, end_before(text, at) - 1)))
    edited = trial.best(r for place in places for r in _edited(text, place))
    if min(lost, trial.lost) < inf:
        return whole if lost <= trial.lost else edited
    return edited or usual or least


@dataclass
class _RepairTrial:
    """A trial of edits of a text with a syntax error.

    Attributes:
        text: The text.
        at: Offset of the error.
        length: Length of the error.
        error_of: Parses a text.
        is_sound: Whether a text without syntax errors is also semantically correct.
        moved: How many more characters parse after the last chosen edit.
        lost: What the last chosen edit loses; infinite unless the text is correct after it.
    """

    text: str
    at: int
    length: int
    error_of: Parses
    is_sound: Callable[[str], bool]
    moved: float = 0.0
    lost: float = inf

    def best(self, repairs: Iterable[Repair], granted: float = 0.0) -> Repair | None:
        """The first edit after which the text is correct, else parses, else parses further.

        An edit that loses much more than what is granted is taken only if a few others lose no less.
        """
        self.lost = inf
        whole: list[tuple[float, Repair]] = []
        further: Repair | None = None
        readable: Repair | None = None
        slips_first = False
        for tried in repairs:
            repair = replace(tried, old=self.text[tried.begin : tried.end])
            if repair.old == repair.new:
                continue
            changed = repair.applied(self.text)
            left = self.error_of(changed)
            if left is None:
                self.moved = inf
                if self.is_sound(changed):
                    whole.append((meaning_lost(self.text, changed) - granted, repair))
                    if whole[-1][0] <= SMALL_LOSS or len(whole) == MAX_COMPARED:
                        break
                    continue
                readable = readable or repair
                continue
            moved = place_of(changed, left)[0] - len(repair.new) + len(repair.old)
            if further is None and moved > repair.end + 1 and moved > self.at + self.length:
                further, self.moved = repair, moved - self.at
                slips_first = readable is None and self.moved > MUCH_FURTHER
        if whole:
            self.lost, least = min(whole, key=lambda found: found[0])
            return least
        if slips_first:
            self.moved = MUCH_FURTHER + 1
            return further
        self.moved = self.moved if readable is None else inf
        return readable or further


def place_of(text: str, error: UnexpectedInput) -> tuple[int, int]:
    """Offset and length of the error; at the end of the text the length is 0."""
    if isinstance(error, UnexpectedToken) and error.token.type != "$END":
        return error.token.start_pos or 0, len(error.token)
    if isinstance(error, UnexpectedCharacters):
        return int(error.pos_in_stream or 0), 1
    return len(text.rstrip()), 0


def end_before(text: str, at: int) -> int:
    """End of the token before an offset, skipping blanks and comments."""
    lines = text[:at].split("\n")
    while lines and not lines[-1].split("#")[0].strip():
        lines.pop()
    if not lines:
        return 0
    return len("\n".join([*lines[:-1], lines[-1].split("#")[0].rstrip()]))


def common_fixes(
    text: str, at: int, length: int, low: int = 0, high: int | None = None
) -> Iterator[Repair]:
    """Fixes of frequent slips that contain an offset or are adjacent to it.

    Args:
        text: The faulty text.
        at: Offset of the error.
        length: Length of the error.
        low: Offset from which to search for slips.
        high: Offset up to which to search; None for the end of the text.
    """
    end = len(text) if high is None else high
    for slip in MISTAKE_PATTERNS:
        for match in slip.found(text, low, end):
            if match.start() - 1 <= at + length and at - 1 <= match.end():
                new = match.expand(slip.new) if isinstance(slip.new, str) else slip.new(match)
                yield Repair(match.start(), match.end(), new)


def _around(text: str, at: int) -> tuple[int, int]:
    """The lines around an error in which usual slips are looked for."""
    high = text.find("\n", at + 160)
    return text.rfind("\n", 0, max(0, at - 120)) + 1, len(text) if high < 0 else high


def _candidates(text: str, at: int, length: int) -> Iterator[Repair]:
    low, high = _around(text, at)
    yield from common_fixes(text, at, length, low, high)
    found, before = text[at : at + length], end_before(text, at)
    for word in (found, _word_before(text, before)):
        start = at if word == found else before - len(word)
        meant = word.lower() if word.lower() in WORDS else closest(word, WORDS)
        if word and meant and meant != word:
            yield Repair(start, start + len(word), meant)
    if found == ",":
        yield Repair(at, at + 1, " and")
    if found[:1].isdigit():
        yield Repair(before, before, " <")
    yield from (
        Repair(p, p, ")")
        for p in _ends_of_groups(text, max(low, text.rfind("\n", 0, before)), before)
    )
    if text[before - 1 : before] in ("<", ">", "="):
        yield from (Repair(before, before, f" {amount}") for amount in AMOUNTS)
    for new in PUT_IN:
        if text[before - 1 : before].isdigit() or new not in (" s", " px"):
            yield Repair(before, before, new)
    if length:
        yield Repair(at, at + length, "")
    previous = _word_before(text, before)
    if previous:
        yield Repair(before - len(previous), before, "")


def _ends_of_groups(text: str, low: int, high: int) -> list[int]:
    """Where a bracket may be closed that was left open: first where it groups something for what follows."""
    places = [low + match.end() for match in re.finditer(r"\)", text[low:high])]

    def groups(place: int) -> bool:
        inner = text[low:place]
        joined = re.search(r"\b(?:and|or)\b", inner) is not None
        return joined and _POSTFIX.match(text, place) is not None

    return sorted(places, key=lambda place: not groups(place))


_POSTFIX = re.compile(r"\s*(?:for|within|in|since|until)\b")


def _edited(text: str, at: int) -> Iterator[Repair]:
    """Small edits of the line at an offset."""
    begin, end = text.rfind("\n", 0, at) + 1, text.find("\n", at)
    line = text[begin : end if end >= 0 else len(text)]
    if line.lstrip().startswith("rule"):
        return  # without variables the rest of a rule is meaningless
    for edit in edits(line, at - begin, 1, WORDS):
        yield Repair(begin + edit.begin, begin + edit.end, edit.new)


def _word_before(text: str, end: int) -> str:
    found = re.search(r"\w+$|\S$", text[:end])
    return found[0] if found else ""
