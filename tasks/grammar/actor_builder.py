"""Builds the nodes of actors, bystanders and parts from parsed text."""

# ruff: noqa: D102  # each method is named for its grammar rule

from __future__ import annotations

from collections.abc import Sequence as Several
from typing import Any, Literal, cast

from lark import Token, Transformer

from visup.rules.formula.units import Span
from visup.tasks.grammar.criteria import (
    Another,
    Colours,
    Conduct,
    Criterion,
    Extent,
    OtherModels,
    PartOf,
    Place,
    Rank,
    Ranked,
    Side,
    in_order,
)
from visup.tasks.grammar.nodes import Actor, Actors, Name, Number, ParameterRef


class ActorBuilder(Transformer[Token, Any]):
    """One method for each grammar rule about actors."""

    def actors(self, items: list[Token]) -> Actors:
        return Actors(_names(items), span_of(items[0]).to(span_of(items[-1])))

    def actor(self, items: list[Any]) -> Actor:
        optional = items[0].type == "OPTIONAL"
        name, *rest = items[1:] if optional else items
        size = next((i for i in rest if isinstance(i, Number | ParameterRef)), None)
        traits = [t for i in rest if isinstance(i, list) for t in i]
        models, criteria = _models_and_criteria(traits)
        return Actor(str(name), models, size, optional, span_of(name), criteria)

    # Descriptions of an actor: each a list of criteria, with models as `OtherModels`.
    def models(self, items: list[Token]) -> list[Criterion]:
        return [OtherModels(tuple(map(str, items)))]

    def colours(self, items: list[str]) -> list[Criterion]:
        return [Colours(tuple(items))]

    def colour(self, items: list[Token]) -> str:
        return " ".join(map(str, items))

    def rank(self, items: list[Any]) -> list[Criterion]:
        return [*(items[2] if len(items) > 2 else []), Ranked(cast("Rank", str(items[1])))]

    def another(self, items: list[Any]) -> list[Criterion]:
        return [*(items[1] if len(items) > 1 else []), Another()]

    def place(self, items: list[Any]) -> list[Criterion]:
        return [Place(items[1])]

    def extent(self, items: list[Any]) -> list[Criterion]:
        return [Extent(cast('Literal["larger", "smaller"]', str(items[0])), items[1])]

    def conduct(self, items: list[Token]) -> list[Criterion]:
        kind = cast('Literal["enters", "moves", "rests"]', str(items[1]))
        side = cast("Side", str(items[3])) if len(items) > 3 else ""
        return [Conduct(kind, side)]

    def part(self, items: list[Token]) -> list[Criterion]:
        machine = Name(str(items[1]), span_of(items[1]))
        return [PartOf(machine, span_of(items[0]).to(span_of(items[1])))]

    def bystander(self, items: list[Any]) -> Actor:
        _, name, *rest = items
        models, criteria = _models_and_criteria([t for i in rest for t in i])
        return Actor(str(name), models, span=span_of(name), criteria=criteria, bystander=True)

    def ignored(self, items: list[Token]) -> Actor:
        return Actor("", span=span_of(items[0]), bystander=True)


def span_of(token: Token) -> Span:
    """The span of a token; for a head only the part in angle brackets."""
    line, column = token.line or 0, token.column or 0
    width = str(token).index(">") + 1 if token.type == "HEAD" else len(token)
    return Span(line, column, line, column + width)


def _models_and_criteria(
    traits: Several[Criterion],
) -> tuple[tuple[str, ...], tuple[Criterion, ...]]:
    """The models named first, and all other criteria ordered by kind."""
    models = next((t for t in traits if isinstance(t, OtherModels)), None)
    others = in_order(t for t in traits if t is not models)
    return (models.names if models is not None else ()), others


def _names(tokens: list[Token]) -> tuple[Name, ...]:
    return tuple([Name(str(t), span_of(t)) for t in tokens])
