"""Compiled rules, with everything derived from them once: value references, lookups, texts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from itertools import combinations
from typing import Any

import numpy as np

from visup.rules.formula.nodes import (
    Comparison,
    Formula,
    Predicate,
    Quantified,
    Rule,
    calls,
    children,
    placeholder,
)
from visup.rules.formula.rebuilding import substituted
from visup.rules.formula.terms import Measure, Term
from visup.rules.monitoring.compiler import Compiler, Program, Scope, ValueRef
from visup.rules.monitoring.early import EarlyCompiler
from visup.rules.monitoring.linker import LinkedProgram
from visup.rules.monitoring.states import States
from visup.rules.monitoring.vm import CHOICE_BITS, Ints, bits
from visup.rules.predicates.definitions import PredicateDefinition, QuantityDefinition
from visup.rules.predicates.snapshot import RELATION_NAMES, Snapshot
from visup.rules.predicates.vocabulary import RULES
from visup.rules.relations.reasoner import NAMES

AlarmKey = tuple[str, frozenset[int]]
"""Name of a rule, and objects."""
MAX_KEYS = 16
"""Most sets of objects with cached keys."""


@dataclass(frozen=True, slots=True)
class Lookup:
    """A fact or quantity looked up by rules.

    Attributes:
        step: The step of the lookup.
        name: Its word.
        evaluate: Its values for all objects.
        transposed: Whether its objects are in the opposite order of the axes.
        axes: Number of its objects.
    """

    step: int
    name: str
    evaluate: Callable[[Snapshot], Any]
    transposed: bool
    axes: int


def evaluator(node: Predicate | Measure) -> Callable[[Snapshot], Any]:
    """The evaluator of a fact or quantity, with its non-object arguments bound."""
    fact = isinstance(node, Predicate)
    word: PredicateDefinition | QuantityDefinition = (
        RULES.predicates if fact else RULES.quantities
    )[node.name]
    others = [w for w, t in zip(node.arguments, word.argument_kinds, strict=True) if t != "object"]
    return partial(_evaluate_with, word.evaluate, others) if others else word.evaluate


def _evaluate_with(evaluate: Callable[..., Any], others: list[str], facts: Snapshot) -> Any:
    return evaluate(facts, *others)


class AlarmKeys:
    """Cached alarm keys for a set of objects.

    Args:
        compiled: The rules.
        ids: The objects.
    """

    def __init__(self, compiled: CompiledRules, ids: tuple[int, ...]) -> None:
        self._compiled, self._ids = compiled, ids
        self._known: dict[int, AlarmKey] = {}
        # The result is nearly always the same as in the previous step.
        self._latest: tuple[list[int], Mapping[AlarmKey, int]] = ([], {})

    def of(self, hits: list[int]) -> Mapping[AlarmKey, int]:
        """The keys of the results of `vm.find_true`, each with its first binding."""
        latest, found = self._latest
        if latest != hits:
            found = self._of(hits)
            self._latest = hits, found
        return found

    def _of(self, hits: list[int]) -> Mapping[AlarmKey, int]:
        found: dict[AlarmKey, int] = {}
        for hit in hits:
            key = self._known.get(hit)
            if key is None:
                rule, chosen = self._compiled.decode_hit(hit, self._ids)
                key = self._known.setdefault(hit, (rule.name, frozenset(chosen)))
            found.setdefault(key, hit)
        return found


@dataclass(frozen=True, eq=False)
class CompiledRules:
    """Compiled rules.

    Attributes:
        rules: The rules.
        compiler: Knows the value reference of every formula.
        condition_refs: Per rule: `when`, and `unless` if present.
        early_refs: Per rule: reference to its early verdict; None if its verdict is not late, or early
            verdicts are off.
        lines: Cache of `explain` for the texts of evidence, by rule and names of objects.
    """

    rules: tuple[Rule, ...]
    compiler: Compiler
    condition_refs: tuple[tuple[ValueRef, ...], ...]
    early_refs: tuple[ValueRef | None, ...] = ()
    _value_refs: dict[Scope, dict[int, ValueRef]] = field(default_factory=dict, repr=False)
    _related: dict[int, tuple[Predicate, ...]] = field(default_factory=dict, repr=False)
    _evidence: dict[int, tuple[Formula, ...]] = field(default_factory=dict, repr=False)
    _texts: dict[tuple[str, ...], dict[int, str]] = field(default_factory=dict, repr=False)
    _layouts: dict[int, LinkedProgram] = field(default_factory=dict, repr=False)
    _verdicts: dict[int, tuple[Ints, int]] = field(default_factory=dict, repr=False)
    lines: dict[tuple[str, tuple[str, ...]], tuple[Any, ...]] = field(
        default_factory=dict, repr=False
    )
    _keys: dict[tuple[int, ...], AlarmKeys] = field(default_factory=dict, repr=False)

    @property
    def program(self) -> Program:
        """All steps of all rules."""
        return self.compiler.program

    def value_ref(self, node: Formula | Term, scope: Scope) -> ValueRef:
        """The value reference of a part of these rules."""
        known = self._value_refs.setdefault(scope, {})
        if id(node) not in known:
            known[id(node)] = (
                self.compiler.term(node, scope)
                if isinstance(node, Term)
                else self.compiler.formula(node, scope)
            )
        return known[id(node)]

    def related(self, rule: Rule) -> tuple[Predicate, ...]:
        """The relations between its objects in a rule's `when`."""
        if id(rule) not in self._related:
            self._related[id(rule)] = tuple(
                call
                for call in calls(rule.when)
                if isinstance(call, Predicate) and call.name in RELATION_NAMES
                if set(call.arguments) <= set(rule.variables)
            )
        return self._related[id(rule)]

    def evidence_parts(self, rule: Rule) -> tuple[Formula, ...]:
        """The facts, comparisons and quantifiers in a rule's `when`, which make up its evidence.

        Those inside a quantifier are covered by the quantifier.
        """
        if id(rule) not in self._evidence:
            self._evidence[id(rule)] = tuple(_evidence(rule.when))
        return self._evidence[id(rule)]

    def text(self, node: Formula | Term, variables: tuple[str, ...]) -> str:
        """The source of a part of these rules, with placeholders for its variables."""
        known = self._texts.setdefault(variables, {})
        if id(node) not in known:
            known[id(node)] = str(substituted(node, {v: placeholder(v) for v in variables}))
        return known[id(node)]

    @cached_property
    def relations(self) -> Mapping[str, int]:
        """The relations used by the rules, with their positions."""
        # Couplings have a separate lookup: there are few, but a `coupled` relation for every pair.
        named = {n.name for _, n in self.program.lookups() if n.name in NAMES}
        return {name: k for k, name in enumerate(sorted(named))}

    @cached_property
    def facts(self) -> tuple[Lookup, ...]:
        """Lookups of facts, without these relations."""
        return tuple(self._lookups(Predicate))

    @cached_property
    def quantities(self) -> tuple[Lookup, ...]:
        """Lookups of quantities."""
        return tuple(self._lookups(Measure))

    def _lookups(self, kind: type) -> Iterator[Lookup]:
        for number, node in self.program.lookups():
            if isinstance(node, kind) and node.name not in self.relations:
                order = self.program.steps[number].order
                turned = len(order) == 2 and order[0] > order[1]
                yield Lookup(number, node.name, evaluator(node), turned, len(order))

    def layout(self, n: int) -> LinkedProgram:
        """The program laid out for a number of objects; relations come before all other facts."""
        if n not in self._layouts:
            position, positions = len(self.relations) * n * n, {}
            for lookup in self.facts:
                positions[lookup.step] = position
                position += n**lookup.axes
            for step, node in self.program.lookups():
                if node.name in self.relations:
                    positions[step] = self.relations[node.name] * n * n
            self._layouts[n] = LinkedProgram(self.program, n, positions, position)
        return self._layouts[n]

    @cached_property
    def rules_by_name(self) -> Mapping[str, Rule]:
        """The rules by name."""
        return {rule.name: rule for rule in self.rules}

    @cached_property
    def _search_order(self) -> tuple[tuple[Rule, tuple[ValueRef, ...]], ...]:
        """Rules to search for true bindings: first all final verdicts, then the early ones."""
        early = (
            (r, (at,)) for r, at in zip(self.rules, self.early_refs, strict=True) if at is not None
        )
        return (*zip(self.rules, self.condition_refs, strict=True), *early)

    def decode_hit(self, hit: int, ids: tuple[int, ...]) -> tuple[Rule, tuple[int, ...]]:
        """Decode a result of `vm.find_true`: its rule and objects."""
        rule, rows = self._search_order[hit >> CHOICE_BITS][0], hit & (1 << CHOICE_BITS) - 1
        chosen = []
        for _ in rule.variables:
            rows, row = divmod(rows, len(ids))
            chosen.append(ids[row])
        return rule, tuple(chosen[::-1])

    def alarm_keys(self, ids: tuple[int, ...]) -> AlarmKeys:
        """The cached alarm keys for some objects."""
        known = self._keys.get(ids)
        if known is None:
            if len(self._keys) >= MAX_KEYS:
                self._keys.clear()
            known = self._keys.setdefault(ids, AlarmKeys(self, ids))
        return known

    def initial_states(self, n: int) -> States:
        """The states before the first sample."""
        return self.layout(n).fresh

    def search_table(self, n: int) -> tuple[Ints, int]:
        """The table of `vm.find_true` for a number of objects, and the most results.

        See `vm.find_true`.
        """
        if n not in self._verdicts:
            layout, rows = self.layout(n), []
            for rule, places in self._search_order:
                at = [(layout.places[p.step], bits(p.axes)) for p in places]
                when, unless = (*at, (-1, 0))[:2]
                apart = sum(1 << i + j - 1 for i, j in _apart(rule))
                rows.append((*when, *unless, len(rule.variables), apart))
            most = sum(n ** len(rule.variables) for rule, _ in self._search_order)
            self._verdicts[n] = np.array(rows, dtype=np.int64).reshape(-1, 6), most
        return self._verdicts[n]


def _evidence(formula: Formula) -> Iterator[Formula]:
    if isinstance(formula, Predicate | Quantified | Comparison):
        yield formula
        return
    for part in children(formula):
        if not isinstance(part, Term):
            yield from _evidence(part)


def _apart(rule: Rule) -> Iterator[tuple[int, int]]:
    once = [i for i, v in enumerate(rule.variables) if v not in rule.may_repeat]
    return combinations(once, 2)


@lru_cache(maxsize=16)
def compile_rules(rules: tuple[Rule, ...], early: bool = False) -> CompiledRules:
    """Compile rules; the same object for the same rules.

    Args:
        rules: The rules.
        early: Whether verdicts about the future are reported as soon as they are decided.
    """
    compiler = Compiler()
    places = tuple(compiler.rule(rule) for rule in rules)
    sooner = EarlyCompiler(compiler)
    found = [sooner.rule(rule) if early else None for rule in rules]
    return CompiledRules(rules, compiler, places, tuple(f.first if f else None for f in found))
