"""The usual meanings of mistakes in task files: a table by codes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

from visup.agent.model.did_you_mean import closest
from visup.rules.correction.everyday_phrases import NUMBERS
from visup.rules.language.synonyms import synonym
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.checks.edit_costs import plain_call
from visup.tasks.diagnostics.course_error_patterns import (
    CONDITION_SYNONYMS,
    JOINING,
    is_in_condition,
)
from visup.tasks.grammar.statement import NAME, PARAMETERS

Replacement = str | Callable[[re.Match[str]], str]


@dataclass(frozen=True, slots=True)
class UsualMeaning:
    """A usual meaning of a mistake.

    Attributes:
        codes: Codes of the mistakes.
        pattern: Its pattern, searched in its line, at the caret first.
        new: The replacement.
    """

    codes: tuple[str, ...]
    pattern: str
    new: Replacement

    def matches(self, line: str) -> Iterator[re.Match[str]]:
        """Where the pattern is found in a line."""
        return _compiled(self.pattern).finditer(line)


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    """A compiled pattern; compiled on first use, since there are hundreds and most runs need none."""
    return re.compile(pattern)


def usual(codes: str, pattern: str, new: Replacement) -> UsualMeaning:
    """A usual meaning of mistakes with these codes, separated by blanks."""
    return UsualMeaning(tuple(codes.split()), pattern, new)


STAGE_SYNONYMS = {"near": "converging", "hold": "coupled", "holding": "coupled", "present": "present",
                "wait": "present", "come": "converging"}  # fmt: skip
"""Meanings of everyday words as stages, where they differ from those as conditions."""
OPPOSITES = {"touching": "apart", "coupled": "decoupled", "present": "gone", "inside": "outside",
             "converging": "diverging", "diverging": "converging", "gone": "present"}  # fmt: skip
KEYWORD = (
    r"(?:for|within|after|at|least|most|times?|begins|ends|fails|progresses|pauses|when|any|order|already|each"
    r"|of)"
)
CONDITION_KIND = r"begins|ends|fails|progresses|pauses"
CONDITION_SYNONYM = "|".join(CONDITION_SYNONYMS)
CALL = rf"{NAME}\s*\([^()]*\)"
PAIR = rf"\(\s*{NAME}\s*,\s*{NAME}\s*\)"
ITEM = rf"(?:{CALL}|<[^<>]*>)"
TIME = r"\d[\d.]*\s*(?:ms|s|min|h)"

COUNT_WORDS = {"once": "1 time", "twice": "2 times", "thrice": "3 times"}
PREFIXES = ("already", "task", "never", "always")


def _listed(word: str, stages: str) -> str:
    """Stages in a list after a word: `any order (<a>, <b>)`."""
    return f"{word} ({', '.join(stages.split())})"


def _single_operator(match: re.Match[str]) -> str:
    """A doubled operator (`&&`): a word in a condition, else the operator once."""
    operator = match[0][0]
    return JOINING[operator] if is_in_condition(match.string, match.start()) else operator


def _intended_action(name: str) -> str:
    """The action meant by an everyday word; else the name itself."""
    return STAGE_SYNONYMS.get(name) or synonym(name, ACTIONS) or name


USUAL = (
    usual(
        "E101 E103 E107 E115 E116 E119 E132 E134",
        rf"\b(?:{'|'.join(NUMBERS)})\b",
        lambda m: NUMBERS[m[0]],
    ),
    usual("E101 E103 E119", rf"\b({KEYWORD})\b", lambda m: m[1].lower()),
    usual("E101 E103 E119", rf"(?i)\b({KEYWORD})\b", lambda m: m[1].lower()),
    usual("E101 E219 E103", rf"\(\s*({NAME})\s*;\s*({NAME})\s*\)", r"(\1, \2)"),
    usual("E238", rf"\bevery\s+({TIME})\s+to\s+({TIME})", r"every \2 to \1"),
    usual("E238", r"between\s+([\d.]+\s*\S+)\s+and\s+([\d.]+\s*\S+)", r"between \2 and \1"),
    usual("E101 E103", rf"^\s*(?:do|must|should|shall|may|can)(?:\s*not|n't)\s+({NAME})(?=\s*\()",
           lambda m: f"never {_intended_action(m[1])}"),
    usual("E103", rf"\bnot\s+({NAME})(?=\s*\()", lambda m: OPPOSITES.get(m[1], m[1])),
    usual("E103 E127", rf"\b(?:historically|always|once|eventually|globally|finally|next)\s+(?={CALL})", ""),
    usual("E103", rf"\b({NAME})(?=\s+(?:{CALL}|<))", lambda m: closest(m[1], PREFIXES) or m[1]),
    usual("E103", rf"^\s*({NAME}{PARAMETERS})(?=\s*::=)", r"<\1>"),
    usual("E103", rf"^\s*[\[({{]\s*({NAME}{PARAMETERS})\s*[\])}}](?=\s*::=)", r"<\1>"),
    usual("E103", rf"(?<![<\w])({NAME})(?![\w>(])", r"<\1>"),
    usual("E102 E202", r"(?<=>)\s*(?:::\s*=|: :=|:=|=|->|→|::|:|=>|:==|<-)\s*", " ::= "),
    usual("E101", rf"<({NAME})>\s*\(([^()]*)\)", r"<\1(\2)>"),
    usual("E101 E134", r"\b(any\s+\d+\s+of)\s+((?:<[^>]*>\s*){2,})", lambda m: _listed(m[1], m[2])),
    usual("E101", r"(between\s+[\d.]+\s*\S*?)\s*(?:,|to|-|\.\.)\s*([\d.]+)", r"\1 and \2"),
    usual("E101 E103 E219", r"\bon\s+(?:fail(?:ing|s|ed)?|errors?)\s+of\b", "on failure of"),
    usual("E101 E219", rf"\b({NAME})\s+(?:between|of|from)\s+({NAME})\s+(?:and|to|,)\s*({NAME})(?=\s*[<>])",
           r"\1(\2, \3)"),
    usual("E219", rf"\b({NAME})\s+({NAME})\s+(?:with|and|to)\s+({NAME})\b", r"\1(\2, \3)"),
    usual("E103", r"\b(?:each|all)\s+of\s*(?=\()", ""),
    usual("E101", r"\b(on\s+failure\s+of\s+<[^>]*>)\s*(?!:)", r"\1: "),
    usual("E101 E103", rf"\b(?:exists|forall|some|all)\s+{NAME}\s*:\s*", ""),
    usual("E101", r"\b(?:rising|falling|once|previous)\s*\((.*)\)", r"\1"),
    usual("E101 E103", rf"({CALL})\s+(for\s+{TIME})(?=\s+(?:and|or)\b)", r"(\1 \2)"),
    usual("E101", rf"(\s+when\s+.*?)\s+(for\s+{TIME})\s+((?:and|or)\s+[^\n]*)", r"\1 \3 \2"),
    usual("E101 E228", rf"({CALL})\s*={{1,3}}\s*(\d)", r"\1 <= \2"),
    usual("E101", rf"({CALL})\s*!=\s*(\d)", r"\1 > \2"),
    usual("E101", r"<=>|<->|->|=>", " "),
    usual("E101 E103 E117 E119 E135", r",\s*,", ","),
    usual("E101 E119 E103", r"\b(any\s+\d+)\s*(?=\()", r"\1 of "),
    usual("E101 E115", rf"\b(for\s+each\s+{NAME})\s+(?:of|in)\s+({NAME}(?:\s*,\s*{NAME})+)\s+",
           r"\1 of (\2) "),
    usual("E101 E119", r"\bany\s+of\s*(?=\()", "any 1 of "),
    usual("E119 E101", rf"\bany\s+(\d+)\s+of\s+({ITEM}(?:\s*,\s*{ITEM})+)", r"any \1 of (\2)"),
    usual("E115 E101", rf"\bfor\s+each\s+({NAME})\s+(?={NAME}\()", r"for each new \1 "),
    usual("E115 E101", rf"\bfor\s+each\s+of\s+(?={NAME}\s+{NAME}\()", "for each of 2 "),
    usual("E102", r":\s*=", "::="),
    usual("E109", r"::=\s*$", "::= present(x)"),
    usual("E101", rf"\bbetween\s+(\d[\d.]*)\s*(?:s\s*)?(?:and|to)\s+({TIME})", r"after \1 s within \2"),
    usual("E101 E119", r"\ball\s+of\s*(?=\()", "any order "),
    usual("E101 E103 E119",
           r"\b(?:from|in|within)\s+([\d.]+\s*[a-z%/]*)\s*(?:to|-|and|\.\.)\s*([\d.]+\s*[a-z%/]+)",
           r"between \1 and \2"),
    usual("E101 E103 E119",
           rf"\bbetween\s+([\d.]+\s*[a-z%/]*)\s*(?:to|-|and|,|\.\.)\s*([\d.]+\s*[a-z%/]+)\s+({CALL})",
           r"\3 between \1 and \2"),
    usual("E101 E103", rf"\b(\d+)\s*(?:times|x)\s+({ITEM})", r"(\2) at least \1 times at most \1 times"),
    usual("E127 E134", rf"\brepeat\s+({ITEM})\s+until\s+({ITEM})", r"\1+ \2"),
    usual("E101 E103 E134", r"\b(?:maximum|max|up\s+to|no\s+more\s+than)\s+(\d+)\s+times?\b",
           r"at most \1 times"),
    usual("E101 E103 E134", r"\b(?:minimum|min|no\s+(?:less|fewer)\s+than)\s+(\d+)\s+times?\b",
           r"at least \1 times"),
    usual("E119", r"\s*,(?=\s)", ""),
    usual("E119", r"\band\b", "&"),
    usual("E119", r"\bor\b", "|"),
    usual("E119", r"\b(?:then|next|before|after|and then)\b\s*", ""),
    usual("E110", r"$", ")"),
    usual("E110", rf"({NAME}\s*\([^()&|<>]*)$", r"\1)"),
    usual("E111", r"\)(?=[^)]*$)", ""),
    usual("E112", r"\[([^\[\]]*)\]", r"(\1)?"),
    usual("E112", r"\{([^{}]*)\}", r"(\1)*"),
    usual("E114", r"\s*[|&]\s*$", ""),
    usual("E114", r"([|&])\s*[|&]", r"\1"),
    usual("E114", r"(::=)\s*[|&]", r"\1"),
    usual("E116", r"\b((?:for|within|after|every)\s+[\d.]+)\b(?!\s*\w)", r"\1 s"),
    usual("E116", r"([<>]=?\s*[\d.]+)(?!\s*[\w%.])", r"\1 px"),
    usual("E116", r"([<>]=?\s*[\d.]+)(?!\s*[\w%.])", r"\1 s"),
    usual("E116", r"\bsignal\(\s*(\w+)\s*,[^()]*\)", r"signal(\1)"),
    usual("E228 E223", rf"<\s*({NAME})\s*$", r"<\1>"),
    usual("E116", r"(\d)(?!\s*[\w%.])", r"\1 px"),
    usual("E115", r"\b(for|within|after|every)\s+-\s*([\d.]+)", r"\1 \2"),
    usual("E218 E226", r"(\d)\s*m\b", r"\1 min"),
    usual("E115", r"\bfor\s+(?:each|all|every)\s+of\s*(\([^()]*\))", r"for each one of \1"),
    usual("E115", r"\bfor\s+(?:all|every)\s+(?=\w+\s+(?:of|in)\b)", "for each "),
    usual("E115 E101", r"\b(for\s+each\s+\w+)\s+in\b", r"\1 of"),
    usual("E115", r"\b(every)\s*$", r"\1 5 s"),
    usual("E115", r"\s*\b(?:for|within|after)\s*$", ""),
    usual("E115", r"\b(for|within|after)\b", r"\1 5 s"),
    usual("E120", r"\s*[.;]\s*$", ""),
    usual("E121", r"//|--|%|/\*", "#"),
    usual("E122", r"&&|\|\|", _single_operator),
    usual("E124", rf"\bactor\s+({NAME})\s+(?=\w)(?!is\b)", r"actor \1 is "),
    usual("E124", rf"\bactor\s+({NAME})\s*=\s*", r"actor \1 is "),
    usual("E124", rf"\bactor\s+({NAME})\s+is\s*$", r"actor \1 is \1"),
    usual("E130", r"\binclude\s+([\w./-]+)", r'include "\1"'),
    usual("E131", rf"\bzone\s+({NAME})\b.*$", r"zone \1 is (100, 50) (300, 50) (300, 200)"),
    usual("E132", rf"\bparameter\s+({NAME})\s*(?:=|:|:=)?\s*(?=\d)", r"parameter \1 is "),
    usual("E201", rf"\bclosed\(\s*({NAME})\s*\)", r"openness(\1) < 10 %"),
    usual("E201", rf"\b(?:open|opened)\(\s*({NAME})\s*\)", r"openness(\1) > 20 %"),
    usual("E127", rf"\bperiodic\(\s*({CALL})\s*,\s*({TIME}(?:\s+to\s+{TIME})?)\s*\)", r"\1 every \2"),
    usual("E127", r"\s*\bperiodically\b", " every 5 s"),
    usual("E101", rf"\bevery\s+({TIME}(?:\s+to\s+{TIME})?)\s+({CALL})", r"\2 every \1"),
    usual("E101", r"\beach(?=\s+\d)", "every"),
    usual("E101 E119 E116", r"((?:every|after) [\d.]+)\s*\w*\s*(?:and|or|,|-|\.\.)\s*([\d.]+)\s*(\w+)",
           r"\1 \3 to \2 \3"),
    usual("E208", r"\s*\bpauses\s+when\b.*$", ""),
    usual("E133", rf"\b({CONDITION_KIND})\s+(?:if|while|on|once|whenever)\b", r"\1 when"),
    usual("E133", rf"\b({CONDITION_KIND})\s+(?={NAME}\()", r"\1 when "),
    usual("E133", rf"\b({CONDITION_SYNONYM})\s+(?:when|if|while|on)\b",
           lambda m: f"{CONDITION_SYNONYMS[m[1]]} when"),
    usual("E133", rf"\b({CONDITION_SYNONYM})\s+(?={NAME}\()", lambda m: f"{CONDITION_SYNONYMS[m[1]]} when "),
    usual("E134", r"\b(at\s+(?:least|most)\s+\d+)\b(?!\s*times?)", r"\1 times"),
    usual("E134", r"\b(at\s+(?:least|most))\s+(once|twice|thrice)\b",
           lambda m: f"{m[1]} {COUNT_WORDS[m[2]]}"),
    usual("E134", r"\btwice\b", "at least 2 times at most 2 times"),
    usual("E134", r"\b(?:thrice|three times)\b", "at least 3 times at most 3 times"),
    usual(
        "E134",
        rf"\brepeat\s+(\d+)\s*(?:times|x)?\s*(?:of\s+)?({CALL}|<[^>]*>)",
        r"\2 at least \1 times at most \1 times",
    ),
    usual(
        "E134", r"\brepeat(?:ed)?\s+(\d+)(?:\s*(?:times|x))?", r"at least \1 times at most \1 times"
    ),
    usual("E134", rf"\brepeat(?:edly)?\s+({CALL}|<[^>]*>)", r"\1+"),
    usual("E134", r"\b(\d+)\s*(?:times|x)\b", r"at least \1 times at most \1 times"),
    usual("E135", r"\bin\s+(?=any\s+order)", ""),
    usual("E135 E101", rf"\b(any\s+order|any\s+\d+\s+of)\s+({ITEM}(?:\s*(?:,|and|or)\s*{ITEM})+)",
           lambda m: f"{m[1]} ({', '.join(re.findall(ITEM, m[2]))})"),
    usual("E135", rf"\b(any\s+order|any\s+\d+\s+of)\s*\(\s*({ITEM}(?:\s+{ITEM})+)\s*\)",
           lambda m: f"{m[1]} ({', '.join(re.findall(ITEM, m[2]))})"),
    usual("E101 E103 E115", r"\bfor\s+(?:each|every|any)\s+(?:other|next|another)\s+", "for each new "),
    usual("E101 E115", rf"\bfor\s+each\s+new\s+(?={NAME}\s*\(([^()]*,)?\s*({NAME})\s*\))",
           r"for each new \2 "),
    usual("E101 E115", rf"\bfor\s+each\s+(?:of\s+)?({NAME}(?:\s*,\s*{NAME})+)\s+", r"for each one of (\1) "),
    usual("E101 E119", r"\b(every|between|after)\s+([\d.]+)\s*(to|and)\s*([\d.]+)\s*([a-z%][\w/]*)",
           r"\1 \2 \5 \3 \4 \5"),
    usual("E101 E116", r"\bfor\s+([\d.]+)\s*(?:[a-z]+\s*)?(?:to|-)\s*([\d.]+)\s*([a-z]+)",
           r"for \1 \3 within \2 \3"),
    usual("E101 E103", rf"\b(?:wait|pause|delay)(?:\s+for)?\s+({TIME})\s*({ITEM})", r"\2 after \1"),
    usual("E101 E103 E119", rf"({ITEM})\s+optional(?:ly)?\b", r"\1?"),
    usual("E101 E103 E119", rf"\boptional(?:ly)?\s+({ITEM})", r"\1?"),
    usual("E124", rf"\bactor\s+({NAME})\s+(?:are|was|means|equals|be)\b", r"actor \1 is"),
    usual("E124", r"\b(is|and)\s+(largest|smallest|leftmost|rightmost|highest|lowest)\b", r"\1 the \2"),
    usual("E115 E116 E127", rf"\b(for|within|after)\s+(?:[a-z]+\s+){{1,3}}(?={TIME})", r"\1 "),
    usual("E115 E101", r"\bfor\s+(?:every|any|all)\s+new\s+", "for each new "),
    usual("E115 E101", r"\b(for\s+each\s+new\s+\w+)\s*[:,]", r"\1 "),
    usual("E135", r"\b(any\s+order)\s+((?:<[^>]*>\s*){2,})", lambda m: _listed(m[1], m[2])),
    usual("E204", rf"^\s*<{NAME}[^>]*>\s*::=.*$", ""),
    usual("E127 E101", rf"\b(after\s+{TIME})\s*(?:until|till|up\s+to|and|-)\s*({TIME})", r"\1 to \2"),
    usual("E127 E101",
           r"\b(?:in\s+case\s+of|upon|after|if|when)\s+(?:a\s+)?(?:failure|error)\s+of\b", "on failure of"),
    usual("E101 E124 E103", r"\bwhat\s+(?:comes|came|arrives|entered|appears)(?:\s+in)?\s+(from)\b",
           r"what enters \1"),
    usual("E101 E124 E103", r"\bwhat\s+(?:moved|starts)\s+first\b", "what moves first"),
    usual("E101 E124 E103", r"\bwhat\s+(?:stands|stays|lies|is\s+at\s+rest)\b(?:\s+still)?", "what rests"),
    usual("E101 E124 E103", r"\bmost\s+(left|right)\b", r"\1most"),
    usual("E127", rf"\s*\b(?:until|unless|while|since)\s+({CALL})", r" ends when \1"),
    usual("E127", rf"\b(?:if)\s+({CALL})\s*(?:then)?", r"\1"),
    usual("E108", r"<\s*([^<>]+?)\s*>", lambda m: f"<{re.sub(r'[^0-9a-zA-Z_]+', '_', m[1])}>"),
    usual("E107", rf"<({NAME})(?![\w>])", r"<\1>"),
    usual("E201", rf"\b({NAME})(?=\s*\()", lambda m: _intended_action(m[1].lower())),
    usual("E201", rf"\b{NAME}(?=\s*\(\s*{NAME}\s*\))", "moving"),
    usual("E201", rf"\b({NAME})\(\s*({NAME})\s*,\s*({NAME})\s*\)",
           lambda m: f"{_intended_action(m[1])}({m[2]}) & {_intended_action(m[1])}({m[3]})"),
    usual("E202", rf"<({NAME})>\s*", ""),
    usual("E205", rf"\b({NAME})\(\s*({NAME})\s*,\s*({NAME})\s*(?:,[^()]*)?\)", r"\1(\2, \3)"),
    usual("E205", rf"\b({NAME})\(\s*({NAME})\s*,[^()]*\)", r"\1(\2)"),
    usual("E206", rf"<({NAME})>\s*::=\s*<\1>\s*([^\n|]+)", r"<\1> ::= \2 <\1>?"),
    usual("E218", r"\b(?:seconds?|secs?|sec)\b", "s"),
    usual("E218", r"\b(?:minutes?|mins|m)\b", "min"),
    usual("E218", r"\b(?:pixels?|pix)\b", "px"),
    usual("E218", r"\b(?:hours?|hrs?)\b", "h"),
    usual("E218", r"\bpercent\b", "%"),
    usual("E219", rf"\b({NAME})\s+({NAME}),?\s+({NAME})\b", r"\1(\2, \3)"),
    usual("E219", rf"\b(never|always)\s+({NAME})\s+({NAME})", r"\1 moving(\3)"),
    usual("E219", rf"\b({NAME})\s+({NAME})\s+({NAME})\b", r"\2(\1, \3)"),
    usual("E223", r"\b(px|s|ms|min|deg|m)\b", r"20 \1"),
    usual("E223", rf"\b(for|within|after|every)\s+{NAME}", r"\1 5 s"),
    usual("E226", r"([\d.]+)\s*[a-z/%]+", r"\1 px"),
    usual("E226", r"([\d.]+)\s*[a-z/%]+", r"\1 s"),
    usual("E226", r"([\d.]+)\s*[a-z/%]+", r"\1 px/s"),
    usual("E227", rf"\bsignal(\(\s*{NAME}\s*\))", r"signal_on\1"),
    usual("E227", rf"({CALL})", r"\1 < 5 px"),
    usual("E227", rf"({CALL})", r"\1 < 5 s"),
    usual("E227", rf"({CALL})", r"\1 < 5 px/s"),
    usual("E229", rf"\b(?:inside|outside|reaching)\(\s*({NAME})\s*,\s*({NAME})\s*\)", r"touching(\1, \2)"),
    usual("E117", rf"\(\s*({NAME})\s+({NAME})\s*\)", r"(\1, \2)"),
    usual("E117", r",\s*\)", ")"),
    usual("E118", rf"\b({NAME})\s*\(\s*\)", r"\1(one, other)"),
    usual("E201 E219", rf"(::=)\s*((?:{NAME}\s+){{1,7}}{NAME})\s*$", lambda m: f"{m[1]} {plain_call(m[2])}"),
    usual("E205", rf"\b(inside|outside|reaching|wholly_inside)\(\s*({NAME})\s*\)\s*$",
           r"\1(\2, berth) zone berth is (100, 50) (300, 50) (300, 200)"),
    usual("E113", rf"<({NAME})>\s*(\([^()]*\))", r"\1\2"),
    usual("E207", rf"(<{NAME}>)(?!\s*::=)(?![?*+])", r"\1?"),
    usual("E206", rf"(<({NAME})>\s*::=)\s*<\2>\s*$", r"\1 present(x)"),
    usual("E228", rf"\b{NAME}(\([^()]*,[^()]*\))(?=\s*[<>])", r"gap\1"),
    usual("E228", rf"\b{NAME}(\([^(),]*\))(?=\s*[<>])", r"speed\1"),
    usual("E228", r"(\))\s*[<>]=?\s*[\d.]+\s*[a-z%/]*", r"\1"),
    usual("E233", r"\bat\s+least\s+(\d+)\s+times\s+at\s+most\s+(\d+)", r"at least \2 times at most \1"),
    usual("E234", rf",\s*({ITEM})\s*\)(?=[^()]*$)", r") \1"),
    usual("E238", r"\band\s+([\d.]+)\s*([a-z%/]+)", lambda m: f"and {2 * float(m[1]) or 1:g} {m[2]}"),
    usual("E229", rf"\b(\w+)\(\s*({NAME})\s*,\s*({NAME})\s*\)", r"\1(\3, \2)"),
    usual("E229", rf"\b{NAME}(\(\s*{NAME}\s*,\s*{NAME}\s*\))", r"inside\1"),
    usual("E226", rf"\b(for|within|after|every)\s+{NAME}", r"\1 5 s"),
    usual("E113", rf"<\s*({CALL})\s*>", r"\1"),
    usual("E101 E103 E119", rf"(?<![\w>])({PAIR})(?=\s*(?:[<>]|between\b))", r"gap\1"),
    usual("E101 E103 E119", rf"(?<![\w>])({PAIR})", r"touching\1"),
    usual("E126", r"([?*+])\s*(<[^>]*>|\([^()]*\))", r"\2\1"),
)  # fmt: skip
"""Tried in this order."""

_FAILURE = r"(?:failures?|fail(?:s|ed|ing)?|errors?)"
_TARGET = rf"(?:stage\s+)?({CALL}|<\s*{NAME}\s*>|{NAME})"
_RECOVERY = re.compile(
    rf"\bon[ _]?{_FAILURE}\b\s*(?:(?:of|in|at)\b\s*)?\(?(?:{_TARGET}\s*\)?\s*"
    r"(?::|->|=>|\bdo\b|\bthen\b|(?=<))|:)?\s*"
    rf"|\b(?:if|when(?:ever)?|once)\s+{_TARGET}\s+(?:has\s+|is\s+)?{_FAILURE}\b\s*(?::|,|->|\bdo\b|\bthen\b)?\s*"
)
_STAGE = re.compile(rf"<\s*({NAME})\s*>\s*::=([^\n]*)")


def recoveries(text: str, line: str) -> Iterator[tuple[re.Match[str], str]]:
    """Recoveries that a line may mean, written in other words: what to do after a failure.

    The failed stage is the one named, or one that requires the named action, or the stage of this line, or
    the first one after the task.

    Args:
        text: The whole file.
        line: A line of it.

    Yields:
        The matched text, and the beginning of a recovery that replaces it.
    """
    stages = {m[1]: m[2] for m in _STAGE.finditer(text)}
    own_stage = _STAGE.match(line.lstrip())
    for match in _RECOVERY.finditer(line):
        target = match[1] or match[2] or ""
        stage = target.strip("<> ")
        requiring = (
            name for name, course in stages.items() if target and _same_call(target, course)
        )
        candidates = [stage] if stage in stages else [*requiring]
        candidates += [own_stage[1]] if own_stage else [*stages][1:2]
        yield from ((match, f"on failure of <{name}>: ") for name in dict.fromkeys(candidates))


def _same_call(call: str, course: str) -> bool:
    """Whether a course contains a call, apart from blanks."""
    return "".join(call.split()) in "".join(course.split("on failure")[0].split())
