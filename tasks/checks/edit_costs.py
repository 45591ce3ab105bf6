"""Corrections that make a statement of a task file parse: the costs of edits, and the hints."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType

from visup.agent.model.did_you_mean import close_matches
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
from visup.rules.language.synonyms import meant_word, synonym
from visup.tasks.actions.actions import ACTIONS, known_actions
from visup.tasks.diagnostics.course_error_patterns import CONDITION_SYNONYMS
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
_INSERTION_COSTS = {
    ")": 1.0, "(": 1.0, ",": 1.0, ":": 1.0, "&": 1.6, "=": 1.2, "when": 0.8, "order": 0.5, "of": 0.6,
    "each": 0.8, "to": 0.9, "least": 0.8, "most": 0.8, "times": 0.5, "than": 0.5, "first": 0.5, "from": 0.5,
    "ignored": 0.5, "is": 0.9, "and": 1.3, "for": 1.3, "within": 1.4, "at": 1.0, "the": 0.4, "largest": 1.6,
    "red": 1.6, "what": 1.0, "<": 1.5, "5": 2.0, "2": 1.6, "any": 1.0, "new": 1.0, "left": 1.5,
    "actor": 1.3, "during": 1.5, '"dock"': 2.0, "larger": 1.4, "enters": 1.4, "moves": 1.4, "part": 1.2,
    "zone": 1.3, "parameter": 1.3, "never": 1.5,
}  # fmt: skip
"""Cost of inserting a word."""
_BRACKETS = {"[": "(", "]": ")", "{": "(", "}": ")"}
_STATEMENT_WORDS = {
    "actor": "object|entity|robot|agent|player|model|item|thing|body|actors",
    "parameter": "param|params|const|constant|let|set|define|def|var|variable|parameters|value",
    "zone": "area|region|place|rect|rectangle|polygon|zones",
    "ground": "floor|plane",
    "include": "import|use|load|using|includes",
    "never": "forbid|forbidden|avoid|prohibit|prevent|not|nie|jamais|nunca|no|exclude|disallow",
    "always": "ensure|require|requires|must|invariant|assert|keep|maintain|immer|toujours|siempre",
    "bystander": "ignore|bystanders|ignored|ignoring",
}
_STATEMENT_SYNONYMS = {
    word: meant for meant, words in _STATEMENT_WORDS.items() for word in words.split("|")
}
_RANK_SYNONYMS = {"biggest": "largest", "tallest": "largest", "longest": "largest", "tiniest": "smallest",
          "topmost": "highest", "uppermost": "highest", "top": "highest", "bottom": "lowest",
          "nearest": "lowest", "bottommost": "lowest"}  # fmt: skip
_CRITERION_SYNONYMS = {"bigger": "larger", "longer": "larger", "taller": "larger", "shorter": "smaller",
            "moved": "moves", "starts": "moves", "comes": "enters", "came": "enters",
            "arrives": "enters", "appears": "enters", "entered": "enters", "stays": "rests",
            "stands": "rests", "lies": "rests", "who": "what", "which": "what"}  # fmt: skip
_CALLS = re.compile(rf"({NAME})\s*\(([^()<>]*)\)")


def task_edit_costs(text: str) -> EditCosts:
    """The edit costs for a task file.

    Args:
        text: The whole file, for its names.
    """
    calls = [(m[1], re.findall(NAME, m[2])) for m in _CALLS.finditer(text)]
    actors = tuple(dict.fromkeys(a for _, names in calls for a in names if a not in NEVER_NAMES))
    stages = frozenset(re.findall(rf"<\s*({NAME})\s*>\s*:", text))
    insertions = {**_insertions(), "NAME": (2.2, (*actors[:3], "other"))}
    meanings = _Replacements(stages)
    return EditCosts(
        _automaton(),
        _terminals(),
        insertions,
        _deletion_cost({*actors, *stages}),
        meanings,
        ("MODEL",),
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
def _insertions() -> Mapping[str, tuple[float, tuple[str, ...]]]:
    found: dict[str, tuple[float, tuple[str, ...]]] = {}
    for word, cost in _INSERTION_COSTS.items():
        for terminal in _terminals_of(word):
            found.setdefault(terminal, (cost, (word,)))
    found["HEAD"] = (3.0, ("<task> ::=",))
    found["UNIT"] = (0.8, ("s", "px", "px/s", "m", "%"))
    found["MODEL"] = (2.2, ("other",))
    return MappingProxyType(found)


def _deletion_cost(names: set[str]) -> Callable[[Word], float]:
    known = names | set(known_actions())

    def cost(word: Word) -> float:
        if word.text in known or word.text[0] in '<"':
            return KNOWN_COST
        if word.text.casefold() in FILLERS or word.text in (";", ".", "->", "then", "next", "by"):
            return NOISE_COST
        if not word.text[0].isalnum():
            return 0.3 if not word.terminals else 1.0
        if word.text[0].isdigit():
            return 2.0
        return 1.6 if word.text in KEYWORDS else WORD_COST

    return cost


class _ObjectNames:
    """Possible names of objects: all words that are neither keywords nor relations."""

    def __contains__(self, word: object) -> bool:
        return (
            isinstance(word, str)
            and word.isidentifier()
            and word not in NEVER_NAMES
            and word not in FILLERS
            and word not in known_actions()
        )


def plain_call(phrase: str) -> str:
    """A phrase in plain words as an action; unchanged if it is none."""
    words = phrase.split()
    while words and words[0].casefold() in FILLERS:
        words = words[1:]
    found = sentences(words, _ObjectNames(), _action_with_actors)
    return next((called(call) for n, call in found if n == len(words)), phrase)


def _action_with_actors(word: str, things: int) -> str | None:
    """The action with this number of actors meant by a word, or None."""
    known = _actions_of_arity(things)
    return word if word in known else synonym(word, known)


@lru_cache(maxsize=2)
def _actions_of_arity(things: int) -> tuple[str, ...]:
    return tuple(
        name
        for name, action in {**ACTIONS, **known_actions()}.items()
        if action.kinds == ("object",) * things and not action.measures
    )


def _foreign_head(words: Sequence[str]) -> tuple[int, str] | None:
    """Number of words that begin a rule in a nonstandard form, and the name of its stage."""
    line, ends = "", []
    for text in words:
        line += f" {text}"
        ends.append(len(line))
    match = _HEAD.match(line)
    if match is None or match[1] in KEYWORDS:
        return None
    return sum(end <= match.end() for end in ends), _stage_name(match[1])


def _stage_name(phrase: str) -> str:
    """A valid stage name made from words."""
    name = re.sub(r"\W+", "_", phrase.strip()).strip("_")
    return name if name[:1].isalpha() else f"stage_{name}"


_STAGE = re.compile(rf"<[ ]*{NAME}{PARAMETERS}[ ]*>")
_REFERENCE = re.compile(r"< (\w[\w \-.]*) >")
_HEAD = re.compile(
    r"(?: (?:task|stage|def|define|function|rule|step|phase|action|- ))?(?: \d+ [.)])?"
    r"(?: <)? <?[ ]*([^\W_][\w \-.]*?)(?:(?<!\w) \( \)| \( \))?[ ]*>?(?: >)?"
    r" (?:::=|: : =|: =|: :|:|=|- >|-> |→|=>|= >)(?= |\Z)"
)


class _Replacements:
    """Possible meanings of words by position.

    Args:
        stages: Stages defined in the file.
    """

    def __init__(self, stages: frozenset[str]) -> None:
        self.stages = stages
        self.names = _ObjectNames()

    def __call__(self, words: Sequence[Word], at: int) -> list[Replacement]:
        """See `EditCosts.replacements`."""
        texts = [w.text for w in words[at : at + LONGEST]]
        found = [
            Replacement(length, (terminal,), replacement, cost)
            for length, replacement, cost in self.meanings(texts[:LONGEST_NAME], at == 0)
            for terminal in (
                ("NAME",) if replacement.endswith("_1") else _terminals_for(replacement)
            )
        ]
        for length, call in sentences(texts, self.names, _action_with_actors):
            found.append(
                Replacement(length, terminals_of_call(len(call) - 1), called(call), LIKELY)
            )
        if texts[0] in self.names and len(texts) > 1 and texts[1] in ("<", ">", "<=", ">="):
            read = ("SIGNAL", "LPAR", "NAME", "RPAR")
            found.append(Replacement(1, read, f"signal({texts[0]})", GUESS))
        if texts[0] == "<" and (ref := _REFERENCE.match(" ".join(texts))):
            found.append(
                Replacement(ref[0].count(" ") + 1, ("STAGE",), f"<{_stage_name(ref[1])}>", LIKELY)
            )
        if at == 0 and _STAGE.fullmatch(texts[0]):
            found.append(Replacement(1, ("HEAD",), f"{texts[0]} ::=", LIKELY))
        if at == 0 and (head := _foreign_head(texts)) is not None:
            found.append(Replacement(head[0], ("HEAD",), f"<{head[1]}> ::=", LIKELY))
        return found

    def meanings(self, words: Sequence[str], first: bool) -> Iterator[tuple[int, str, float]]:
        """(Number of words, meaning, cost) of the first words."""
        word, is_call = words[0], len(words) > 1 and words[1] == "("
        folded = word.casefold()
        for length, replacement in meanings_of(words):
            if not (is_call and length == 1):
                yield length, replacement, LIKELY
                yield from ((length, s, GUESS) for s in _COURSE_OPERATORS.get(replacement, ()))
        tables = (
            UNITS_MEANT,
            _BRACKETS,
            _RANK_SYNONYMS,
            _CRITERION_SYNONYMS,
            CONDITION_SYNONYMS,
            _STATEMENT_SYNONYMS if first else {},
        )
        yield from ((1, table[folded], LIKELY) for table in tables if folded in table)
        yield from ((1, sign, GUESS) for sign in _COURSE_OPERATORS.get(folded, ()))
        if folded in ("=", ":", "as", "be", "has", "means"):
            yield 1, "is", LIKELY
        if word[0].isalpha():
            yield from self.name_meanings(words, is_call)

    def name_meanings(
        self, words: Sequence[str], is_call: bool
    ) -> Iterator[tuple[int, str, float]]:
        """The meanings of a word of letters."""
        word = words[0]
        for length in range(2, len(words) + 1):
            joined = "_".join(words[:length]).replace("_-_", "_")
            if joined in known_actions():
                yield length, joined, LIKELY
        if word in self.stages and not is_call:
            yield 1, f"<{word}>", LIKELY
        if word in KEYWORDS:
            if is_call or (len(words) > 1 and words[1] in ",)"):
                yield 1, f"{word}_1", GUESS
        elif word.casefold() in KEYWORDS:
            yield 1, word.casefold(), SURE
        elif not is_call and len(word) > 2:
            similar = close_matches(word.casefold(), KEYWORDS, n=3)
            yield from ((1, replacement, GUESS) for replacement in similar)
        if is_call and word not in known_actions():
            named = meant_word(word, known_actions())
            if named is not None:
                yield 1, named, LIKELY


_COURSE_OPERATORS = {"and": ("&",), "or": ("|",), "/": ("|",), "||": ("|",), "&&": ("&",), "if": ("when",),
               "while": ("when", "&"), "until": ("ends",)}  # fmt: skip
"""Words of conditions and of other languages -> operators of courses."""


def _terminals_for(replacement: str) -> tuple[str, ...]:
    if replacement.startswith("<") and len(replacement) > 2:
        return ("STAGE",)
    return _terminals_of(replacement) or ("NAME",)


MAX_WIDENINGS, LONGEST_QUOTE = 6, 120
"""How often a change is widened by a word to be unambiguous, and its maximum length in characters."""
LONGEST_STATEMENT = 1500
"""Maximum characters of a statement that is searched completely for the cause of an error."""


def correction_hints(
    text: str, place: SourceLocation, may_go_on: Callable[[], bool]
) -> Iterator[str]:
    """Hints that make the statement at a position parse, smallest changes first.

    Args:
        text: The whole file.
        place: Position of the fault.
        may_go_on: Asked before each candidate is explored.

    Yields:
        Hints, including those that only delete words.
    """
    cleaned = normalise(text, Source(text, place.file))[0]
    repair = _without_lookalikes(text, cleaned, place)
    if repair is not None:
        hint = hint_for(text, place, repair)
        yield from () if hint is None else (hint,)
        return
    statement = _statement(cleaned, place)
    if statement is None or len(statement.raw) > LONGEST_STATEMENT:
        return
    begin = _offset(text, statement.line, statement.column)
    for repair in least_cost_repairs(statement.raw, 0, task_edit_costs(cleaned), may_go_on):
        hint = hint_for(text, place, Repair(repair.begin + begin, repair.end + begin, repair.new))
        if hint is not None:
            yield hint


def _without_lookalikes(text: str, cleaned: str, place: SourceLocation) -> Repair | None:
    """The line of a fault with look-alike characters replaced."""
    begin = _offset(text, place.line, 1)
    code = place.text.split("#")[0].rstrip()
    replaced = [n for n, char in enumerate(code) if char != cleaned[begin + n]]
    if not replaced:
        return None
    start = code.rfind(" ", 0, replaced[0]) + 1
    end = code.find(" ", replaced[-1])
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


def hint_for(text: str, place: SourceLocation, repair: Repair) -> str | None:
    """A change as a hint; with surrounding words if it would be ambiguous."""
    wanted = repair.applied(text).split()
    for _ in range(MAX_WIDENINGS):
        old, new = " ".join(text[repair.begin : repair.end].split()), repair.new.strip()
        hint = f"write `{new}` in place of `{old}`" if new else f"leave `{old}` out"
        fix = fix_of(text, place, hint) if old and "`" not in old + new else None
        if fix is not None and fix.applied(text).split() == wanted:
            return hint
        wider = _widened(text, repair)
        if wider is None or len(old) > LONGEST_QUOTE:
            return None
        repair = wider
    return None


def _widened(text: str, repair: Repair) -> Repair | None:
    """The same change with the preceding word, or at the beginning of a line with the following one."""
    line = text.rfind("\n", 0, repair.begin) + 1
    before = list(TOKEN.finditer(text, line, repair.begin))
    if before:
        start = before[-1].start()
        word = text[start : repair.begin]
        word = word if repair.new.strip() and repair.new[0] in ",)]:" else f"{word.rstrip()} "
        return Repair(start, repair.end, word + repair.new.lstrip())
    behind = TOKEN.search(text, repair.end)
    if behind is None or "\n" in text[repair.end : behind.start()] or "#" in behind[0]:
        return None
    return Repair(repair.begin, behind.end(), f"{repair.new.rstrip()} {behind[0]}".lstrip())
