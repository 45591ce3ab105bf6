"""Explanations of rule verdicts: the values of all subformulas for some objects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isinf

import numpy as np

from visup.agent import Truth
from visup.agent.model.fast_replace import replace
from visup.rules.formula.nodes import (
    Comparison,
    Node,
    Predicate,
    Quantified,
    Rule,
    children,
    placeholder,
)
from visup.rules.formula.terms import Measure, Term, Variable
from visup.rules.formula.units import TICKS, Number
from visup.rules.monitoring.compiler import Scope, ValueRef, scope_of
from visup.rules.monitoring.intervals import UNKNOWN, Interval, verdict
from visup.rules.predicates.vocabulary import RULES
from visup.rules.safety.compiled_rules import CompiledRules
from visup.rules.safety.verdicts import Evaluation
from visup.rules.wording.sentences import short


@dataclass(frozen=True, slots=True)
class RuleExplanation:
    """The value of a formula or quantity, with those of its parts.

    Attributes:
        text: Its source, with objects by name.
        interval: Robustness of a formula, value of a quantity in its base unit.
        verdict: Verdict of a formula; None for a quantity.
        parts: Explanations of its parts.
        late_s: Age of the moment it is about, seconds.
        unit: Unit of a quantity.
    """

    text: str
    interval: Interval
    verdict: Truth | None
    parts: tuple[RuleExplanation, ...] = ()
    late_s: float = 0.0
    unit: str = ""

    def lines(self, indent: int = 0) -> Iterator[str]:
        """The tree as indented lines of text."""
        yield "  " * indent + self.line()
        for part in self.parts:
            yield from part.lines(indent + 1)

    def line(self) -> str:
        """This node alone: `gap(the arm, the probe) < 20 px is true, by 3.5`."""
        late = _late(self.late_s)
        if self.verdict is None:
            return f"{self.text} = {_amount(self.interval, self.unit)}{late}"
        return f"{self.text} is {self.verdict.value}{_margin(self.interval)}{late}"

    def __str__(self) -> str:
        return "\n".join(self.lines())


def explain_rule(rule: Rule, ids: tuple[int, ...], values: Evaluation) -> RuleExplanation:
    """Why a rule is true, false or unknown of some objects.

    Args:
        rule: The rule.
        ids: Objects, in the order of its variables.
        values: The values of all formulas.

    Returns:
        The rule with `when` and `unless`; it is false if `unless` is true.
    """
    reader = _ExplanationBuilder(values, rule, ids)
    parts = [reader.node(f) for f in rule.formulas]
    suspended = len(parts) > 1 and parts[1].verdict is Truth.TRUE
    low, high = parts[0].interval
    interval = (-np.inf, min(high, -parts[1].interval[0])) if suspended else (low, high)
    names = ", ".join(short(values.facts.mind, i) for i in ids)
    titled_parts = tuple(
        replace(p, text=f"{word} {p.text}")
        for word, p in zip(("when", "unless"), parts, strict=False)
    )
    truth = Truth.FALSE if suspended else parts[0].verdict
    explanation = RuleExplanation(
        f"{rule.name}({names})", interval, truth, titled_parts, parts[0].late_s
    )
    early = values.compiled.early_refs[values.compiled.rules.index(rule)]
    return (
        explanation
        if early is None
        else _with_early(explanation, values.interval(early, reader.rows))
    )


def _with_early(late: RuleExplanation, interval: Interval) -> RuleExplanation:
    """A rule with its early verdict, which may make it true already."""
    early = RuleExplanation("what is decided by now", interval, verdict(interval))
    explanation = replace(late, parts=(*late.parts, early))
    if late.verdict is Truth.TRUE or early.verdict is not Truth.TRUE:
        return explanation
    return replace(explanation, interval=interval, verdict=Truth.TRUE, late_s=0.0)


MAX_LINES = 4096
"""Most cached evidence texts, by rule and names of objects."""


@dataclass(frozen=True, slots=True)
class EvidenceLine:
    """A template of a line of evidence.

    Attributes:
        place: Value reference of the fact or comparison.
        text: Its source, with objects by name; for a comparison its sign.
        sides: Compared quantities: text, value reference and unit; only a text for a number.
    """

    place: ValueRef
    text: str
    sides: tuple[tuple[str, ValueRef | None, str], ...] = ()

    def text_for(self, values: Evaluation, rows: tuple[int, ...]) -> str:
        """The line for some objects.

        For a comparison it has the values of its quantities, `gap(the arm, the probe) = 3 px < 20 px is
        true`, which also show the margin.
        """
        interval, text = values.interval(self.place, rows), self.text
        if not self.sides:
            text = f"{text} is {verdict(interval).value}{_margin(interval)}"
            return f"{text}{_late(self.place.delay / TICKS)}."
        left, right = (
            side
            if at is None
            else f"{side} = {_amount(values.interval(at, rows), unit)}{_late(at.delay / TICKS)}"
            for side, at, unit in self.sides
        )
        return (
            f"{left} {text} {right} is {verdict(interval).value}{_late(self.place.delay / TICKS)}."
        )


def evidence(rule: Rule, ids: tuple[int, ...], values: Evaluation) -> tuple[str, ...]:
    """One sentence for each fact and comparison of `when`, for these objects."""
    facts, compiled = values.facts, values.compiled
    names = tuple([facts.short(i) for i in ids])
    lines = compiled.lines.get((rule.name, names))
    if lines is None:
        if len(compiled.lines) >= MAX_LINES:
            compiled.lines.clear()
        lines = compiled.lines.setdefault((rule.name, names), _lines(rule, names, compiled))
    rows = tuple([facts.row[i] for i in ids])
    return tuple([line.text_for(values, rows) for line in lines])


def _lines(rule: Rule, names: tuple[str, ...], compiled: CompiledRules) -> tuple[EvidenceLine, ...]:
    """The evidence templates of a rule, for objects of these names."""
    scope, named = scope_of(rule), dict(zip(rule.variables, names, strict=True))

    def side(term: Term) -> tuple[str, ValueRef | None, str]:
        if isinstance(term, Number):
            return str(term), None, ""
        return _text(term, named, compiled), compiled.value_ref(term, scope), _unit(term)

    return tuple(
        EvidenceLine(compiled.value_ref(f, scope), f.operator, (side(f.left), side(f.right)))
        if isinstance(f, Comparison)
        else EvidenceLine(compiled.value_ref(f, scope), _text(f, named, compiled))
        for f in compiled.evidence_parts(rule)
    )


class _ExplanationBuilder:
    """Reads the values of a rule's formulas for one binding of objects."""

    def __init__(self, values: Evaluation, rule: Rule, ids: tuple[int, ...]) -> None:
        self.values = values
        self.mind = values.facts.mind
        self.scope: Scope = scope_of(rule)
        self.rows = tuple(values.facts.row[i] for i in ids)
        self.names = {v: short(self.mind, i) for v, i in zip(rule.variables, ids, strict=True)}

    def node(self, node: Node) -> RuleExplanation:
        """Explain a node, with its parts."""
        place, interval = self._value(node)
        term = isinstance(node, Term)
        whole = not isinstance(node, Predicate | Measure | Number | Variable)
        return RuleExplanation(
            _text(node, self.names, self.values.compiled),
            interval,
            None if term else verdict(interval),
            self._parts(node) if whole else (),
            place.delay / TICKS,
            _unit(node) if term else "",
        )

    def _value(self, node: Node) -> tuple[ValueRef, Interval]:
        """The value reference of a node, and its value for these objects."""
        place = self.values.compiled.value_ref(node, self.scope)
        return place, self.values.interval(place, self.rows)

    def _parts(self, node: Node) -> tuple[RuleExplanation, ...]:
        if isinstance(node, Quantified):
            return self._witness(node)
        return tuple(self.node(p) for p in children(node) if not isinstance(p, Number))

    def _witness(self, node: Quantified) -> tuple[RuleExplanation, ...]:
        """The part for the deciding object: the greatest for `exists`, the least for `forall`."""
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


def _text(node: Node, names: Mapping[str, str], compiled: CompiledRules) -> str:
    """The source of a node, with objects by name."""
    text = compiled.text(node, tuple(names))
    for variable, name in names.items():
        text = text.replace(placeholder(variable), name)
    return text


def _late(seconds: float) -> str:
    return f" ({seconds:g} s ago)" if seconds else ""


def _unit(node: Node) -> str:
    if isinstance(node, Variable) and node.part is not None:
        return _unit(node.part)
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
