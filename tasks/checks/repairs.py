"""Hints that have been tried: for each mistake of a task file the change that makes it go away.

What a mistake usually means is in one table, by its code; a change is offered only when the file has
fewer mistakes after it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from visup.agent.model.did_you_mean import closest
from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.edits import edits, hint_of
from visup.rules.language.fixes import fix_of
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.diagnostics.course_error_patterns import SIGNS_MEANT
from visup.tasks.grammar.statement import RESERVED_WORDS
from visup.tasks.grammar.units import UNITS

CHARACTERS_TRIED = 60_000
"""Of changes of one file: of a long file with many mistakes only the first have a tried hint."""
MOST_HINTS = 12

Check = Callable[[str], Sequence[Diagnostic]]
New = str | Callable[[re.Match[str]], str]


@dataclass(frozen=True, slots=True)
class UsualMeaning:
    """What a mistake usually means.

    Attributes:
        codes: Of the mistakes.
        pattern: What it looks like, looked for on its line, at the caret first.
        new: What is meant.
    """

    codes: tuple[str, ...]
    pattern: re.Pattern[str]
    new: New


def _usual(codes: str, pattern: str, new: New) -> UsualMeaning:
    return UsualMeaning(tuple(codes.split()), re.compile(pattern), new)


SYNONYMS = {
    "near": "converging", "approach": "converging", "approaching": "converging",
    "attached": "coupled", "grasp": "coupled", "grasped": "held_by", "holding": "coupled",
    "hold": "coupled", "above": "on", "upon": "on", "atop": "on", "connected": "coupled",
    "released": "decoupled", "release": "decoupled",
    "leaving": "diverging", "retreating": "diverging", "contact": "touching", "visible": "present",
    "left": "gone", "away": "gone", "in": "inside", "separate": "apart", "moving_apart": "diverging",
}  # fmt: skip
WORDS = (*RESERVED_WORDS, *ACTIONS, "leftmost", "rightmost", "ignored")
OPPOSITES = {"touching": "apart", "coupled": "decoupled", "present": "gone", "inside": "outside",
             "converging": "diverging", "diverging": "converging", "gone": "present"}  # fmt: skip
KEYWORD = (
    r"(?:for|within|after|at|least|most|times?|begins|ends|fails|progresses|pauses|when|any|order|already|each"
    r"|of)"
)
SIGN = r"begins|ends|fails|progresses|pauses"
MEANT = "|".join(SIGNS_MEANT)
NAME = r"[^\W\d]\w*"
CALL = rf"{NAME}\s*\([^()]*\)"
TIME = r"\d[\d.]*\s*(?:ms|s|min|h)"

NUMBERS = {"one": 1, "two": 2, "three": 3}
PREFIXES = ("already", "task", "never", "always")


def _listed(word: str, stages: str) -> str:
    """Stages in a list behind a word: `any order (<a>, <b>)`."""
    return f"{word} ({', '.join(stages.split())})"


USUAL = (
    _usual("E101 E103 E119", rf"\b({KEYWORD})\b", lambda m: m[1].lower()),
    _usual("E101 E103 E119", rf"(?i)\b({KEYWORD})\b", lambda m: m[1].lower()),
    _usual("E101 E219 E103", rf"\(\s*({NAME})\s*;\s*({NAME})\s*\)", r"(\1, \2)"),
    _usual("E238", rf"\bevery\s+({TIME})\s+to\s+({TIME})", r"every \2 to \1"),
    _usual("E238", r"between\s+([\d.]+\s*\S+)\s+and\s+([\d.]+\s*\S+)", r"between \2 and \1"),
    _usual("E103", rf"\bnot\s+({NAME})(?=\s*\()", lambda m: OPPOSITES.get(m[1], m[1])),
    _usual("E103 E127", rf"\b(?:historically|always|once|eventually|globally|finally|next)\s+(?={CALL})", ""),
    _usual("E103", rf"\b({NAME})(?=\s+(?:{CALL}|<))", lambda m: closest(m[1], PREFIXES) or m[1]),
    _usual("E103", rf"^\s*({NAME})(?=\s*::=)", r"<\1>"),
    _usual("E103", rf"(?<![<\w])({NAME})(?![\w>(])", r"<\1>"),
    _usual("E102 E202", r"(?<=>)\s*(?:::\s*=|: :=|:=|=|->|→|::|:|=>|:==|<-)\s*", " ::= "),
    _usual("E101", rf"<({NAME})>\s*\(([^()]*)\)", r"<\1(\2)>"),
    _usual("E101 E134", r"\b(any\s+\d+\s+of)\s+((?:<[^>]*>\s*){2,})", lambda m: _listed(m[1], m[2])),
    _usual("E101", r"\b(any)\s+(one|two|three)\s+(?=of)", lambda m: f"any {NUMBERS[m[2]]} "),
    _usual("E101", r"(between\s+[\d.]+\s*\S*?)\s*(?:,|to|-|\.\.)\s*([\d.]+)", r"\1 and \2"),
    _usual("E101", r"\bon\s+(?:failure|error)\s+(?!of)", "on failure of "),
    _usual("E101 E103 E219", r"\bon\s+(?:fail(?:ing|s|ed)?|errors?)\s+of\b", "on failure of"),
    _usual("E219", rf"\b({NAME})\s+({NAME})\s+(?:with|and|to)\s+({NAME})\b", r"\1(\2, \3)"),
    _usual("E103", r"\b(?:each|all)\s+of\s*(?=\()", ""),
    _usual("E101", r"\b(on\s+failure\s+of\s+<[^>]*>)\s*(?!:)", r"\1: "),
    _usual("E101", rf"\b(?:exists|forall|some|all)\s+{NAME}\s*:\s*", ""),
    _usual("E101", r"\b(?:rising|falling|once|previous)\s*\((.*)\)", r"\1"),
    _usual("E101 E103", rf"({CALL})\s+(for\s+{TIME})(?=\s+(?:and|or)\b)", r"(\1 \2)"),
    _usual("E101", rf"(\s+when\s+.*?)\s+(for\s+{TIME})\s+((?:and|or)\s+[^\n]*)", r"\1 \3 \2"),
    _usual("E101 E228", rf"({CALL})\s*={{1,3}}\s*(\d)", r"\1 <= \2"),
    _usual("E101", rf"({CALL})\s*!=\s*(\d)", r"\1 > \2"),
    _usual("E101", r"<=>|<->|->|=>", " "),
    _usual("E119", r"\s*,(?=\s)", ""),
    _usual("E119", r"\band\b", "&"),
    _usual("E119", r"\bor\b", "|"),
    _usual("E119", r"\b(?:then|next|before|after|and then)\b\s*", ""),
    _usual("E110", r"$", ")"),
    _usual("E110", rf"({NAME}\s*\([^()&|<>]*)$", r"\1)"),
    _usual("E111", r"\)(?=[^)]*$)", ""),
    _usual("E112", r"\[([^\[\]]*)\]", r"(\1)?"),
    _usual("E112", r"\{([^{}]*)\}", r"(\1)*"),
    _usual("E114", r"\s*[|&]\s*$", ""),
    _usual("E114", r"([|&])\s*[|&]", r"\1"),
    _usual("E114", r"(::=)\s*[|&]", r"\1"),
    _usual("E116", r"\b((?:for|within|after|every)\s+[\d.]+)\b(?!\s*\w)", r"\1 s"),
    _usual("E116", r"([<>]=?\s*[\d.]+)(?!\s*[\w%.])", r"\1 px"),
    _usual("E116", r"([<>]=?\s*[\d.]+)(?!\s*[\w%.])", r"\1 s"),
    _usual("E116", r"\bsignal\(\s*(\w+)\s*,[^()]*\)", r"signal(\1)"),
    _usual("E228 E223", rf"<\s*({NAME})\s*$", r"<\1>"),
    _usual("E116", r"(\d)(?!\s*[\w%.])", r"\1 px"),
    _usual("E115", r"\b(for|within|after|every)\s+-\s*([\d.]+)", r"\1 \2"),
    _usual("E218 E226", r"(\d)\s*m\b", r"\1 min"),
    _usual("E115", r"\bfor\s+(?:each|all|every)\s+of\s*(\([^()]*\))", r"for each one of \1"),
    _usual("E115", r"\bfor\s+(?:all|every)\s+(?=\w+\s+(?:of|in)\b)", "for each "),
    _usual("E115 E101", r"\b(for\s+each\s+\w+)\s+in\b", r"\1 of"),
    _usual("E115", r"\b(every)\s*$", r"\1 5 s"),
    _usual("E115", r"\s*\b(?:for|within|after)\s*$", ""),
    _usual("E115", r"\b(for|within|after)\b", r"\1 5 s"),
    _usual("E120", r"\s*[.;]\s*$", ""),
    _usual("E121", r"//|--|%|/\*", "#"),
    _usual("E122", r"&&|\|\|", lambda m: m[0][0]),
    _usual("E124", rf"\bactor\s+({NAME})\s+(?=\w)(?!is\b)", r"actor \1 is "),
    _usual("E124", rf"\bactor\s+({NAME})\s*=\s*", r"actor \1 is "),
    _usual("E124", rf"\bactor\s+({NAME})\s+is\s*$", r"actor \1 is \1"),
    _usual("E130", r"\binclude\s+([\w./-]+)", r'include "\1"'),
    _usual("E131", rf"\bzone\s+({NAME})\b.*$", r"zone \1 is (100, 50) (300, 50) (300, 200)"),
    _usual("E132", rf"\bparameter\s+({NAME})\s*(?:=|:|:=)?\s*(?=\d)", r"parameter \1 is "),
    _usual("E201", rf"\bclosed\(\s*({NAME})\s*\)", r"openness(\1) < 10 %"),
    _usual("E201", rf"\b(?:open|opened)\(\s*({NAME})\s*\)", r"openness(\1) > 20 %"),
    _usual("E127", rf"\bperiodic\(\s*({CALL})\s*,\s*({TIME}(?:\s+to\s+{TIME})?)\s*\)", r"\1 every \2"),
    _usual("E127", r"\s*\bperiodically\b", " every 5 s"),
    _usual("E101", rf"\bevery\s+({TIME}(?:\s+to\s+{TIME})?)\s+({CALL})", r"\2 every \1"),
    _usual("E101", r"\beach(?=\s+\d)", "every"),
    _usual("E119 E116", r"(every [\d.]+)\s*\w*\s*(?:and|or|,|-|\.\.)\s*([\d.]+)\s*(\w+)", r"\1 \3 to \2 \3"),
    _usual("E208", r"\s*\bpauses\s+when\b.*$", ""),
    _usual("E133", rf"\b({SIGN})\s+(?:if|while|on|once|whenever)\b", r"\1 when"),
    _usual("E133", rf"\b({SIGN})\s+(?={NAME}\()", r"\1 when "),
    _usual("E133", rf"\b({MEANT})\s+(?:when|if|while|on)\b", lambda m: f"{SIGNS_MEANT[m[1]]} when"),
    _usual("E133", rf"\b({MEANT})\s+(?={NAME}\()", lambda m: f"{SIGNS_MEANT[m[1]]} when "),
    _usual("E134", r"\b(at\s+(?:least|most)\s+\d+)\b(?!\s*times?)", r"\1 times"),
    _usual("E134", r"\btwice\b", "at least 2 times at most 2 times"),
    _usual("E134", r"\b(?:thrice|three times)\b", "at least 3 times at most 3 times"),
    _usual(
        "E134",
        rf"\brepeat\s+(\d+)\s*(?:times|x)?\s*(?:of\s+)?({CALL}|<[^>]*>)",
        r"\2 at least \1 times at most \1 times",
    ),
    _usual(
        "E134", r"\brepeat(?:ed)?\s+(\d+)(?:\s*(?:times|x))?", r"at least \1 times at most \1 times"
    ),
    _usual("E134", rf"\brepeat(?:edly)?\s+({CALL}|<[^>]*>)", r"\1+"),
    _usual("E134", r"\b(\d+)\s*(?:times|x)\b", r"at least \1 times at most \1 times"),
    _usual("E135", r"\bin\s+(?=any\s+order)", ""),
    _usual("E135", r"\b(any\s+order)\s+((?:<[^>]*>\s*){2,})", lambda m: _listed(m[1], m[2])),
    _usual("E204", rf"^\s*<{NAME}[^>]*>\s*::=.*$", ""),
    _usual("E127", rf"\s*\b(?:until|unless|while|since)\s+({CALL})", r" ends when \1"),
    _usual("E127", rf"\b(?:if)\s+({CALL})\s*(?:then)?", r"\1"),
    _usual("E108", r"<\s*([^<>]+?)\s*>", lambda m: f"<{re.sub(r'[^0-9a-zA-Z_]+', '_', m[1])}>"),
    _usual("E107", rf"<({NAME})(?![\w>])", r"<\1>"),
    _usual("E201", rf"\b({NAME})(?=\s*\()", lambda m: SYNONYMS.get(m[1].lower(), m[1].lower())),
    _usual("E202", rf"<({NAME})>\s*", ""),
    _usual("E205", rf"\b({NAME})\(\s*({NAME})\s*\)", r"\1(\2, other)"),
    _usual("E205", rf"\b({NAME})\(\s*({NAME})\s*,\s*({NAME})\s*(?:,[^()]*)?\)", r"\1(\2, \3)"),
    _usual("E205", rf"\b({NAME})\(\s*({NAME})\s*,[^()]*\)", r"\1(\2)"),
    _usual("E206", rf"<({NAME})>\s*::=\s*<\1>\s*([^\n|]+)", r"<\1> ::= \2 <\1>?"),
    _usual("E211", rf"\b({NAME})\(\s*({NAME})\s*,\s*\2\s*\)", r"\1(\2, other)"),
    _usual("E218", r"\b(?:seconds?|secs?|sec)\b", "s"),
    _usual("E218", r"\b(?:minutes?|mins|m)\b", "min"),
    _usual("E218", r"\b(?:pixels?|pix)\b", "px"),
    _usual("E218", r"\b(?:hours?|hrs?)\b", "h"),
    _usual("E218", r"\bpercent\b", "%"),
    _usual("E219", rf"\b({NAME})\s+({NAME}),?\s+({NAME})\b", r"\1(\2, \3)"),
    _usual("E219", rf"\b(never|always)\s+({NAME})\s+({NAME})", r"\1 moving(\3)"),
    _usual("E219", rf"\b({NAME})\s+({NAME})\s+({NAME})\b", r"\2(\1, \3)"),
    _usual("E223", rf"\b(for|within|after|every)\s+{NAME}", r"\1 5 s"),
    _usual("E226", r"([\d.]+)\s*[a-z/%]+", r"\1 px"),
    _usual("E226", r"([\d.]+)\s*[a-z/%]+", r"\1 s"),
    _usual("E226", r"([\d.]+)\s*[a-z/%]+", r"\1 px/s"),
    _usual("E227", rf"({CALL})", r"\1 < 5 px"),
    _usual("E227", rf"({CALL})", r"\1 < 5 s"),
    _usual("E227", rf"({CALL})", r"\1 < 5 px/s"),
    _usual("E229", rf"\b(?:inside|outside|reaching)\(\s*({NAME})\s*,\s*({NAME})\s*\)", r"touching(\1, \2)"),
    _usual("E117", rf"\(\s*({NAME})\s+({NAME})\s*\)", r"(\1, \2)"),
    _usual("E117", r",\s*\)", ")"),
    _usual("E118", rf"\b({NAME})\s*\(\s*\)", r"\1(one, other)"),
    _usual("E113", rf"<\s*({CALL})\s*>", r"\1"),
    _usual("E126", r"([?*+])\s*(<[^>]*>|\([^()]*\))", r"\2\1"),
)  # fmt: skip
"""In the order in which they are tried."""


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
            hint = trial.best(fault, _hints(text, fault)) or trial.best(fault, _edits(fault))
        found.append(fault if hint is None else replace(fault, hint=_joined(fault.hint, hint)))
    return tuple(found)


FAULT_COST = 100
"""A fault takes as long to explain as so many characters take to read, or longer."""
LONGEST_HINT = 400
"""Characters of a hint: what is longer, nobody reads."""
NOTHING, IN_PART, WHOLLY = range(3)
"""How much a change helps: not, by what could not be read only, or by a fault and to no new one."""


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

    def best(self, fault: Diagnostic, hints: Iterable[str]) -> str | None:
        """The first hint that helps wholly, else the first that helps in part."""
        partly: str | None = None
        for hint in hints:
            if len(hint) > LONGEST_HINT:
                continue
            self.left -= len(self.text) + FAULT_COST * len(self.faults)
            if self.left < 0:
                break
            helps = self.helps(replace(fault, hint=hint))
            if helps == WHOLLY:
                return hint
            partly = partly or (hint if helps else None)
        return partly

    def helps(self, fault: Diagnostic) -> int:
        """How much the change helps that a hint speaks of."""
        fix = fix_of(self.text, fault.place, fault.hint)
        if fix is None:
            return NOTHING
        after = self.check(fix.applied(self.text))
        known = {(f.code, f.message) for f in self.faults}
        if len(after) < len(self.faults) and all((f.code, f.message) in known for f in after):
            return WHOLLY
        # What could not be read hid what comes to light now.
        unread = [sum(f.code < "E2" for f in found) for found in (after, self.faults)]
        return IN_PART if fault.code < "E2" and unread[0] < unread[1] else NOTHING


def _joined(said: str | None, hint: str) -> str:
    return hint if said is None else f"{said}; {hint}"


def _hints(text: str, fault: Diagnostic) -> Iterator[str]:
    line = fault.place.text
    for usual in USUAL:
        if fault.code not in usual.codes:
            continue
        matches = list(usual.pattern.finditer(line))
        for match in sorted(matches, key=lambda m: _away(m, fault.place.column - 1)):
            new = match.expand(usual.new) if isinstance(usual.new, str) else usual.new(match)
            if new != match[0]:
                yield _hint(line, match, new, fault.place.column - 1)
    yield from _as_expected(fault)


def _as_expected(fault: Diagnostic) -> Iterator[str]:
    """What is expected, where that is the same in other signs, or another unit."""
    at = fault.place.column - 1
    said = fault.place.text[at : at + fault.place.length].strip()
    shown = re.findall(r"`([^`]+)`", fault.expected or "")
    if len(shown) != 1 or not said:
        return
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
