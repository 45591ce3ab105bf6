"""Queries to a mind about its rules: their values at that step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product

from visup.agent import Mind, Truth
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import RuleError
from visup.rules.formula.nodes import Rule
from visup.rules.monitoring.intervals import verdict
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.safety.compiled_rules import compile_rules
from visup.rules.safety.explain import RuleExplanation, explain_rule
from visup.rules.safety.reasoner import rule_memory
from visup.rules.safety.verdicts import Evaluation


def explain(mind: Mind, rule: str, *ids: int) -> RuleExplanation:
    """Why a rule is true, false or unknown of some objects in a mind.

    Args:
        mind: A current or stored mind on which rules were evaluated.
        rule: Name of the rule.
        ids: Objects, in the order of its variables.

    Returns:
        The rule with `when` and `unless`; the rule is false if `unless` is true.

    Raises:
        RuleError: No such rule was evaluated, or the objects are not a binding of it.
    """
    values = evaluation_of(mind)
    return explain_rule(_checked_rule(values, rule, ids), ids, values)


def evaluation_of(mind: Mind) -> Evaluation:
    """The values of all formulas of all rules in a mind, recomputed from its memory.

    Raises:
        RuleError: No rules were evaluated on it.
    """
    memory = rule_memory(mind)
    if memory.now is None or memory.before is None:
        raise RuleError(
            "no rules have been evaluated in this mind", hint="let the agent make a step"
        )
    # Rules saw the tasks as of the previous step.
    facts = Snapshot(replace(mind, tasks=memory.tasks))
    return Evaluation(compile_rules(memory.rules, memory.early), facts, memory.now, memory.before)


def rule_named(values: Evaluation, name: str) -> Rule:
    """The rule of that name.

    Raises:
        RuleError: There is none.
    """
    rules = {rule.name: rule for rule in values.compiled.rules}
    if name not in rules:
        hint = did_you_mean(name, rules)
        what = f"no rule '{name}' was judged"
        raise RuleError(what, expected=f"one of {', '.join(rules)}", hint=hint)
    return rules[name]


def object_choices(values: Evaluation, rule: Rule) -> Iterator[tuple[int, ...]]:
    """All bindings of objects of a rule."""
    for ids in product(values.facts.ids, repeat=len(rule.variables)):
        once = [i for i, v in zip(ids, rule.variables, strict=True) if v not in rule.may_repeat]
        if len(set(once)) == len(once):
            yield ids


def verdicts(mind: Mind, name: str) -> Mapping[tuple[int, ...], Truth]:
    """The verdict of a rule on every binding of objects; false where it is suspended.

    Raises:
        RuleError: No rules were evaluated on the mind, or none of that name.
    """
    values = evaluation_of(mind)
    rule = rule_named(values, name)
    number = values.compiled.rules.index(rule)
    places, early = values.compiled.condition_refs[number], values.compiled.early_refs[number]
    found = {}
    for ids in object_choices(values, rule):
        rows = tuple(values.facts.row[i] for i in ids)
        when, *unless = (verdict(values.interval(p, rows)) for p in places)
        found[ids] = Truth.FALSE if Truth.TRUE in unless else when
        if early is not None and verdict(values.interval(early, rows)) is Truth.TRUE:
            found[ids] = Truth.TRUE
    return found


def _checked_rule(values: Evaluation, name: str, ids: tuple[int, ...]) -> Rule:
    """The rule of that name, if the objects are a binding of it."""
    rule = rule_named(values, name)
    if len(ids) != len(rule.variables):
        what = f"'{name}' is about {len(rule.variables)} object(s), not {len(ids)}"
        raise RuleError(what, expected=f"{name}({', '.join(rule.variables)})")
    for object_id in ids:
        if object_id not in values.facts.row:
            known = ", ".join(map(str, values.facts.ids)) or "none"
            raise RuleError(f"there is no object {object_id} in view", expected=f"one of {known}")
    if ids not in set(object_choices(values, rule)):
        raise RuleError(f"'{name}' is about distinct objects", expected="each object once")
    return rule
