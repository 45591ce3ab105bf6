"""Mistakes of syntax: cleaning, splitting at rules, and naming what went wrong in each."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from visup.agent.errors import Place
from visup.tasks.chunk import Chunk
from visup.tasks.faults import Source, TaskFault, did_you_mean
from visup.tasks.mistakes import name_mistake
from visup.tasks.read import read
from visup.tasks.tree import Actor, Invariant, Stage, Task

NAME = r"[^\W\d]\w*"
HEAD = re.compile(rf"<[ ]*{NAME}[ ]*>\s*::=")
OPENS = re.compile(  # a line that begins a statement, well written or not
    rf"[ ]*(?:<[^<>|()]*>?\s*(?:::=|:=|=|::|:|->|→|=>)|{NAME}[ ]*>?\s*(?:::=|:=|=)"
    r"|(?:actor|never|always|include|import|task|zone|param|parameter|stage)\b(?![ ]*\())"
)
UNFINISHED = re.compile(r"(?:::=|[|&(,]|\b(?:for|within|is|or|during))\s*$")
DEEPEST = 60

LIKE = {
    "：": ":", "＝": "=", "＜": "<", "＞": ">", "（": "(", "）": ")", "，": ",", "｜": "|",
    "＊": "*", "＋": "+", "？": "?", "＆": "&", "‹": "<", "›": ">", "⟨": "<", "⟩": ">",
    "〈": "<", "〉": ">", "¦": "|", "∣": "|", "\u00a0": " ", "\u2009": " ", "\u202f": " ",
    "\u200b": " ", "\ufeff": " ", "\u3000": " ", "–": "-", "—": "-", "−": "-",
}  # fmt: skip
QUOTES = "\"'`“”‘’„‚«»′″"


def clean(text: str, source: Source) -> tuple[str, list[TaskFault]]:
    """The text without what only looks wrong, so that it hides nothing else.

    Args:
        text: As the user wrote it.
        source: For places.

    Returns:
        Text of the same length, in which tabs, quotes and typographic characters are what was
        meant and comments are blank; and one fault for each run of them.
    """
    faults: list[TaskFault] = []
    lines = text.split("\n")
    for number, line in enumerate(lines, 1):
        code = re.sub(r"#.*", lambda m: " " * len(m[0]), line)
        if not code.isascii() or any(c in QUOTES or (c < " " and c != "\r") for c in code):
            code = _clean_line(code, number, source, faults)
        lines[number - 1] = code
    return "\n".join(lines), _one_for_tabs(faults)


def _clean_line(line: str, number: int, source: Source, faults: list[TaskFault]) -> str:
    """The line as it was meant; of each kind of odd character the line is told once."""
    told = set()
    for i, char in enumerate(line):
        kind = _odd(char)
        quoted = kind == "E105" and char in QUOTES
        if kind and (kind, quoted) not in told:
            told.add((kind, quoted))
            length = _quoted(line, i) if quoted else 1
            faults.append(_odd_fault(kind, char, source.place(number, i + 1, length)))
    return "".join(_meant(c) if _odd(c) else c for c in line)


def _quoted(line: str, start: int) -> int:
    """How many characters stand from one quote to the next, both with them."""
    ends = (i for i in range(start + 1, len(line)) if line[i] in QUOTES)
    return next(ends, start) - start + 1


def _odd(char: str) -> str:
    if char == "\t":
        return "E106"
    if char in QUOTES or char in LIKE:
        return "E105"
    if (char < " " and char != "\r") or char in "\x7f\ufffd":
        return "E104"
    return ""


def _meant(char: str) -> str:
    return LIKE.get(char, " ")


def _odd_fault(code: str, char: str, place: Place) -> TaskFault:
    if code == "E106":
        return TaskFault(code, "a tab", place, expected="spaces", hint="use spaces")
    if code == "E104":
        return TaskFault(code, f"a character that is not text (U+{ord(char):04X})", place)
    if char in QUOTES:
        what = "typographic quotes" if ord(char) > 127 else "quotes"
        hint = "names are written without quotes"
        return TaskFault(code, f"{what} `{char}`", place, expected="a name", hint=hint)
    plain = LIKE[char]
    shown = "an ordinary space" if plain == " " else f"`{plain}`"
    what = f"`{char}` (U+{ord(char):04X}) only looks like {shown}"
    return TaskFault(code, what, place, expected=shown, hint="type it on the keyboard")


def _one_for_tabs(faults: list[TaskFault]) -> list[TaskFault]:
    """All tabs of a file are one habit, told once."""
    tabs = [f for f in faults if f.code == "E106"]
    if len(tabs) < 2:
        return faults
    lines = len({f.place.line for f in tabs})
    what = f"tabs, here and in {lines} lines" if lines > 1 else "tabs"
    first = TaskFault("E106", what, tabs[0].place, expected="spaces", hint="use spaces")
    return [first if f is tabs[0] else f for f in faults if f is tabs[0] or f.code != "E106"]


@dataclass(frozen=True, slots=True)
class Parsed:
    """What could be read of a text.

    Attributes:
        task: All statements that are well written.
        faults: What is wrong with the others.
        defined: Stages that the others seem to define.
        used: Stages that the others mention.
    """

    task: Task
    faults: tuple[TaskFault, ...] = ()
    defined: frozenset[str] = frozenset()
    used: frozenset[str] = frozenset()


def parse(text: str, source: Source) -> Parsed:
    """Read a cleaned text; where it is not in the grammar, statement by statement.

    Args:
        text: See `clean`.
        source: For places.

    Returns:
        The tree of all well written statements, one fault for each other one.
    """
    deep = _too_deep(text, source)
    if deep:
        return Parsed(Task(()), (deep,))
    try:
        return Parsed(read(text, source.file))
    except UnexpectedInput:
        return _parse_in_parts(text, source)


def _parse_in_parts(text: str, source: Source) -> Parsed:
    stages: list[Stage] = []
    actors: list[Actor] = []
    invariants: list[Invariant] = []
    faults: list[TaskFault] = []
    defined: set[str] = set()
    used: set[str] = set()
    for chunk in split(text):
        try:
            part = read("\n" * (chunk.line - 1) + " " * (chunk.column - 1) + chunk.text)
        except UnexpectedInput as e:
            faults.append(name_mistake(chunk, source) or _unexpected(e, chunk, source))
            first = re.match(rf"\s*<?\s*({NAME})", chunk.text)
            defined |= {first[1]} if first else set()
            used |= set(re.findall(NAME, chunk.text))
        else:
            stages += part.stages
            actors += part.actors
            invariants += part.invariants
    task = Task(tuple(stages), tuple(actors), tuple(invariants), source.file)
    if not faults:  # each part reads well, but not all of them together
        faults = [_whole(text, source)]
    return Parsed(task, tuple(faults), frozenset(defined), frozenset(used))


def split(text: str) -> Iterator[Chunk]:
    """A cleaned text, cut where statements begin, as far as that can be told.

    Statements begin at `<name> ::=` anywhere, at lines that look like the beginning of one,
    and at unindented lines that begin with a name that is not defined elsewhere.
    """
    heads = {m[0].split(">")[0].strip("< ") for m in HEAD.finditer(text)}
    starts = {m.start() for m in HEAD.finditer(text)}
    offset, before = 0, ""
    for line in text.split("\n"):
        if _begins(line, before, heads):
            starts.add(offset + len(line) - len(line.lstrip(" ")))
        before = line if line.strip() else before
        offset += len(line) + 1
    cuts = sorted({0, *starts, len(text)})
    for a, b in pairwise(cuts):
        if text[a:b].strip():
            row = text.count("\n", 0, a) + 1
            column = a - (text.rfind("\n", 0, a) + 1) + 1
            yield Chunk(text[a:b].rstrip(), row, column)


def _begins(line: str, before: str, heads: set[str]) -> bool:
    if UNFINISHED.search(before.rstrip()):
        return bool(HEAD.match(line.lstrip(" ")))
    if OPENS.match(line):
        return True
    first = re.match(rf"(?:<[ ]*({NAME})|{NAME})", line)
    return bool(first) and first[1] not in heads if first else False


def _too_deep(text: str, source: Source) -> TaskFault | None:
    depth = 0
    for match in re.finditer(r"[()]", text):
        depth = depth + 1 if match[0] == "(" else max(0, depth - 1)
        if depth > DEEPEST:
            line = text.count("\n", 0, match.start()) + 1
            column = match.start() - text.rfind("\n", 0, match.start())
            what = f"brackets are nested more than {DEEPEST} deep"
            return TaskFault("E128", what, source.place(line, column), hint="name a stage instead")
    return None


def _whole(text: str, source: Source) -> TaskFault:
    try:
        read(text)
    except UnexpectedInput as e:
        return _unexpected(e, Chunk(text, 1, 1), source)
    return TaskFault("E101", "text that is not part of the language", source.place(1, 1))


SAID = {
    "HEAD": "a rule such as `<approach> ::= ...`",
    "STAGE": "a stage such as `<approach>`",
    "NAME": "a name",
    "MODEL": "the name of a model",
    "NUMBER": "a number",
    "REPEAT": "`?`, `*` or `+`",
    "WHEN": "`never` or `always`",
    "LPAR": "`(`",
    "RPAR": "`)`",
    "COMMA": "`,`",
    "VBAR": "`|`",
    "AMPERSAND": "`&`",
    "ACTOR": "`actor`",
    "$END": "the end of the file",
}
KEYWORDS = ("actor", "is", "or", "never", "always", "during", "for", "within")


def _unexpected(error: UnexpectedInput, chunk: Chunk, source: Source) -> TaskFault:
    """The fault when no particular mistake was recognised: what stands there, what could."""
    if isinstance(error, UnexpectedToken):
        token, allowed = error.token, error.accepts or error.expected
        found = str(token).strip()
    else:
        allowed = error.allowed if isinstance(error, UnexpectedCharacters) else set()
        found = _word_at(chunk, error.line, error.column)
    ended = isinstance(error, UnexpectedToken) and error.token.type == "$END"
    line, column = (*chunk.end,) if ended or error.line < 1 else (error.line, error.column)
    what = "the statement ends too early" if ended else f"unexpected `{found}`"
    return TaskFault(
        "E101",
        what,
        source.place(line, column, max(1, len(found))),
        expected=_said(allowed or set()),
        hint=did_you_mean(found, KEYWORDS) if found.isidentifier() else None,
    )


def _said(terminals: set[str]) -> str | None:
    words = {SAID.get(t, f"`{t.lower()}`") for t in terminals}
    if not words:
        return None
    ordered = sorted(words)
    return ordered[0] if len(ordered) == 1 else f"{', '.join(ordered[:-1])} or {ordered[-1]}"


def _word_at(chunk: Chunk, line: int, column: int) -> str:
    rows = chunk.text.split("\n")
    row = rows[min(max(0, line - chunk.line), len(rows) - 1)]
    start = column - 1 - (chunk.column - 1 if line == chunk.line else 0)
    match = re.match(r"\w+|\S", row[max(0, start) :])
    return match[0] if match else row[start : start + 1]
