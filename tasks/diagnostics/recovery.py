"""Error recovery: splits a text at statements and finds the syntax error of each."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from visup.agent.model.did_you_mean import did_you_mean
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.diagnostics.course_error_patterns import STAGE_CONDITIONS
from visup.tasks.diagnostics.error_patterns import recognise_error
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.parser import collect, read, read_statements
from visup.tasks.grammar.statement import RESERVED_WORDS, StatementText, blank_strings

NAME = r"[^\W\d]\w*"
ACTORS = r"(?:\([\w ,]*\)[ ]*)?"
HEAD = re.compile(rf"<[ ]*{NAME}[ ]*{ACTORS}>\s*::=")
OPENS = re.compile(  # a line that begins a statement, valid or not
    rf"[ ]*(?:<[^<>|()]*>?\s*(?:::=|:=|=|::|:|->|→|=>)|{NAME}[ ]*>?\s*(?:::=|:=|=)"
    rf"|[\[({{][ ]*{NAME}[ ]*{ACTORS}[\])}}]\s*(?:::=|:=)"
    r"|(?:actor|optional|never|always|include|import|task|zone|param|parameter|stage"
    r"|bystanders?|ground(?=[ ]+is\b))\b(?![ ]*\())"
)
MARKED_HEAD = re.compile(rf"(?:(?<!\S)task[ ]+)?<[ ]*{NAME}[ ]*{ACTORS}>\s*::=")
DECLARES = re.compile(rf"\s*(?:task\s+|(?:zone|parameter|(?:optional\s+)?actor)\s+)?<?\s*({NAME})")
SPACED_HEAD = re.compile(r"\s*(?:task\s+)?<\s*([\w .\-]*\w)\s*>\s*::=")
UNFINISHED = re.compile(
    r"(?:::=|[|&(,]|\b(?:for|within|after|every|is|or|and|not|during|when|size|task|optional|between|than|from|the|of|another|at))\s*$"
)
DEEPEST = 60
LONGEST = 4000  # characters of a statement that are searched for mistakes


@dataclass(frozen=True, slots=True)
class ParsedFile:
    """The parsed part of a text.

    Attributes:
        task: All valid statements.
        faults: The faults of the others.
        defined: Stages that the others seem to define.
        used: Stages that the others refer to.
    """

    task: Task
    faults: tuple[Diagnostic, ...] = ()
    defined: frozenset[str] = frozenset()
    used: frozenset[str] = frozenset()

    @property
    def lacking(self) -> bool:
        """Whether an included file could not be read, so that names may be missing."""
        return any(f.code in ("E130", "E221", "E222") for f in self.faults)


def parse(text: str, source: Source) -> ParsedFile:
    """Parse a normalised text; if that fails, statement by statement.

    Args:
        text: See `normalise`.
        source: For positions.

    Returns:
        The tree of all valid statements, and one fault for each other one.
    """
    deep = _too_deep(blank_strings(text), source)
    if deep:
        return ParsedFile(Task(()), (deep,))
    try:
        return ParsedFile(read(text, source.file))
    except UnexpectedInput:
        return _parse_in_parts(text, source)


def _parse_in_parts(text: str, source: Source) -> ParsedFile:
    statements: list[object] = []
    faults: list[Diagnostic] = []
    defined: set[str] = set()
    used: set[str] = set()
    for chunk in split(text):
        try:
            statements += _read_again(_in_place(chunk))
        except UnexpectedInput as e:
            faults.append(recognise_error(_near(chunk, e), source) or _unexpected(e, chunk, source))
            first = DECLARES.match(chunk.text)
            defined |= {first[1]} if first else set()
            spaced = SPACED_HEAD.match(chunk.text)
            defined |= {re.sub(r"\W+", "_", spaced[1])} if spaced else set()
            used |= set(re.findall(NAME, chunk.text))
    if not faults:  # each part is valid, but not the whole
        faults = [_whole(text, source)]
    task = collect(statements, source.file)
    return ParsedFile(task, tuple(faults), frozenset(defined), frozenset(used))


@lru_cache(maxsize=256)
def _read_again(text: str) -> tuple[object, ...]:
    """The statements of a text; the tries to mend one statement leave the others as they are."""
    return tuple(read_statements(text))


def _in_place(chunk: StatementText) -> str:
    """The statement padded with blanks, so that its positions are those in the file."""
    return "\n" * (chunk.line - 1) + " " * (chunk.column - 1) + chunk.raw


def _near(chunk: StatementText, error: UnexpectedInput) -> StatementText:
    """A statement, cut around the error if it is very long."""
    if len(chunk.text) <= LONGEST:
        return chunk
    starts = [0, *(m.end() for m in re.finditer("\n", chunk.text))]
    row = min(max(0, error.line - chunk.line), len(starts) - 1)
    column = error.column - (chunk.column if row == 0 else 1)
    at = min(len(chunk.text), max(0, starts[row] + column))
    start, end = max(0, at - LONGEST // 2), at + LONGEST // 4
    line, column = chunk.position(start)
    return StatementText(chunk.text[start:end], line, column)


def split(text: str) -> Iterator[StatementText]:
    """Split a normalised text at the probable beginnings of statements.

    Statements begin at `<name> ::=` anywhere, at lines that look like the beginning of one, and at unindented
    lines that begin with a name that is not defined elsewhere.
    """
    code = blank_strings(text)
    heads = {m[0].split(">")[0].strip("< ") for m in HEAD.finditer(code)}
    starts = {m.start() for m in MARKED_HEAD.finditer(code)}
    lines = [0]
    before = ""
    for line in code.split("\n"):
        if _begins(line, before, heads):
            starts.add(lines[-1] + len(line) - len(line.lstrip(" ")))
        before = line if line.strip() else before
        lines.append(lines[-1] + len(line) + 1)
    cuts = sorted({0, *starts, len(text)})
    for a, b in pairwise(cuts):
        if code[a:b].strip() or text[a:b].strip():
            row = bisect_right(lines, a)
            raw = text[a:b].rstrip()
            yield StatementText(code[a : a + len(raw)], row, a - lines[row - 1] + 1, raw)


def _begins(line: str, before: str, heads: set[str]) -> bool:
    if UNFINISHED.search(before.rstrip()):
        return bool(HEAD.match(line.lstrip(" ")))
    if OPENS.match(line):
        return True
    first = re.match(rf"(?:<[ ]*({NAME})|{NAME})", line)
    return bool(first) and first[1] not in heads if first else False


def _too_deep(text: str, source: Source) -> Diagnostic | None:
    depth = 0
    for match in re.finditer(r"[()]", text):
        depth = depth + 1 if match[0] == "(" else max(0, depth - 1)
        if depth > DEEPEST:
            line = text.count("\n", 0, match.start()) + 1
            column = match.start() - text.rfind("\n", 0, match.start())
            what = f"brackets are nested more than {DEEPEST} deep"
            return Diagnostic("E128", what, source.place(line, column), hint="name a stage instead")
    return None


def _whole(text: str, source: Source) -> Diagnostic:
    try:
        read(text)
    except UnexpectedInput as e:
        return _unexpected(e, StatementText(text, 1, 1, text), source)
    return Diagnostic("E101", "text that is not part of the language", source.place(1, 1))


SAID = {
    "HEAD": "a rule such as `<approach> ::= ...`",
    "STAGE": "a stage such as `<approach>`",
    "NAME": "a name",
    "MODEL": "the name of a model",
    "COLOUR": "a colour",
    "SHADE": "`light` or `dark`",
    "RANK": "`largest`, `smallest`, `leftmost`, `rightmost`, `highest` or `lowest`",
    "THE": "`the largest` and the like",
    "THE_OTHER": "`the other`",
    "THE_SIDE": "`the`",
    "SIDE": "`left`, `right`, `top` or `bottom`",
    "ANOTHER": "`another`",
    "COMPARED": "`larger than` or `smaller than`",
    "WHAT": "`what enters`, `what moves first` or `what rests`",
    "PART": "`part of`",
    "PLACE": "`at (410, 160)`",
    "NUMBER": "a number",
    "REPEAT": "`?`, `*` or `+`",
    "WHEN": "`never` or `always`",
    "LPAR": "`(`",
    "RPAR": "`)`",
    "COMMA": "`,`",
    "VBAR": "`|`",
    "AMPERSAND": "`&`",
    "ACTOR": "`actor`",
    "UNIT": "a unit",
    "COUNT": "a whole number",
    "SEVERAL": "a whole number of at least 2",
    "TEXT": "a text in double quotes",
    "SIGN": STAGE_CONDITIONS,
    "COMPARE": "`<` or `>`",
    "BYSTANDER": "`bystander`",
    "BYSTANDERS": "`bystanders ignored`",
    "GROUND": "`ground`",
    "BETWEEN": "`between`",
    "EVERY": "`every`",
    "_TIMES": "`times`",
    "AT": "`at least` or `at most`",
    "ANY": "`any order`",
    "ANY_OF": "`any 2 of`",
    "FOR_EACH": "`for each`",
    "NEW": "`new`",
    "ALREADY": "`already`",
    "ON_FAILURE": "`on failure of`",
    "OPTIONAL": "`optional actor`",
    "TASK": "`task`",
    "$END": "the end of the file",
}
KEYWORDS = (
    *RESERVED_WORDS, "task", "optional", "size", "any", "order", "at", "least", "most", "times", "begins",
    "ends", "progresses", "fails", "pauses",
    "every", "when", "and", "not", "another", "larger", "smaller", "than", "what",
    "bystander", "bystanders", "ignored", "ground", "between", "enters", "moves",
    "already", "each", "new", "on", "failure", "first", "rests", "from", "part", "of", "the", "other",
)  # fmt: skip
NAMES_TOO = ("part", "order", "size", "ground")
"""Words of the language that are as often the names of things."""
NEVER_NAMES = tuple(word for word in KEYWORDS if word not in NAMES_TOO)


def _unexpected(error: UnexpectedInput, chunk: StatementText, source: Source) -> Diagnostic:
    """The general fault if no mistake was recognised: found and expected tokens."""
    if isinstance(error, UnexpectedToken):
        token, allowed = error.token, error.accepts or error.expected
        found = str(token).strip()
    else:
        allowed = error.allowed if isinstance(error, UnexpectedCharacters) else set()
        found = _word_at(chunk, error.line, error.column)
    ended = isinstance(error, UnexpectedToken) and error.token.type == "$END"
    line, column = (*chunk.end,) if ended or error.line < 1 else (error.line, error.column)
    what = "the statement ends too early" if ended else f"unexpected `{found}`"
    return Diagnostic(
        "E101",
        what,
        source.place(line, column, max(1, len(found))),
        expected=_said(allowed or set()),
        hint=did_you_mean(found, KEYWORDS, "`{}`") if _is_misspelt(found) else None,
    )


def _is_misspelt(found: str) -> bool:
    """Whether a word may be a misspelt word of the language."""
    return found.isidentifier() and found not in KEYWORDS


def _said(terminals: set[str]) -> str | None:
    words = {SAID.get(t, f"`{t.lower()}`") for t in terminals}
    if not words:
        return None
    ordered = sorted(words)
    return ordered[0] if len(ordered) == 1 else f"{', '.join(ordered[:-1])} or {ordered[-1]}"


def _word_at(chunk: StatementText, line: int, column: int) -> str:
    rows = chunk.raw.split("\n")
    row = rows[min(max(0, line - chunk.line), len(rows) - 1)]
    start = column - 1 - (chunk.column - 1 if line == chunk.line else 0)
    match = re.match(r"\w+|\S", row[max(0, start) :])
    return match[0] if match else row[start : start + 1]
