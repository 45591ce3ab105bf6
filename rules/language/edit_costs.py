"""Edit costs of the rule language: inserting, dropping and replacing words in error correction."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from types import MappingProxyType

from lark import Lark

from visup.agent.model.did_you_mean import close_matches, closest
from visup.rules.correction.automaton import LrAutomaton
from visup.rules.correction.everyday_phrases import FILLERS, meanings_of
from visup.rules.correction.plain_sentences import LONGEST, called, sentences, terminals_of_call
from visup.rules.correction.repair_search import EditCosts, Replacement
from visup.rules.correction.tokens import Word, terminals_of
from visup.rules.formula.units import UNITS_MEANT, Unit
from visup.rules.language.keywords import FUNCTIONS, KEYWORDS
from visup.rules.language.synonyms import MISSPELLING, meant_word, synonym
from visup.rules.predicates.vocabulary import RULES

SURE, LIKELY, GUESS = 0.1, 0.3, 0.6
"""Cost of replacing a word: by one that differs in case; by a synonym; by one spelt similarly."""
NOISE_COST, WORD_COST, KNOWN_COST = 0.2, 0.7, 2.5
"""Cost of dropping a filler word, an unknown word, and a known word."""
LONGEST_NAME = 4
"""Most words joined to one name, such as `time to contact` for `time_to_contact`."""

_SIGNS = {"RPAR": ")", "LPAR": "(", "COMMA": ",", "COLON": ":", "RSQB": "]", "LSQB": "["}
_PUT_IN = {
    **{name: (1.0, (sign,)) for name, sign in _SIGNS.items()},
    "__ANON_0": (1.0, ("..",)),
    **{word.upper(): (1.3, (word,)) for word in ("and", "for", "when", "rule", "say", "at", "be")},
    **{word.upper(): (0.9, (word,)) for word in ("of", "samples", "ago", "to")},
    "OPERATOR": (1.5, ("<", ">")),
    "UNIT": (0.8, ("s", "px", "px/s", "%", "deg", "deg/s", "m")),
    "NUMBER": (2.0, ("2", "20")),
    "SEVERITY": (1.5, ("warning",)),
}
_BRACKETS: Mapping[str, tuple[str, str, float]] = MappingProxyType(
    {
        **dict.fromkeys("[{", ("LPAR", "(", LIKELY)),
        **dict.fromkeys("]}", ("RPAR", ")", LIKELY)),
        "(": ("LSQB", "[", GUESS),
        ")": ("RSQB", "]", GUESS),
    }
)
"""Brackets of other kinds."""
_LET = {
    **dict.fromkeys(("=", ":=", "as", "is"), "be"),
    **dict.fromkeys(("when", "if", "upon"), "at"),
}
"""Words that stand in place of `be` and `at` after `let`."""
_NAMED = re.compile(r"\brule\s+(\w+)")
_HEAD = re.compile(r"\A[^\n\"]*?\w[ ]*[(\[]([^)\n]*)[)\]]?[ ]*:[^\n]*")
_ARGUMENTS = re.compile(r"\(([^()\n]*)\)|\{(\w+)\}")
_NAMES = re.compile(r"(?<![\w\"'.])[A-Za-z_]\w*")
_UNITS = tuple(u for u in Unit if u)
_VOCABULARY = (*RULES.predicates, *RULES.quantities, *FUNCTIONS)


def edit_costs(parser: Lark, start: str, text: str) -> EditCosts:
    """The edit costs for a text of rules.

    Args:
        parser: Parser of rules.
        start: Start symbol, 'start' for rules or 'formula'.
        text: A text with a syntax error.
    """
    variables, lacking = variables_of(text)
    put: dict[str, tuple[float, tuple[str, ...]]] = dict(_PUT_IN)
    said = " ".join(f"{{{v}}}" for v in variables[:3])
    name = _NAMED.search(text)
    plain = name[1].replace("_", " ") if name else "something is to be told"
    put["STRING"] = (2.0, (f'"{said or plain}"', f'"{plain}"'))
    put["NAME"] = (2.2, (*variables[:3], *lacking) or ("a",))
    meant = partial(_meant, variables, lacking)
    return EditCosts(_automaton(parser, start), terminals_of(parser), put, _drops(variables), meant)


def variables_of(text: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The variables of a faulty rule, and those that it uses but its head lacks.

    The first are the names in its head that it uses; if there are none, all in its head, or all that it
    uses.
    """
    head = _HEAD.search(text)
    rest = text[head.end() :] if head else text
    named = [w for m in _ARGUMENTS.finditer(rest) for w in _NAMES.findall(m[1] or m[2] or "")]
    used = [w for w in dict.fromkeys(named) if w not in (*_VOCABULARY, *KEYWORDS, "is")]
    given = dict.fromkeys(_NAMES.findall(head[1])) if head else {}
    found = tuple(w for w in given if w in used) or tuple(given) or tuple(used)
    return found, tuple(w for w in used if w not in found)


@lru_cache(maxsize=4)
def _automaton(parser: Lark, start: str) -> LrAutomaton:
    return LrAutomaton.of(parser, start)


def _drops(variables: Sequence[str]) -> Callable[[Word], float]:
    known = {*variables, *_VOCABULARY}

    def drop(word: Word) -> float:
        if word.text.casefold() in FILLERS and word.text not in known:
            return NOISE_COST
        if not word.terminals:
            return NOISE_COST if len(word.text) == 1 else WORD_COST
        if word.terminals[0] == "NAME":
            return KNOWN_COST if word.text in known else WORD_COST
        return COST_OF_LEAVING_OUT.get(word.terminals[0], 1.6)

    return drop


COST_OF_LEAVING_OUT: Mapping[str, float] = MappingProxyType(
    {
        **dict.fromkeys(("RPAR", "COMMA", "COLON", "PLUS", "OVER", "TIMES", "RSQB", "LSQB"), 0.9),
        "UNIT": 0.8,
        "NUMBER": 1.5,
        **dict.fromkeys(("STRING", "RULE", "WHEN", "SAY"), 2.0),
        "LPAR": 1.1,
    }
)


def _meant(
    variables: Sequence[str], lacking: Sequence[str], words: Sequence[Word], at: int
) -> list[Replacement]:
    said = [w.text for w in words[at : at + LONGEST]]
    found = [
        Replacement(n, terminals_of_call(len(call) - 1), called(call), LIKELY)
        for n, call in sentences(said, variables, _verb)
    ]
    head = _head_meant([w.text for w in words[:LONGEST_HEAD]], variables) if at == 0 else None
    found += _calls_meant(said, variables)
    if words[at].text in KEYWORDS and all(w.text != "when" for w in words[:at]):
        found += [Replacement(1, ("NAME",), name, LIKELY) for name in lacking]
    return [*_meanings(words, at), *found, *([head] if head else [])]


def _calls_meant(said: Sequence[str], variables: Sequence[str]) -> Iterator[Replacement]:
    """Calls written as words without brackets, or missing before what follows."""
    first, follows = said[0], said[1] if len(said) > 1 else ""
    if first in _ARGUMENT_KINDS and follows != "(":
        kinds = _ARGUMENT_KINDS[first]
        given = [w for w in said[1 : len(kinds) + 1] if w.isidentifier() and w not in KEYWORDS]
        for words in (given, list(variables)):
            if kinds and len(words) >= len(kinds):
                call, read = (first, *words[: len(kinds)]), len(kinds) if words is given else 0
                yield Replacement(1 + read, terminals_of_call(len(kinds)), called(call), LIKELY)
    if first.isidentifier() and first not in _ARGUMENT_KINDS and follows in ("<", ">", "<=", ">="):
        yield Replacement(1, terminals_of_call(1), f"signal({first})", GUESS)
    if first in ("say", "hold", "cooldown", "unless") and variables:
        call = ("touching", *variables[:2]) if len(variables) > 1 else ("seen", *variables)
        yield Replacement(
            0, ("WHEN", *terminals_of_call(len(call) - 1)), f"when {called(call)}", 2 * GUESS
        )


def _head_meant(said: Sequence[str], variables: Sequence[str]) -> Replacement | None:
    """The head of a rule, from the words before `when`: a name, the used variables, the severity."""
    ends = (n for n, w in enumerate(said) if w.casefold() in _WHEN)
    before = said[: next(ends, 0)]
    severity = next((s for w in before if (s := _severity(w))), "warning")
    spare = {*variables, *FILLERS, "rule", "severity", "level", "name", "def", "class"}
    words = (w for w in before if w.isidentifier() and w not in spare and not _severity(w))
    name = next((w for w in words if closest(w, ["rule"], 0.7) is None), None)
    name = "watch" if name is None and said[0] == "when" else name
    if name is None or not variables:
        return None
    name = f"{name}_1" if name in KEYWORDS else name
    terminals = ("RULE", *terminals_of_call(len(variables)), "COLON", "SEVERITY")
    return Replacement(
        len(before), terminals, f"rule {name}({', '.join(variables)}): {severity}", 2 * GUESS
    )


def _severity(word: str) -> str | None:
    """The severity meant by a word."""
    low = word.strip('"').casefold()
    return next((s for s, words in SEVERITIES.items() if low == s or low in words), None)


SEVERITIES: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "critical": frozenset(
            [
                "error",
                "fatal",
                "alarm",
                "emergency",
                "danger",
                "dangerous",
                "high",
                "severe",
                "crit",
                "stop",
            ]
        ),
        "warning": frozenset(
            ["warn", "medium", "moderate", "caution", "important", "alert", "warnung"]
        ),
        "info": frozenset(
            ["note", "notice", "debug", "low", "information", "minor", "log", "hint"]
        ),
    }
)
"""Common words for severities."""
LONGEST_HEAD = 24
_WHEN = frozenset(("when", "if", "whenever", "wenn", "si", "quand", "wen", "whn"))


def _verb(word: str, things: int) -> str | None:
    """The relation between this many objects meant by a word."""
    known = _RELATIONS[things - 1]
    if word in known:
        return word
    return closest(word, known, MISSPELLING) or synonym(word, known)


_ARGUMENT_KINDS = {name: word.argument_kinds for name, word in RULES.predicates.items()} | {
    name: quantity.argument_kinds for name, quantity in RULES.quantities.items()
}
_RELATIONS = [
    [name for name, kinds in _ARGUMENT_KINDS.items() if kinds == ("object",) * things]
    for things in (1, 2)
]


def _meanings(words: Sequence[Word], at: int) -> Iterator[Replacement]:
    """Possible meanings of the words from an index on."""
    said = [w.text for w in words[at : at + LONGEST_NAME]]
    first, called = said[0], len(said) > 1 and said[1] == "("
    for length, meant in meanings_of(said):
        if meant.casefold() != first.casefold() or length > 1:
            yield Replacement(length, (_terminal(meant),), meant, LIKELY)
    if at and words[at - 1].text[0].isdigit():
        units = close_matches(first.casefold(), _UNITS, n=2, cutoff=0.5)
        yield from (
            Replacement(1, ("UNIT",), unit, GUESS)
            for unit in units
            if words[at].terminals[:1] != ("UNIT",)
        )
    if first.casefold() in UNITS_MEANT:
        yield Replacement(1, ("UNIT",), UNITS_MEANT[first.casefold()], LIKELY)
    yield from _signs_meant(first)
    if first in TEMPORAL and len(said) > 1 and said[1] in "[(":
        yield Replacement(1, (_terminal(TEMPORAL[first]),), TEMPORAL[first], LIKELY)
    if not first[0].isalpha():
        return
    for length in range(2, len(said) + 1):
        joined = "_".join(said[:length]).replace("_-_", "_")
        if joined in _VOCABULARY:
            yield Replacement(length, ("NAME",), joined, LIKELY)
    if first in KEYWORDS:
        if called or (len(said) > 1 and said[1] in ",)"):
            yield Replacement(1, ("NAME",), f"{first}_1", GUESS)
    elif first.casefold() in KEYWORDS:
        yield Replacement(1, (_terminal(first.casefold()),), first.casefold(), SURE)
    elif not called and first not in _VOCABULARY and (near := closest(first, KEYWORDS, 0.7)):
        yield Replacement(1, (_terminal(near),), near, GUESS)
    if called and first not in _VOCABULARY:
        named = meant_word(first, _VOCABULARY)
        if named is not None:
            yield Replacement(1, ("NAME",), named, LIKELY)


def _signs_meant(first: str) -> Iterator[Replacement]:
    """Possible meanings of signs, and of the small words of `let`."""
    if first in (",", ":", "-", "to"):
        yield Replacement(1, ("__ANON_0",), "..", LIKELY)
    if first in _LET:
        yield Replacement(1, (_LET[first].upper(),), _LET[first], GUESS)
    if first in _BRACKETS:
        terminal, bracket, cost = _BRACKETS[first]
        yield Replacement(1, (terminal,), bracket, cost)


TEMPORAL: Mapping[str, str] = MappingProxyType(
    {
        "G": "henceforth", "F": "eventually", "H": "always", "O": "once", "P": "once", "S": "since",
        "U": "until", "R": "release", "globally": "henceforth", "finally": "eventually",
        "historically": "always", "previously": "once", "always": "henceforth", "ev": "eventually",
        "alw": "henceforth", "next": "eventually",
    }
)  # fmt: skip
"""Temporal operators of other logics, before a window."""


def _terminal(word: str) -> str:
    """The terminal of a word of the language."""
    if word in ("<", "<=", ">", ">=", "==", "!="):
        return "OPERATOR"
    if word.isdigit():
        return "NUMBER"
    return next((t for t, words in _TERMINALS.items() if word in words), word.upper())


_TERMINALS = {
    "QUANTIFIER": ("exists", "forall"),
    "PAST": ("once", "always"),
    "FUTURE": ("eventually", "henceforth"),
    "LITERAL": ("true", "false"),
    "SEVERITY": ("info", "warning", "critical"),
}
