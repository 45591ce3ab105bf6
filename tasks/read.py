"""From text to tree, by the grammar in `tasks.lark`."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files
from typing import Any, Literal, cast

from lark import Lark, Token, Transformer, v_args
from lark.tree import Meta

from visup.tasks.tree import (
    Action,
    Actor,
    Actors,
    Choice,
    Clause,
    Course,
    Deadline,
    Duration,
    Hold,
    Invariant,
    Name,
    Reference,
    Repeated,
    Sequence,
    Span,
    Stage,
    Task,
    Timed,
    Together,
)


def read(text: str, file: str = "<text>") -> Task:
    """The tree of a text, by syntax alone.

    Args:
        text: A whole task file, or some of its statements.
        file: Its name, for messages.

    Returns:
        The tree; whether its names make sense is not looked at (see `check`).

    Raises:
        lark.exceptions.UnexpectedInput: Where the text leaves the grammar.
    """
    statements = cast("list[Stage | Actor | Invariant]", _ToTree().transform(_parser().parse(text)))
    return Task(
        stages=tuple(s for s in statements if isinstance(s, Stage)),
        actors=tuple(s for s in statements if isinstance(s, Actor)),
        invariants=tuple(s for s in statements if isinstance(s, Invariant)),
        file=file,
    )


@lru_cache(maxsize=1)
def _parser() -> Lark:
    grammar = files("visup.tasks").joinpath("tasks.lark").read_text(encoding="utf-8")
    return Lark(
        grammar,
        parser="lalr",
        lexer="contextual",
        propagate_positions=True,
        maybe_placeholders=False,
    )


@v_args(meta=True)
class _ToTree(Transformer[Token, Any]):
    """One method for each rule of the grammar."""

    def start(self, meta: Meta, items: list[Any]) -> list[Any]:
        return items

    def stage(self, meta: Meta, items: list[Any]) -> Stage:
        head, body = items
        return Stage(_bare(head), cast("Course | Actors", body), _of(head))

    def actors(self, meta: Meta, items: list[Token]) -> Actors:
        return Actors(_names(items), _at(meta))

    def actor(self, meta: Meta, items: list[Token]) -> Actor:
        name, *models = items
        return Actor(str(name), tuple(map(str, models)), _of(name))

    def invariant(self, meta: Meta, items: list[Any]) -> Invariant:
        when = cast('Literal["never", "always"]', str(items[0]))
        return Invariant(when, items[1], items[2] if len(items) > 2 else None, _at(meta))

    def choice(self, meta: Meta, items: list[Course]) -> Choice:
        return Choice(tuple(items), _at(meta))

    def sequence(self, meta: Meta, items: list[Course]) -> Sequence:
        return Sequence(tuple(items), _at(meta))

    def together(self, meta: Meta, items: list[Course]) -> Together:
        return Together(tuple(items), _at(meta))

    def timed(self, meta: Meta, items: list[Any]) -> Timed:
        return Timed(items[0], cast("tuple[Clause, ...]", tuple(items[1:])), _at(meta))

    def repeated(self, meta: Meta, items: list[Any]) -> Repeated:
        return Repeated(items[0], cast('Literal["?", "*", "+"]', str(items[1])), _at(meta))

    def hold(self, meta: Meta, items: list[Duration]) -> Hold:
        return Hold(items[0], _at(meta))

    def deadline(self, meta: Meta, items: list[Duration]) -> Deadline:
        return Deadline(items[0], _at(meta))

    def duration(self, meta: Meta, items: list[Token]) -> Duration:
        return Duration(float(items[0]), str(items[1]), _at(meta))

    def action(self, meta: Meta, items: list[Token]) -> Action:
        return Action(str(items[0]), _names(items[1:]), _at(meta))

    def reference(self, meta: Meta, items: list[Token]) -> Reference:
        return Reference(_bare(items[0]), _of(items[0]))


def _names(tokens: list[Token]) -> tuple[Name, ...]:
    return tuple(Name(str(t), _of(t)) for t in tokens)


def _bare(token: Token) -> str:
    """The name between the angle brackets of a head or a reference."""
    return str(token)[1 : str(token).index(">")].strip(" ")


def _of(token: Token) -> Span:
    """Where a token stands; of a head only the part in angle brackets."""
    line, column = token.line or 0, token.column or 0
    width = str(token).index(">") + 1 if token.type == "HEAD" else len(token)
    return Span(line, column, line, column + width)


def _at(meta: Meta) -> Span:
    return Span(meta.line, meta.column, meta.end_line, meta.end_column)
