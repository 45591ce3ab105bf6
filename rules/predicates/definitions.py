"""Definitions of the words of the rule language: predicates, quantities, and vocabularies of both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from visup.rules.formula.units import (
    ANGLE,
    ANGULAR_SPEED,
    LENGTH,
    REAL_LENGTH,
    SHARE,
    SPEED,
    TIME,
    Dimension,
)
from visup.rules.predicates.snapshot import Codes, Floats


@dataclass(frozen=True, slots=True)
class PredicateDefinition:
    """A predicate of the rule language: true, false or unknown.

    Attributes:
        argument_kinds: Kinds of its arguments: 'object', 'relation', 'kind', 'name', 'zone', 'signal',
            'word', 'allen' or 'tpcc' (relations of these calculi).
        evaluate: Its evaluation: codes of all objects, one dimension per argument 'object', in order; the
            other arguments are passed as words.
        meaning: Its meaning in one clause.
    """

    argument_kinds: tuple[str, ...]
    evaluate: Callable[..., Codes]
    meaning: str


@dataclass(frozen=True, slots=True)
class QuantityDefinition:
    """A quantity of the rule language.

    Attributes:
        argument_kinds: Kinds of its arguments.
        dimension: Its dimension.
        evaluate: Its intervals in the base unit, (2, ...), for all objects.
        meaning: Its meaning in one clause.
        plain: Whether it is a plain number instead of a share.
    """

    argument_kinds: tuple[str, ...]
    dimension: Dimension
    evaluate: Callable[..., Floats]
    meaning: str
    plain: bool = False

    @property
    def unit(self) -> str:
        """The unit in which it is shown; empty for a plain number."""
        if self.plain:
            return ""
        units = {TIME: "s", LENGTH: "px", SPEED: "px/s", ANGULAR_SPEED: "deg/s", SHARE: "%"}
        return {**units, ANGLE: "deg", REAL_LENGTH: "m"}[self.dimension]


@dataclass(frozen=True, slots=True, eq=False)
class Vocabulary:
    """The names available in formulas.

    Attributes:
        predicates: Relations and facts.
        quantities: Numbers.
    """

    predicates: Mapping[str, PredicateDefinition]
    quantities: Mapping[str, QuantityDefinition]
