"""Corrections that make a statement of a task file parse: what changing its words costs, and the hints."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType

from visup.agent.model.did_you_mean import close_matches, closest
from visup.agent.model.errors import SourceLocation
from visup.rules.correction.automaton import LrAutomaton
from visup.rules.correction.everyday_phrases import FILLERS, meanings_of
from visup.rules.correction.local_edits import TOKEN, Repair
from visup.rules.correction.plain_sentences import LONGEST, called, sentences, terminals_of_call
from visup.rules.correction.repair_search import EditCosts, Replacement, least_cost_repairs
from visup.rules.correction.tokens import Terminals, Word, terminals_of
from visup.rules.formula.units import UNITS_MEANT
from visup.rules.language.diagnostics import Source
from visup.rules.language.fixes import fix_of
from visup.rules.language.synonyms import synonym
from visup.tasks.actions.actions import ACTIONS, known_actions
from visup.tasks.diagnostics.course_error_patterns import SIGNS_MEANT
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.diagnostics.recovery import KEYWORDS, NEVER_NAMES, split
from visup.tasks.grammar.parser import parser
from visup.tasks.grammar.statement import NAME, PARAMETERS, StatementText

SURE, LIKELY, GUESS = 0.1, 0.3, 0.6
"""Cost of replacing a word: by one that differs in case; by a synonym; by one of similar spelling."""
NOISE_COST, WORD_COST, KNOWN_COST = 0.2, 0.7, 2.5
"""Cost of deleting a filler word, an unknown word, and a known one."""
LONGEST_NAME = 4
"""Maximum number of words that may be meant as one name."""
ANY_NAME = ("NAME", "UNIT", "MODEL")
"""Terminals that match any word."""
_PUT_IN = {
    ")": 1.0, "(": 1.0, ",": 1.0, ":": 1.0, "&": 1.6, "=": 1.2, "when": 0.8, "order": 0.5, "of": 0.6,
    "each": 0.8, "to": 0.9, "least": 0.8, "most": 0.8, "times": 0.5, "than": 0.5, "first": 0.5, "from": 0.5,
    "ignored": 0.5, "is": 0.9, "and": 1.3, "for": 1.3, "within": 1.4, "at": 1.0, "the": 0.4, "largest": 1.6,
    "red": 1.6, "what": 1.0, "<": 1.5, "5": 2.0, "2": 1.6, "any": 1.0, "new": 1.0, "left": 1.5,
    "actor": 1.3, "during": 1.5, '"dock"': 2.0, "larger": 1.4, "enters": 1.4, "moves": 1.4, "part": 1.2,
    "zone": 1.3, "parameter": 1.3, "never": 1.5,
}  # fmt: skip
"""Cost of inserting a word."""
_BRACKETS = {"[": "(", "]": ")", "{": "(", "}": ")"}
_BEGINNINGS = {
    "actor": "object|entity|robot|agent|player|model|item|thing|body|actors",
    "parameter": "param|params|const|constant|let|set|define|def|var|variable|parameters|value",
    "zone": "area|region|place|rect|rectangle|polygon|zones",
    "ground": "floor|plane",
    "include": "import|use|load|using|includes",
    "never": "forbid|forbidden|avoid|prohibit|prevent|not|nie|jamais|nunca|no|exclude|disallow",
    "always": "ensure|require|requires|must|invariant|assert|keep|maintain|immer|toujours|siempre",
    "bystander": "ignore|bystanders|ignored|ignoring",
}
_STATEMENT = {word: meant for meant, words in _BEGINNINGS.items() for word in words.split("|")}
_RANKS = {"biggest": "largest", "tallest": "largest", "longest": "largest", "tiniest": "smallest",
          "topmost": "highest", "uppermost": "highest", "top": "highest", "bottom": "lowest",
          "nearest": "lowest", "bottommost": "lowest"}  # fmt: skip
_LASTING = {"bigger": "larger", "longer": "larger", "taller": "larger", "shorter": "smaller",
            "moved": "moves", "starts": "moves", "comes": "enters", "came": "enters",
            "arrives": "enters", "appears": "enters", "entered": "enters", "stays": "rests",
            "stands": "rests", "lies": "rests", "who": "what", "which": "what"}  # fmt: skip
_CALLS = re.compile(rf"({NAME})\s*\(([^()<>]*)\)")


def speller(text: str) -> EditCosts:
    """The speller for a task file.

    Args:
        text: The whole file, for its names.
    """
    calls = [(m[1], re.findall(NAME, m[2])) for m in _CALLS.finditer(text)]
    actors = tuple(dict.fromkeys(a for _, names in calls for a in names if a not in NEVER_NAMES))
    stages = frozenset(re.findall(rf"<\s*({NAME})\s*>\s*:", text))
    put = {**_put(), "NAME": (2.2, (*actors[:3], "other"))}
    meanings = _Meanings(stages)
    return EditCosts(
        _automaton(), _terminals(), put, _drops({*actors, *stages}), meanings, ("MODEL",)
    )


@lru_cache(maxsize=1)
def _automaton() -> LrAutomaton:
    return LrAutomaton.of(parser(), "start")


def _terminals() -> Terminals:
    return terminals_of(parser())


@lru_cache(maxsize=512)
def _terminals_of(word: str) -> tuple[str, ...]:
    """The terminals that a word of the language may be, regardless of what follows."""
    return tuple(t.name for t in _terminals() if t.name not in ANY_NAME and t.alone.fullmatch(word))


@lru_cache(maxsize=1)
def _put() -> Mapping[str, tuple[float, tuple[str, ...]]]:
    found: dict[str, tuple[float, tuple[str, ...]]] = {}
    for word, cost in _PUT_IN.items():
        for terminal in _terminals_of(word):
            found.setdefault(terminal, (cost, (word,)))
    found["HEAD"] = (3.0, ("<task> ::=",))
    found["UNIT"] = (0.8, ("s", "px", "px/s", "m", "%"))
    found["MODEL"] = (2.2, ("other",))
    return MappingProxyType(found)


def _drops(names: set[str]) -> Callable[[Word], float]:
    known = names | set(known_actions())

    def drop(word: Word) -> float:
        if word.text in known or word.text[0] in '<"':
            return KNOWN_COST
        if word.text.casefold() in FILLERS or word.text in (";", ".", "->", "then", "next", "by"):
            return NOISE_COST
        if not word.text[0].isalnum():
            return 0.3 if not word.terminals else 1.0
        if word.text[0].isdigit():
            return 2.0
        return 1.6 if word.text in KEYWORDS else WORD_COST

    return drop


class _Things:
    """Possible names of things: all words that are neither of the language nor relations."""

    def __contains__(self, word: object) -> bool:
        return (
            isinstance(word, str)
            and word.isidentifier()
            and word not in NEVER_NAMES
            and word not in FILLERS
            and word not in known_actions()
        )


def plain_call(said: str) -> str:
    """A phrase in plain words as an action; unchanged if it is none."""
    words = said.split()
    while words and words[0].casefold() in FILLERS:
        words = words[1:]
    found = sentences(words, _Things(), _verb)
    return next((called(call) for n, call in found if n == len(words)), said)


def _verb(word: str, things: int) -> str | None:
    """The action with this number of actors meant by a word, or None."""
    known = _of_arity(things)
    return word if word in known else synonym(word, known)


@lru_cache(maxsize=2)
def _of_arity(things: int) -> tuple[str, ...]:
    return tuple(
        name
        for name, action in {**ACTIONS, **known_actions()}.items()
        if action.kinds == ("object",) * things and not action.measures
    )


def _head_of(said: Sequence[str]) -> tuple[int, str] | None:
    """Number of words that begin a rule in a nonstandard form, and the name of its stage."""
    line, ends = "", []
    for word in said:
        line += f" {word}"
        ends.append(len(line))
    m = _HEAD.match(line)
    if m is None or m[1] in KEYWORDS:
        return None
    return sum(end <= m.end() for end in ends), _stage_name(m[1])


def _stage_name(said: str) -> str:
    """A valid stage name made from words."""
    name = re.sub(r"\W+", "_", said.strip()).strip("_")
    return name if name[:1].isalpha() else f"stage_{name}"


_STAGE = re.compile(rf"<[ ]*{NAME}{PARAMETERS}[ ]*>")
_REFERENCE = re.compile(r"< (\w[\w \-.]*) >")
_HEAD = re.compile(
    r"(?: (?:task|stage|def|define|function|rule|step|phase|action|- ))?(?: \d+ [.)])?"
    r"(?: <)? <?[ ]*([^\W_][\w \-.]*?)(?:(?<!\w) \( \)| \( \))?[ ]*>?(?: >)?"
    r" (?:::=|: : =|: =|: :|:|=|- >|-> |→|=>|= >)(?= |\Z)"
)


class _Meanings:
    """Possible meanings of words by position.

    Args:
        stages: Stages defined in the file.
    """

    def __init__(self, stages: frozenset[str]) -> None:
        self.stages = stages
        self.names = _Things()

    def __call__(self, words: Sequence[Word], at: int) -> list[Replacement]:
        """See `Speller.meant`."""
        said = [w.text for w in words[at : at + LONGEST]]
        found = [
            Replacement(length, (terminal,), meant, cost)
            for length, meant, cost in self.of(said[:LONGEST_NAME], at == 0)
            for terminal in (("NAME",) if meant.endswith("_1") else _kinds(meant))
        ]
        for length, call in sentences(said, self.names, _verb):
            found.append(
                Replacement(length, terminals_of_call(len(call) - 1), called(call), LIKELY)
            )
        if said[0] in self.names and len(said) > 1 and said[1] in ("<", ">", "<=", ">="):
            read = ("SIGNAL", "LPAR", "NAME", "RPAR")
            found.append(Replacement(1, read, f"signal({said[0]})", GUESS))
        if said[0] == "<" and (ref := _REFERENCE.match(" ".join(said))):
            found.append(
                Replacement(ref[0].count(" ") + 1, ("STAGE",), f"<{_stage_name(ref[1])}>", LIKELY)
            )
        if at == 0 and _STAGE.fullmatch(said[0]):
            found.append(Replacement(1, ("HEAD",), f"{said[0]} ::=", LIKELY))
        if at == 0 and (head := _head_of(said)) is not None:
            found.append(Replacement(head[0], ("HEAD",), f"<{head[1]}> ::=", LIKELY))
        return found

    def of(self, said: Sequence[str], first: bool) -> Iterator[tuple[int, str, float]]:
        """(Number of words, meaning, cost) of the first words."""
        word, called = said[0], len(said) > 1 and said[1] == "("
        low = word.casefold()
        for length, meant in meanings_of(said):
            if not (called and length == 1):
                yield length, meant, LIKELY
                yield from ((length, s, GUESS) for s in _IN_COURSES.get(meant, ()))
        tables = (
            UNITS_MEANT,
            _BRACKETS,
            _RANKS,
            _LASTING,
            SIGNS_MEANT,
            _STATEMENT if first else {},
        )
        yield from ((1, table[low], LIKELY) for table in tables if low in table)
        yield from ((1, sign, GUESS) for sign in _IN_COURSES.get(low, ()))
        if low in ("=", ":", "as", "be", "has", "means"):
            yield 1, "is", LIKELY
        if word[0].isalpha():
            yield from self.of_name(said, called)

    def of_name(self, said: Sequence[str], called: bool) -> Iterator[tuple[int, str, float]]:
        """The meanings of a word of letters."""
        word = said[0]
        for length in range(2, len(said) + 1):
            joined = "_".join(said[:length]).replace("_-_", "_")
            if joined in known_actions():
                yield length, joined, LIKELY
        if word in self.stages and not called:
            yield 1, f"<{word}>", LIKELY
        if word in KEYWORDS:
            if called or (len(said) > 1 and said[1] in ",)"):
                yield 1, f"{word}_1", GUESS
        elif word.casefold() in KEYWORDS:
            yield 1, word.casefold(), SURE
        elif not called and len(word) > 2:
            near = close_matches(word.casefold(), KEYWORDS, n=3)
            yield from ((1, meant, GUESS) for meant in near)
        if called and word not in known_actions():
            named = synonym(word, ACTIONS) or closest(word, known_actions())
            if named is not None:
                yield 1, named, LIKELY


_IN_COURSES = {"and": ("&",), "or": ("|",), "/": ("|",), "||": ("|",), "&&": ("&",), "if": ("when",),
               "while": ("when", "&"), "until": ("ends",)}  # fmt: skip
"""Words of conditions and of other languages -> operators of courses."""


def _kinds(meant: str) -> tuple[str, ...]:
    if meant.startswith("<") and len(meant) > 2:
        return ("STAGE",)
    return _terminals_of(meant) or ("NAME",)


WIDENED, MOST_SAID = 6, 120
"""How often a change is widened by a word to be unambiguous, and its maximum length in characters."""
LONGEST_STATEMENT = 1500
"""Maximum characters of a statement that is searched completely for the cause of an error."""


def corrected(text: str, place: SourceLocation, may_go_on: Callable[[], bool]) -> Iterator[str]:
    """Hints that make the statement at a position parse, smallest changes first.

    Args:
        text: The whole file.
        place: Position of the fault.
        may_go_on: Asked before each candidate is explored.

    Yields:
        Hints, including those that only delete words.
    """
    cleaned = normalise(text, Source(text, place.file))[0]
    tidy = _tidied(text, cleaned, place)
    if tidy is not None:
        hint = said(text, place, tidy)
        yield from () if hint is None else (hint,)
        return
    chunk = _statement(cleaned, place)
    if chunk is None or len(chunk.raw) > LONGEST_STATEMENT:
        return
    begin = _offset(text, chunk.line, chunk.column)
    for repair in least_cost_repairs(chunk.raw, 0, speller(cleaned), may_go_on):
        hint = said(text, place, Repair(repair.begin + begin, repair.end + begin, repair.new))
        if hint is not None:
            yield hint


def _tidied(text: str, cleaned: str, place: SourceLocation) -> Repair | None:
    """The line of a fault with look-alike characters replaced."""
    begin = _offset(text, place.line, 1)
    code = place.text.split("#")[0].rstrip()
    odd = [n for n, char in enumerate(code) if char != cleaned[begin + n]]
    if not odd:
        return None
    start = code.rfind(" ", 0, odd[0]) + 1
    end = code.find(" ", odd[-1])
    end = len(code) if end < 0 else end
    meant = re.sub(r"\s+", " ", cleaned[begin + start : begin + end])
    meant = re.sub(r"(?<=[(<]) | (?=[,)>])", "", meant).strip()
    return Repair(begin + start, begin + end, meant)


def _statement(text: str, place: SourceLocation) -> StatementText | None:
    """The statement at a position."""
    before = [c for c in split(text) if (c.line, c.column) <= (place.line, place.column)]
    return before[-1] if before else None


def _offset(text: str, line: int, column: int) -> int:
    return sum(len(row) + 1 for row in text.split("\n")[: line - 1]) + column - 1


def said(text: str, place: SourceLocation, repair: Repair) -> str | None:
    """A change as a hint; with surrounding words if it would be ambiguous."""
    wanted = repair.applied(text).split()
    for _ in range(WIDENED):
        old, new = " ".join(text[repair.begin : repair.end].split()), repair.new.strip()
        hint = f"write `{new}` in place of `{old}`" if new else f"leave `{old}` out"
        fix = fix_of(text, place, hint) if old and "`" not in old + new else None
        if fix is not None and fix.applied(text).split() == wanted:
            return hint
        wider = _wider(text, repair)
        if wider is None or len(old) > MOST_SAID:
            return None
        repair = wider
    return None


def _wider(text: str, repair: Repair) -> Repair | None:
    """The same change with the preceding word, or at the beginning of a line with the following one."""
    line = text.rfind("\n", 0, repair.begin) + 1
    before = list(TOKEN.finditer(text, line, repair.begin))
    if before:
        start = before[-1].start()
        kept = text[start : repair.begin]
        kept = kept if repair.new.strip() and repair.new[0] in ",)]:" else f"{kept.rstrip()} "
        return Repair(start, repair.end, kept + repair.new.lstrip())
    behind = TOKEN.search(text, repair.end)
    if behind is None or "\n" in text[repair.end : behind.start()] or "#" in behind[0]:
        return None
    return Repair(repair.begin, behind.end(), f"{repair.new.rstrip()} {behind[0]}".lstrip())
