"""The formatter of task files: `visup task format`.

It keeps all tokens and comments and changes only spaces and line breaks, so that the meaning is preserved by
construction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

from lark import Token

from visup.rules.language.diagnostics import Source
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.grammar.parser import tokens

WIDTH = 100
LONGEST_HEAD = 24  # `::=` are aligned if no head is longer than this
STARTERS = frozenset(
    {
        "TASK",
        "WHEN",
        "ACTOR",
        "OPTIONAL",
        "ZONE",
        "PARAMETER",
        "INCLUDE",
        "GROUND",
        "BYSTANDER",
        "BYSTANDERS",
        "ON_FAILURE",
    }
)
TIGHT_BEFORE = frozenset({"RPAR", "COMMA", "REPEAT"})


@dataclass(frozen=True, slots=True)
class _Token:
    """A token, or a comment.

    Attributes:
        text: Source text.
        kind: Terminal of the grammar; `#` for a comment.
        own_line: Whether a comment is on a line of its own.
        blank_before: Whether a blank line precedes it.
    """

    text: str
    kind: str
    own_line: bool = False
    blank_before: bool = False


def formatted(text: str) -> str:
    """Format a task file.

    Args:
        text: A syntactically valid task file; names are not checked.

    Returns:
        The same statements and comments; `formatted(formatted(text)) == formatted(text)`.

    Raises:
        lark.exceptions.UnexpectedInput: At a syntax error.
    """
    words = list(_words(text))
    statements = list(_statements(words))
    heads = [len(_head(s)) for s in statements if _has_head(s)]
    width = max((h for h in heads if h <= LONGEST_HEAD), default=0)
    lines: list[str] = []
    for statement in statements:
        if lines and statement[0].blank_before:
            lines.append("")
        lines += _laid_out(statement, width)
    return "\n".join(lines) + "\n" if lines else ""


def _words(text: str) -> Iterator[_Token]:
    """Tokens and comments in the order of the text."""
    source = text.split("\n")
    code, _ = normalise(text, Source(text, ""))
    comments = _comments(source, code.split("\n"))
    found = [(t.line or 0, t.column or 0, t) for t in tokens(code)]
    ends = {t.end_line for _, _, t in found}
    merged: list[tuple[int, int, Token | str]] = [*found, *comments]
    merged.sort(key=lambda item: item[:2])
    last = 0
    for line, _, item in merged:
        blank = line > last + 1 and last > 0
        if isinstance(item, Token):
            last = item.end_line or line
            yield from _token_words(item, blank)
        else:
            last = line
            own = line not in ends
            yield _Token(item, "#", own, blank)


def _comments(source: list[str], code: list[str]) -> list[tuple[int, int, str]]:
    """(line, column, comment) of every comment."""
    found = []
    for number, (line, clean_line) in enumerate(zip(source, code, strict=True), 1):
        start = len(clean_line.rstrip())
        at = line.find("#", start)
        if at >= 0:
            found.append((number, at + 1, line[at:].rstrip()))
    return found


def _token_words(token: Token, blank: bool) -> Iterator[_Token]:
    if token.type == "HEAD":
        name = str(token)[1 : str(token).index(">")].strip(" ")
        yield _Token(f"<{name}>", "HEAD", blank_before=blank)
        yield _Token("::=", "DEFINER")
    elif token.type == "STAGE":
        yield _Token(f"<{str(token)[1:-1].strip(' ')}>", "STAGE", blank_before=blank)
    else:
        yield _Token(str(token), token.type, blank_before=blank)


def _statements(words: list[_Token]) -> Iterator[list[_Token]]:
    """Statements, and the comments between them as separate items.

    Comments on their own lines before a statement do not belong to the previous one.
    """
    current: list[_Token] = []
    for i, word in enumerate(words):
        begins = word.kind in STARTERS or (word.kind == "HEAD" and not _is_marked(current))
        if word.kind == "ACTOR" and current and current[-1].kind == "OPTIONAL":
            begins = False
        loose = word.kind == "#" and word.own_line and _no_more(words, i)
        if current and (begins or loose):
            yield current
            current = []
        if loose:
            yield [word]
        else:
            current.append(word)
    if current:
        yield current


def _is_marked(current: list[_Token]) -> bool:
    return bool(current) and current[-1].kind == "TASK"


def _no_more(words: list[_Token], i: int) -> bool:
    """Whether only comments are between a position and the next statement."""
    rest = (w for w in words[i:] if w.kind != "#")
    following = next(rest, None)
    return following is None or following.kind in STARTERS or following.kind == "HEAD"


def _has_head(statement: list[_Token]) -> bool:
    return any(w.kind == "HEAD" for w in statement)


def _head(statement: list[_Token]) -> str:
    at = next(i for i, w in enumerate(statement) if w.kind == "HEAD")
    return " ".join(w.text for w in statement[: at + 1] if w.kind != "#")


def _laid_out(statement: list[_Token], width: int) -> Iterator[str]:
    """The lines of one statement, filled to the width, broken before `|` if necessary."""
    indent = 4
    words = statement
    if _has_head(statement) and not any(w.kind == "#" for w in statement[:3]):
        head = _head(statement)
        indent = max(width, len(head)) + 5
        if len(head) > LONGEST_HEAD:
            indent = 4
        at = next(i for i, w in enumerate(statement) if w.kind == "HEAD")
        words = [_Token(head.ljust(width), "HEAD"), *statement[at + 1 :]]
    line, empty = "", True
    for before, word in pairwise([None, *words]):
        assert word is not None
        text = word.text
        gap = "" if empty or (before and _tight(before, word)) else " "
        if word.kind == "#" and not word.own_line and not empty:
            yield f"{line.rstrip()}  {text}"
            line, empty = " " * indent, True
            continue
        if word.kind == "#":
            if not empty:
                yield line.rstrip()
            yield (" " * indent if before else "") + text
            line, empty = " " * indent, True
            continue
        if not empty and gap and len(line) + 1 + _unbroken(words, word) > WIDTH:
            yield line.rstrip()
            line, gap = " " * indent, ""
        line, empty = line + gap + text, False
    if not empty:
        yield line.rstrip()


def _unbroken(words: list[_Token], word: _Token) -> int:
    """Length of the text up to the next possible line break."""
    at = next(i for i, w in enumerate(words) if w is word)
    length = len(word.text)
    for before, following in pairwise(words[at:]):
        if following.kind == "#" or not _tight(before, following):
            break
        length += len(following.text)
    return length


def _tight(before: _Token, word: _Token) -> bool:
    """Whether two tokens are joined without a space."""
    if word.kind in TIGHT_BEFORE or before.kind == "LPAR":
        return True
    return word.kind == "LPAR" and before.kind == "NAME"
