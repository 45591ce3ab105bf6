"""Watch expressions: formulas or quantities of the rule language, evaluated on minds from outside.

>>> expression("gap(arm, satellite)").quantity
True
>>> expression("touching(1, 2) for 0.5 s").rule.variables
('object_1', 'object_2')

Names of one letter stand for any object; longer names refer to the object with that actor role or identified
as that model; a number is an object's id.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import isinf
from typing import Any, cast

from visup.agent import Mind, Truth
from visup.agent.model.errors import ErrorGroup, RuleError, SourceLocation, VisupError
from visup.rules.formula.nodes import Comparison, Rule
from visup.rules.formula.units import ticks
from visup.rules.language.parser import parse_rules
from visup.rules.monitoring.compiler import scope_of
from visup.rules.monitoring.intervals import Interval, verdict
from visup.rules.monitoring.samples import MIN_SPACING
from visup.rules.monitoring.states import States
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import RULES
from visup.rules.safety.compiled_rules import compile_rules
from visup.rules.safety.explain import RuleExplanation, explain_rule
from visup.rules.safety.verdicts import Evaluation, reindexed_states

_CALL = re.compile(r"\b([A-Za-z_]\w*)\s*\(([^()]*)(?:\)|$)")
"""A word with its arguments, even if the closing parenthesis is missing."""
_NAME = re.compile(r"\b[A-Za-z_]\w*")
_BOUND = re.compile(r"\b(?:exists|forall)\s+([A-Za-z_]\w*)")
_BY_ID = re.compile(r"object_(\d+)")
_SAY = 'say "."'
_WRITTEN = "condition"
"""Used in messages in place of a file."""


@dataclass(frozen=True, slots=True)
class ExpressionValue:
    """The value of an expression for one binding of objects.

    Attributes:
        objects: Ids, in the order of the expression's names.
        interval: Robustness of a formula; value of a quantity in its unit.
        truth: Verdict of a formula; None for a quantity.
        unit: Unit of a quantity.
    """

    objects: tuple[int, ...]
    interval: Interval
    truth: Truth | None
    unit: str = ""

    def __str__(self) -> str:
        if self.truth is not None:
            return self.truth.value
        low, high = self.interval
        if isinf(low) or isinf(high):
            return "unknown"
        scale = 100.0 if self.unit == "%" else 1.0
        first, last = f"{low * scale:.4g}", f"{high * scale:.4g}"
        text = first if first == last else f"{first} to {last}"
        return f"{text} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True, eq=False)
class ExpressionResult:
    """The values of an expression on one mind.

    Attributes:
        now: Microseconds of the mind.
        ids: Its objects.
        before: States of the operators before the step, for these objects.
        after: States after the step.
        readings: One for each binding of objects.
    """

    now: int
    ids: tuple[int, ...]
    before: States
    after: States
    readings: tuple[ExpressionValue, ...]

    @property
    def truths(self) -> Mapping[tuple[int, ...], Truth | Interval]:
        """Binding of objects -> verdict of a formula, interval of a quantity."""
        return {r.objects: r.interval if r.truth is None else r.truth for r in self.readings}


@dataclass(frozen=True, slots=True)
class Expression:
    """A compiled expression.

    Attributes:
        text: Its source.
        rule: Rule with it as `when`; for a quantity, as the left side of a comparison.
        quantity: Whether it is a quantity.
    """

    text: str
    rule: Rule
    quantity: bool

    def judge(self, mind: Mind, before: ExpressionResult | None = None) -> ExpressionResult:
        """Evaluate it on a mind.

        Args:
            mind: The mind after a step.
            before: The result of the previous step; without it, windows start here.
        """
        compiled, now, facts = compile_rules((self.rule,)), ticks(mind.time), Snapshot(mind)
        if before is not None and not now > before.now:
            before = None
        states = compiled.initial_states(len(facts.ids)) if before is None else before.after
        if before is not None and now - before.now < MIN_SPACING:
            return before
        if before is not None and before.ids != facts.ids:
            states = reindexed_states(compiled, states, now, before.ids, facts.ids)
        values = Evaluation(compiled, facts, now, states)
        readings = tuple(self._reading(values, ids) for ids in self._choices(mind, facts.ids))
        return ExpressionResult(now, facts.ids, states, values.after, readings)

    def explain(
        self, mind: Mind, judged: ExpressionResult, ids: tuple[int, ...]
    ) -> RuleExplanation:
        """Explain its value for some objects, on the mind on which it was evaluated."""
        values = Evaluation(compile_rules((self.rule,)), Snapshot(mind), judged.now, judged.before)
        whole = explain_rule(self.rule, ids, values).parts[0]
        return whole.parts[0] if self.quantity else whole

    def _reading(self, values: Evaluation, ids: tuple[int, ...]) -> ExpressionValue:
        if self.quantity:
            node = cast("Comparison", self.rule.when).left
            place, unit = values.compiled.value_ref(node, scope_of(self.rule)), _unit(node)
        else:
            place, unit = values.compiled.condition_refs[0][0], ""
        low, high = values.interval(place, tuple(values.facts.row[i] for i in ids))
        truth = None if self.quantity else verdict((low, high))
        return ExpressionValue(ids, (low, high), truth, unit)

    def _choices(self, mind: Mind, present: Sequence[int]) -> Iterator[tuple[int, ...]]:
        """All bindings of distinct objects that the names allow."""
        meant = [objects_named(mind, v, present) for v in self.rule.variables]
        for ids in product(*meant):
            if len(set(ids)) == len(ids):
                yield ids


def expression(text: str) -> Expression:
    """Parse a formula or a quantity.

    Raises:
        RuleError: It is neither, or uses unknown names.
        ManyErrors: It has several errors.
    """
    written, variables = _with_variables(text)
    try:
        return Expression(text, _rule(written, variables), False)
    except (RuleError, ErrorGroup) as fault:
        try:
            rule = _rule(f"({written}) >= ({written})", variables)
        except (RuleError, ErrorGroup):
            raise fault from None
        return Expression(text, rule, True)


def objects_named(mind: Mind, name: str, present: Sequence[int]) -> tuple[int, ...]:
    """The objects that a name in an expression may refer to.

    Args:
        mind: The mind.
        name: One letter, `object_N`, an actor or a model.
        present: Ids of objects that are believed present.
    """
    if by_id := _BY_ID.fullmatch(name):
        return tuple(i for i in present if i == int(by_id[1]))
    if len(name) == 1:
        return tuple(present)
    playing = {
        b.object_id for t in mind.tasks for b in t.bindings if b.actor == name and b.object_id
    }
    if playing:
        return tuple(i for i in present if i in playing)
    models = (*mind.actors.get(name, ()), name)
    return tuple(i for i in present if mind.objects[i].name in models)


UNFINISHED = re.compile(r"(?:[(,<>=+*/\[-]|\b(?:and|or|not|unless|until|within|for))\s*$")
"""Signs and words that cannot end an expression."""


def _rule(text: str, variables: tuple[str, ...]) -> Rule:
    if not text.strip():
        raise RuleError("there is no condition", expected="one such as: touching(a, b)")
    if last := UNFINISHED.search(text):
        expected = f"what belongs after '{last[0].strip()}'"
        raise RuleError(f"'{text}' ends too early", expected=expected)
    lines = f"rule watched({', '.join(variables)}): info when\n{text}\n{_SAY}"
    try:
        (rule,) = parse_rules(lines, _WRITTEN)
    except (RuleError, ErrorGroup) as fault:
        raise _of_text(text, fault) from None
    return rule


def _of_text(text: str, fault: RuleError | ErrorGroup) -> RuleError | ErrorGroup:
    """Translate errors of the wrapping rule to errors of the text, at its own lines."""
    found = list(fault.errors) if isinstance(fault, ErrorGroup) else [fault]
    own = [e for e in found if isinstance(e.where, SourceLocation) and e.where.line > 1]
    translated = [_unwrapped(text, e) for e in own or found]
    return translated[0] if len(translated) == 1 else ErrorGroup(list(translated))


def _unwrapped(text: str, fault: VisupError) -> RuleError:
    place = fault.where
    if not isinstance(place, SourceLocation) or place.line == 1:
        return RuleError(f"'{text}' is no condition ({fault.what})", expected=fault.expected)
    if place.line > text.count("\n") + 2:
        # The error is in the wrapping: the text is incomplete.
        return RuleError(f"'{text}' ends too early", expected=fault.expected)
    where = replace(place, line=place.line - 1)
    return RuleError(fault.what, where=where, expected=fault.expected, hint=fault.hint)


def _with_variables(text: str) -> tuple[str, tuple[str, ...]]:
    """The text with ids replaced by names, and its free names in order."""
    found: dict[str, None] = {}
    bound = set(_BOUND.findall(text))

    def rewritten(call: re.Match[str]) -> str:
        word: Any = RULES.predicates.get(call[1]) or RULES.quantities.get(call[1])
        names = [a.strip() for a in call[2].split(",")]
        if word is None or len(names) != len(
            word.argument_kinds
        ):  # reported later, and its names are known
            found.update(dict.fromkeys(n for n in _NAME.findall(call[2]) if n not in bound))
            return call[0]
        for n, takes in enumerate(word.argument_kinds):
            if takes == "object":
                names[n] = f"object_{names[n]}" if names[n].isdecimal() else names[n]
                if names[n] not in bound and names[n].isidentifier():
                    found[names[n]] = None
        return f"{call[1]}({', '.join(names)}{')' if call[0].endswith(')') else ''}"

    return _CALL.sub(rewritten, text), tuple(found)


def _unit(node: Any) -> str:
    quantity = RULES.quantities.get(getattr(node, "name", ""))
    return quantity.unit if quantity else ""
