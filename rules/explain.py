"""Why a rule is true, false or unknown of some objects: the values of all that it is made of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isinf

import numpy as np

from visup.agent import Truth
from visup.agent.changing import replace
from visup.rules.formula import (
    Comparison,
    Formula,
    Node,
    Predicate,
    Quantified,
    Rule,
    children,
    mark,
)
from visup.rules.intervals import UNKNOWN, Interval
from visup.rules.monitor import verdict
from visup.rules.program import Place, Scope
from visup.rules.ruled import scope_of
from visup.rules.sentences import short
from visup.rules.terms import Measure, Term
from visup.rules.units import TICKS, Number
from visup.rules.verdicts import Values
from visup.rules.vocabulary import RULES


@dataclass(frozen=True, slots=True)
class Explanation:
    """What a formula or quantity came to, and what it was made of.

    Attributes:
        text: Its source, with objects by name.
        interval: Robustness of a formula, value of a quantity in its base unit.
        verdict: Of a formula; None of a quantity.
        parts: What it is made of.
        late_s: How many seconds ago the moment is that is spoken of.
        unit: Of a quantity.
    """

    text: str
    interval: Interval
    verdict: Truth | None
    parts: tuple[Explanation, ...] = ()
    late_s: float = 0.0
    unit: str = ""

    def lines(self, indent: int = 0) -> Iterator[str]:
        """The tree as indented lines of text."""
        yield "  " * indent + self.line()
        for part in self.parts:
            yield from part.lines(indent + 1)

    def line(self) -> str:
        """This node alone: `gap(the arm, the probe) < 20 px is true, by 3.5`."""
        late = f" ({self.late_s:g} s ago)" if self.late_s else ""
        if self.verdict is None:
            return f"{self.text} = {_amount(self.interval, self.unit)}{late}"
        return f"{self.text} is {self.verdict.value}{_margin(self.interval)}{late}"

    def __str__(self) -> str:
        return "\n".join(self.lines())


def explained(rule: Rule, ids: tuple[int, ...], values: Values) -> Explanation:
    """Why a rule is true, false or unknown of some objects.

    Args:
        rule: The rule.
        ids: Objects, in the order of its variables.
        values: The values of all formulas.

    Returns:
        The rule with `when` and `unless`; it is false where `unless` is true.
    """
    reader = _Reader(values, rule, ids)
    parts = [reader.node(f) for f in rule.formulas]
    suspended = len(parts) > 1 and parts[1].verdict is Truth.TRUE
    low, high = parts[0].interval
    interval = (-np.inf, min(high, -parts[1].interval[0])) if suspended else (low, high)
    names = ", ".join(short(values.facts.mind, i) for i in ids)
    titled = tuple(
        replace(p, text=f"{word} {p.text}")
        for word, p in zip(("when", "unless"), parts, strict=False)
    )
    found = Truth.FALSE if suspended else parts[0].verdict
    return Explanation(f"{rule.name}({names})", interval, found, titled, parts[0].late_s)


def evidence(rule: Rule, ids: tuple[int, ...], values: Values) -> tuple[str, ...]:
    """One sentence for each fact and comparison of `when`: what it says of these objects."""
    reader = _Reader(values, rule, ids)
    return tuple([f"{reader.told(f)}." for f in values.prepared.told(rule)])


class _Reader:
    """Reads the values of a rule's formulas for one choice of objects."""

    def __init__(self, values: Values, rule: Rule, ids: tuple[int, ...]) -> None:
        self.values = values
        self.mind = values.facts.mind
        self.scope: Scope = scope_of(rule)
        self.rows = tuple(values.facts.row[i] for i in ids)
        self.names = {v: short(self.mind, i) for v, i in zip(rule.variables, ids, strict=True)}

    def told(self, formula: Formula) -> str:
        """One line on a fact, on a quantifier, or on a comparison with its quantities in its text.

        The last is `gap(the arm, the probe) = 3 px < 20 px is true`.
        """
        if not isinstance(formula, Comparison):
            return self.node(formula, deep=False).line()
        sides = [
            str(s) if isinstance(s, Number) else self.node(s, deep=False).line()
            for s in (formula.left, formula.right)
        ]
        place, interval = self._value(formula)
        text = f"{sides[0]} {formula.operator} {sides[1]}"
        # By how much is told by the quantities.
        return Explanation(text, UNKNOWN, verdict(interval), (), place.delay / TICKS).line()

    def node(self, node: Node, *, deep: bool = True) -> Explanation:
        """What a node came to; with what it is made of, if `deep`."""
        place, interval = self._value(node)
        term = isinstance(node, Term)
        whole = deep and not isinstance(node, Predicate | Measure | Number)
        return Explanation(
            self._text(node),
            interval,
            None if term else verdict(interval),
            self._parts(node) if whole else (),
            place.delay / TICKS,
            _unit(node) if term else "",
        )

    def _value(self, node: Node) -> tuple[Place, Interval]:
        """Where a node stands, and what it came to for these objects."""
        place = self.values.prepared.place(node, self.scope)
        return place, self.values.interval(place, self.rows)

    def _text(self, node: Node) -> str:
        """Its source, with objects by name."""
        text = self.values.prepared.text(node, tuple(self.names))
        for variable, name in self.names.items():
            text = text.replace(mark(variable), name)
        return text

    def _parts(self, node: Node) -> tuple[Explanation, ...]:
        if isinstance(node, Quantified):
            return self._witness(node)
        return tuple(self.node(p) for p in children(node) if not isinstance(p, Number))

    def _witness(self, node: Quantified) -> tuple[Explanation, ...]:
        """The part for the object that decides: the truest one of `exists`, the least of `forall`."""
        outer = self.scope, self.rows, self.names
        found = []
        for object_id, row in self.values.facts.row.items():
            apart = (r for r, (_, repeats) in zip(outer[1], outer[0], strict=True) if not repeats)
            if not node.may_repeat and row in apart:
                continue
            self.scope = (*outer[0], (node.variable, node.may_repeat))
            self.rows = (*outer[1], row)
            self.names = {**outer[2], node.variable: short(self.mind, object_id)}
            found.append(self.node(node.part))
            self.scope, self.rows, self.names = outer
        if not found:
            return ()
        pick = max if node.kind == "exists" else min
        return (pick(found, key=lambda e: e.interval),)


def _unit(node: Node) -> str:
    if not isinstance(node, Measure):
        return ""
    return RULES.quantities[node.name].unit


def _margin(interval: Interval) -> str:
    low, high = interval
    if isinf(low) and isinf(high):
        return ""
    if low > 0 or high < 0:
        return f", by {low if low > 0 else -high:.3g}"
    return f", from {low:.3g} to {high:.3g}"


def _amount(interval: Interval, unit: str) -> str:
    if interval == UNKNOWN:
        return "unknown"
    scale = 100.0 if unit == "%" else 1.0
    first, last = (f"{bound * scale:.3g}" for bound in interval)
    number = first if first == last else f"{first} to {last}"
    return f"{number} {unit}".rstrip()
