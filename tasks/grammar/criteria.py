"""Criteria that identify an actor besides its models: colour, size, order, place, conduct, machine.

Each criterion is a frozen node that prints itself as source, like all nodes of a task file.

Read next: `nodes.py` (the declaration of an actor), `../casting/fitness.py` (what they mean).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from visup.rules.formula.units import NOWHERE, Span, number_text
from visup.tasks.grammar.conditions import Amount, Name

Rank = Literal["largest", "smallest", "leftmost", "rightmost", "highest", "lowest"]
Side = Literal["left", "right", "top", "bottom"]


@dataclass(frozen=True, slots=True)
class Colours:
    """`red or dark blue`: alternative colours of one or two words."""

    names: tuple[str, ...]

    def __str__(self) -> str:
        return " or ".join(self.names)


@dataclass(frozen=True, slots=True)
class OtherModels:
    """`... and mug`: models in addition to earlier ones, which is an error (E236)."""

    names: tuple[str, ...]

    def __str__(self) -> str:
        return " or ".join(self.names)


@dataclass(frozen=True, slots=True)
class Ranked:
    """`the leftmost`: first in some order among the objects that fit the other criteria."""

    rank: Rank

    def __str__(self) -> str:
        return f"the {self.rank}"


@dataclass(frozen=True, slots=True)
class Another:
    """`another red`, `another one`: not the one that an actor declared alike is."""

    def __str__(self) -> str:
        return "another one"


@dataclass(frozen=True, slots=True)
class Extent:
    """`larger than 40 px`: a limit of its largest extent in the image."""

    compared: Literal["larger", "smaller"]
    amount: Amount

    def __str__(self) -> str:
        return f"{self.compared} than {self.amount}"


@dataclass(frozen=True, slots=True)
class Place:
    """`at (410, 160)`: the object that is there, or was when first seen, pixels."""

    at: tuple[float, float]

    def __str__(self) -> str:
        return f"at ({number_text(self.at[0])}, {number_text(self.at[1])})"


@dataclass(frozen=True, slots=True)
class Conduct:
    """`what enters from the left`, `what moves first`, `what rests`.

    Attributes:
        kind: The kind of conduct.
        side: Side of the image over which it enters; empty for any.
    """

    kind: Literal["enters", "moves", "rests"]
    side: Side | Literal[""] = ""

    def __str__(self) -> str:
        more = {"enters": f" from the {self.side}" if self.side else "", "moves": " first"}
        return f"what {self.kind}{more.get(self.kind, '')}"


@dataclass(frozen=True, slots=True)
class PartOf:
    """`part of arm`: a part of another actor, the machine."""

    machine: Name
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"part of {self.machine}"


Criterion: TypeAlias = (
    Colours | OtherModels | Ranked | Another | Extent | Place | Conduct | PartOf
)  # fmt: skip


def in_order(criteria: Iterable[Criterion]) -> tuple[Criterion, ...]:
    """Criteria in printing order, each once: looks first, `another`, orders, then the rest."""
    return tuple(sorted(dict.fromkeys(criteria), key=_rank))


def _rank(criterion: Criterion) -> int:
    if isinstance(criterion, Colours | OtherModels):
        return 0
    if isinstance(criterion, Another):
        return 1
    return 2 if isinstance(criterion, Ranked) else 3


def declared_as(models: Sequence[str], criteria: Sequence[Criterion]) -> str:
    """The declaration of an actor after its name: 'is cup and red', 'at (410, 160)', or nothing."""
    nouns = [" or ".join(models)] if models else []
    nouns += [str(c) for c in criteria if isinstance(c, Colours | OtherModels)]
    others = [c for c in criteria if not isinstance(c, Colours | OtherModels | Another)]
    rank = next((c for c in others if isinstance(c, Ranked)), None)
    if any(isinstance(c, Another) for c in criteria):
        nouns[:1] = [f"another {nouns[0]}" if nouns else "another one"]
    elif nouns and rank is not None:
        nouns[0] = f"{rank} {nouns[0]}"
        others.remove(rank)
    said = " and ".join([*nouns, *map(str, others)])
    return said if not said or said.startswith("at (") else f"is {said}"
