"""Rules made ready to run, and what is read off them once: places, facts, texts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from itertools import combinations
from typing import Any

from visup.rules.bounds import variables_of
from visup.rules.facts import RELATION_NAMES, Facts
from visup.rules.formula import (
    Comparison,
    Formula,
    Predicate,
    Quantified,
    Rule,
    calls,
    children,
    mark,
    named,
)
from visup.rules.intervals import Arrays
from visup.rules.program import Compiler, Place, Program, Scope
from visup.rules.terms import Measure, Term
from visup.rules.vocabulary import RULES, Quantity, Word

FactKey = tuple[int, tuple[int, ...]]
"""By which a step finds a fact: its node, and the axes of its objects."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A fact that rules look up.

    Attributes:
        key: By which a step finds it.
        codes: Of all objects.
        axes: Axes of its objects.
        name: Its word.
    """

    key: FactKey
    codes: Callable[[Facts], Any]
    axes: tuple[int, ...]
    name: str


def asked(node: Predicate | Measure) -> Callable[[Facts], Any]:
    """What a fact or quantity looks at, with those of its arguments that are no objects."""
    fact = isinstance(node, Predicate)
    word: Word | Quantity = (RULES.words if fact else RULES.quantities)[node.name]
    others = [w for w, t in zip(node.words, word.takes, strict=True) if t != "object"]
    return partial(_look, word.look, others) if others else word.look


def _look(look: Callable[..., Any], others: list[str], facts: Facts) -> Any:
    return look(facts, *others)


@dataclass(frozen=True, eq=False)
class Ruled:
    """Rules made ready to run.

    Attributes:
        rules: The rules.
        compiler: Knows where the value of every formula is found.
        places: Of each rule: `when`, and `unless` if there is one.
    """

    rules: tuple[Rule, ...]
    compiler: Compiler
    places: tuple[tuple[Place, ...], ...]
    _placed: dict[Scope, dict[int, Place]] = field(default_factory=dict, repr=False)
    _related: dict[int, tuple[Predicate, ...]] = field(default_factory=dict, repr=False)
    _told: dict[int, tuple[Formula, ...]] = field(default_factory=dict, repr=False)
    _texts: dict[tuple[str, ...], dict[int, str]] = field(default_factory=dict, repr=False)

    @property
    def program(self) -> Program:
        """All steps of all rules."""
        return self.compiler.program

    def place(self, node: Formula | Term, scope: Scope) -> Place:
        """Where the value of a part of these rules is found."""
        known = self._placed.setdefault(scope, {})
        if id(node) not in known:
            known[id(node)] = (
                self.compiler.term(node, scope)
                if isinstance(node, Term)
                else self.compiler.formula(node, scope)
            )
        return known[id(node)]

    def related(self, rule: Rule) -> tuple[Predicate, ...]:
        """The relations between its objects that the `when` of one of these rules names."""
        if id(rule) not in self._related:
            self._related[id(rule)] = tuple(
                call
                for call in calls(rule.when)
                if isinstance(call, Predicate) and call.name in RELATION_NAMES
                if set(call.words) <= set(rule.variables)
            )
        return self._related[id(rule)]

    def told(self, rule: Rule) -> tuple[Formula, ...]:
        """The facts, comparisons and quantifiers that the `when` of one of these rules is made of.

        Those under a quantifier are told by the quantifier.
        """
        if id(rule) not in self._told:
            self._told[id(rule)] = tuple(_told(rule.when))
        return self._told[id(rule)]

    def text(self, node: Formula | Term, variables: tuple[str, ...]) -> str:
        """The source of a part of these rules, with marks where its variables stand."""
        known = self._texts.setdefault(variables, {})
        if id(node) not in known:
            known[id(node)] = str(named(node, {v: mark(v) for v in variables}))
        return known[id(node)]

    @cached_property
    def relations(self) -> tuple[str, ...]:
        """Relations that the rules name."""
        named = {n.name for n, _ in self.program.looks if n.name in RELATION_NAMES}
        return tuple(sorted(named))

    @cached_property
    def verdicts(self) -> tuple[tuple[Rule, tuple[Place, ...], tuple[tuple[int, int], ...]], ...]:
        """Each rule with its places, and the pairs of its variables that must not be one object."""
        return tuple(
            (rule, places, tuple(_apart(rule)))
            for rule, places in zip(self.rules, self.places, strict=True)
        )

    @cached_property
    def facts(self) -> tuple[Fact, ...]:
        """What the rules look up that is true, false or unknown."""
        looks = ((node, axes) for node, axes in self.program.looks if isinstance(node, Predicate))
        return tuple(Fact((id(node), axes), asked(node), axes, node.name) for node, axes in looks)


def _told(formula: Formula) -> Iterator[Formula]:
    if isinstance(formula, Predicate | Quantified | Comparison):
        yield formula
        return
    for part in children(formula):
        if not isinstance(part, Term):
            yield from _told(part)


def _apart(rule: Rule) -> Iterator[tuple[int, int]]:
    once = [i for i, v in enumerate(rule.variables) if v not in rule.may_repeat]
    return combinations(once, 2)


@lru_cache(maxsize=16)
def ruled(rules: tuple[Rule, ...]) -> Ruled:
    """Rules made ready to run; the same object for the same rules."""
    compiler = Compiler(Arrays(max(map(variables_of, rules), default=0)))
    return Ruled(rules, compiler, tuple(compiler.rule(rule) for rule in rules))


def scope_of(rule: Rule) -> Scope:
    """The variables of a rule by axis."""
    return tuple((v, v in rule.may_repeat) for v in rule.variables)
