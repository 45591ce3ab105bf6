"""Keywords of the language with their syntax and meaning, and how messages name what a parser expects."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Set as AnySet
from types import MappingProxyType

from visup.agent.model.did_you_mean import did_you_mean
from visup.rules.language.diagnostics import either

Entry = tuple[str, str]
"""Syntax and meaning."""

_WINDOW = ("f for 2 s to 5 s ago", "f was true during all of that time; also with `within`")
_SHARE = ("f in 60 % of 2 s", "f was true for at least 60 % of the last 2 s")
_SAMPLES = ("f in 3 of 5 samples", "f was true at three or more of the last five samples")
_LET = (
    "let x be q at f: g",
    "g, in which x is the value that q had when f was last known to be true; f may be `rising(...)`",
)
_REPEAT = ("b may repeat", "b may stand for the same object as another variable")

_ENTRIES: dict[str, Entry] = {
    "rule": ("rule NAME(a, b): warning", "a rule, evaluated for every choice of objects"),
    "when": ("when f", "what must be true"),
    "unless": ("unless f", "what suspends the rule"),
    "hold": ("hold 3 s", "the alert stays open for this long after the rule was last true"),
    "cooldown": ("cooldown 10 s", "for this long the same objects raise no new alert"),
    "say": ('say "{a} {is} near {b}."', "the sentence that is reported"),
    "and": ("f and g", "both are true"),
    "or": ("f or g", "at least one of them is true"),
    "not": ("not f", "f is false"),
    "for": ("f for 2 s", "f has been true during all of the last 2 s"),
    "within": ("f within 2 s", "f was true at some time in the last 2 s"),
    "since": ("f since g", "g was true, and f has been true at every sample after that"),
    "until": ("f until[5 s] g", "g will be true within 5 s, and f is true up to then"),
    "once": ("once f", "f was true at some time so far; `once[5 s] f` in the last 5 s"),
    "always": ("always f", "f was true at all times so far; `always[5 s] f` in the last 5 s"),
    "eventually": ("eventually[5 s] f", "f is true at some time in the next 5 s"),
    "henceforth": ("henceforth[5 s] f", "f is true at all times in the next 5 s"),
    "exists": ("exists b: f", "f is true of some other object"),
    "forall": ("forall b: f", "f is true of all other objects"),
    "in": _SHARE,
    "of": _SHARE,
    "samples": _SAMPLES,
    "leave": ("q > 5 px/s leave 3 px/s", "becomes true above 5, stays true until q is below 3"),
    "to": _WINDOW,
    "ago": _WINDOW,
    "may": _REPEAT,
    "repeat": _REPEAT,
    "true": ("true", "always"),
    "false": ("false", "never"),
    "implies": ("f implies g", "f is false or g is true"),
    "iff": ("f iff g", "both or neither is true"),
    "xor": ("f xor g", "exactly one of them is true"),
    "release": ("f release[5 s] g", "g stays true for 5 s, or until f becomes true"),
    "previous": ("previous f", "f was true at the sample before"),
    "let": _LET,
    "be": _LET,
    "at": _LET,
}
KEYWORDS: Mapping[str, Entry] = MappingProxyType(_ENTRIES)
"""Reserved words of the language."""

FUNCTIONS: Mapping[str, Entry] = MappingProxyType(
    {
        "abs": ("abs(q)", "the amount without its sign"),
        "min": ("min(q, r)", "the least of them"),
        "max": ("max(q, r)", "the greatest of them"),
        "sqrt": ("sqrt(q)", "the square root"),
        "exp": ("exp(q)", "e to the power of a number without unit"),
        "power": ("power(q, 2)", "the power"),
        "rate": ("rate(q, 2 s)", "the change over 2 s, per second"),
        "before": ("before(q, 2 s)", "the value 2 s ago"),
        "lowest": ("lowest(q, 2 s)", "the least value of the last 2 s"),
        "highest": ("highest(q, 2 s)", "the greatest value of the last 2 s"),
        "last": (
            "last(q, 0.5 s)",
            "what it was when last known, at most 0.5 s ago; also of formulas",
        ),
        "rising": ("rising(f)", "the sample at which f becomes true"),
        "falling": ("falling(f)", "the sample at which f stops being true"),
    }
)
"""Functions of quantities and formulas."""


_TERMINALS = {
    "LPAR": "'('",
    "RPAR": "')'",
    "COLON": "':'",
    "COMMA": "','",
    "SEVERITY": "info, warning or critical",
    "NAME": "a name",
    "NUMBER": "a number",
    "UNIT": "a unit (ms, s, min, h, px, px/s, px/s2, %, deg, deg/s, /s, m, cm, mm, m/s)",
    "STRING": "a sentence in double quotes on one line",
    "OPERATOR": "<, <=, >, >=, == or !=",
    "LSQB": "'['",
    "RSQB": "']'",
    "__ANON_0": "'..'",
    "PLUS": "'+'",
    "MINUS": "'-'",
    "TIMES": "'*'",
    "OVER": "'/'",
    "PAST": "'once', 'always'",
    "FUTURE": "'eventually', 'henceforth'",
    "QUANTIFIER": "'exists', 'forall'",
    "REPEAT": "'may repeat'",
    "LITERAL": "'true' or 'false'",
    "$END": "the end of the file",
}
"""Terminals of the grammar, in the words of messages; keywords stand for themselves."""


def expected_words(wanted: AnySet[str]) -> str:
    """What a parser accepts, as a list of words to choose from; of many the usual ones.

    Args:
        wanted: Names of terminals of the grammar.
    """
    words = sorted({_TERMINALS.get(w, f"'{w.lower()}'") for w in wanted})
    if len(words) > MAX_EXPECTED:
        words = [w for w in words if w not in _SELDOM][:MAX_EXPECTED]
    return either(words)


MAX_EXPECTED = 8
"""Most expected words listed; rarer ones are left out."""
_SELDOM = frozenset(
    f"'{w}'"
    for w in (
        *("iff", "xor", "release", "leave", "*", "/", "+", "-"),
        *("implies", "since", "in", "cooldown", "previous", "let"),
    )
)


def near_word(found: str, wanted: AnySet[str]) -> str | None:
    """A hint if a word looks like one of those that a parser accepts.

    Args:
        found: The word that stands there.
        wanted: Names of terminals of the grammar.
    """
    known = [w.lower() for w in wanted if w not in _TERMINALS]
    known += ["info", "warning", "critical"] if "SEVERITY" in wanted else []
    return did_you_mean(found, known) if found else None
