"""Rules over a mind: all of them, for all choices of objects, in one run of one program."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from visup.rules.inputs import blind
from visup.rules.intervals import Arrays, Box
from visup.rules.operators import Pick
from visup.rules.program import Compiler, Moment, Place, Program, Scope
from visup.rules.terms import Measure, Term
from visup.rules.vocabulary import RULES, Quantity, Word

TRUTHS = np.array([[-np.inf, -np.inf, np.inf], [-np.inf, np.inf, np.inf]])
"""Intervals of what is false, unknown, true; by code + 1."""
States = tuple[Any, ...]
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


def _asked(node: Predicate | Measure) -> Callable[[Facts], Any]:
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
        return tuple(Fact((id(node), axes), _asked(node), axes, node.name) for node, axes in looks)


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


class Values:
    """The values of all formulas at one step.

    Args:
        prepared: The rules.
        facts: The mind.
        now: Microseconds.
        before: States of the operators before, for the objects of `facts`.
        known: Values of another step, such as the last one. What is the same now as it was there
            is not worked out again, whichever step it is.

    Attributes:
        after: States after.
    """

    def __init__(
        self, prepared: Ruled, facts: Facts, now: int, before: States, known: Values | None = None
    ) -> None:
        if known is not None and (known.prepared, known.facts.ids) != (prepared, facts.ids):
            known = None
        self.prepared = prepared
        self.facts = facts
        self.axes = prepared.compiler.algebra.axes
        self._same: dict[tuple[int, int], NDArray[np.bool_]] = {}
        self._shapes: dict[tuple[int, ...], tuple[int, ...]] = {}
        self._codes: dict[FactKey, bytes | None] = {}
        self._before: Mapping[FactKey, Box] = known._found if known else {}
        self._found = self._truths(known)
        moment = Moment(now, before, self._look, self._same_object)
        self._values: list[Box] = prepared.program.step(moment, known._values if known else None)
        self._true = self._judged(known)
        self._before = {}  # values of one step do not keep those of all steps before alive
        self.after: States = tuple(moment.after)

    def _truths(self, known: Values | None) -> dict[FactKey, Box]:
        """All facts; there are dozens of them, of which few change in a step."""
        facts = self.facts
        facts.relate(self.prepared.relations)
        found = {}
        for fact in self.prepared.facts:
            codes = fact.codes(facts)
            told = None if blind(facts.mind, fact.name) else codes.tobytes()
            self._codes[fact.key] = told
            if known is not None and known._codes[fact.key] == told:
                found[fact.key] = known._found[fact.key]
                continue
            value = TRUTHS.take(codes + 1, axis=1)
            found[fact.key] = self._laid(
                _nothing_known(value) if told is None else value, fact.axes
            )
        return found

    def _look(self, node: Predicate | Measure, axes: tuple[int, ...]) -> Box:
        """A fact or quantity of all objects, laid along its axes."""
        found = self._found.get((id(node), axes))
        if found is not None:
            return found
        value: Box = _asked(node)(self.facts)
        value = self._laid(
            _nothing_known(value) if blind(self.facts.mind, node.name) else value, axes
        )
        before = self._before.get((id(node), axes))
        if before is not None and value.tobytes() == before.tobytes():
            value = before  # what follows from it need not be worked out again
        self._found[id(node), axes] = value
        return value

    def _laid(self, value: Box, axes: tuple[int, ...]) -> Box:
        """(2, ...) values of one or two objects along the axes of these."""
        n = len(self.facts.ids)
        if len(axes) == 2 and axes[0] > axes[1]:
            value = value.reshape(2, n, n).swapaxes(1, 2)
        shape = self._shapes.get(axes)
        if shape is None:
            shape = (2, *(n if axis in axes else 1 for axis in range(self.axes)))
            self._shapes[axes] = shape
        return value.reshape(shape)

    def _same_object(self, one: int, other: int) -> NDArray[np.bool_]:
        """Whether two axes stand for one object."""
        key = (min(one, other), max(one, other))
        if key not in self._same:
            n = len(self.facts.ids)
            shape = [n if axis in key else 1 for axis in range(self.axes)]
            same = np.ones(n, bool) if one == other else np.eye(n, dtype=bool)
            self._same[key] = same.reshape(shape)
        return self._same[key]

    def at(self, place: Place) -> Box:
        """(2, ...) the interval of a formula for all choices of objects."""
        return self._values[place.step]

    def true(self) -> Iterator[tuple[Rule, tuple[int, ...]]]:
        """Every rule with every choice of objects for which it is true and not suspended."""
        for (rule, _, _), chosen in zip(self.prepared.verdicts, self._true, strict=True):
            for ids in chosen:
                yield rule, ids

    def _judged(self, known: Values | None) -> list[tuple[tuple[int, ...], ...]]:
        """For each rule the choices of objects for which it is true and not suspended."""
        values, found = self._values, []
        for k, (rule, places, apart) in enumerate(self.prepared.verdicts):
            if known is not None and all(values[p.step] is known._values[p.step] for p in places):
                found.append(known._true[k])
                continue
            holds = values[places[0].step][0] > 0
            if len(places) > 1:
                holds = holds & ~(values[places[1].step][0] > 0)
            found.append(tuple(self._choices(rule, holds, apart)) if holds.any() else ())
        return found

    def _choices(
        self, rule: Rule, holds: NDArray[np.bool_], apart: tuple[tuple[int, int], ...]
    ) -> Iterator[tuple[int, ...]]:
        count, ids = len(rule.variables), self.facts.ids
        if not count:
            yield ()
            return
        shape = (len(ids),) * count + (1,) * (self.axes - count)
        if holds.shape != shape:
            holds = np.broadcast_to(holds, shape)
        for rows in zip(*(axis.tolist() for axis in holds.nonzero()[:count]), strict=True):
            if all(rows[i] != rows[j] for i, j in apart):
                yield tuple([ids[row] for row in rows])


def _nothing_known(value: Box) -> Box:
    return np.stack([np.full(value.shape[1:], -np.inf), np.full(value.shape[1:], np.inf)])


def rerowed(
    prepared: Ruled, states: States, now: int, old: tuple[int, ...], new: tuple[int, ...]
) -> States:
    """The states of the operators for other objects.

    Args:
        prepared: The rules.
        states: States for the old objects.
        now: Microseconds of the sample at which they change.
        old: Their ids.
        new: Ids of the new ones; of those that are not among the old nothing is known yet.

    Returns:
        The states for the new objects.
    """
    place = {object_id: i for i, object_id in enumerate(old)}
    rows = np.array([place.get(i, -1) for i in new], dtype=np.intp)
    return tuple(
        state
        if state is None or not axes
        else operator.rows(state, now, _picker(axes, rows, len(old)))
        for state, (operator, axes) in zip(states, prepared.program.operators, strict=True)
    )


def _picker(axes: frozenset[int], rows: NDArray[np.intp], count: int) -> Pick:
    """Takes rows along every axis of an array that runs over objects."""
    fresh = rows < 0

    def pick(array: Any, fill: Any, lead: int = 1) -> Any:
        fill = np.reshape(fill, (2,) + (1,) * (array.ndim - 1)) if lead else fill
        for axis in axes:
            along = lead + axis
            if array.shape[along] != count:
                # One value for all objects so far, which need not be that of new ones.
                array = array.repeat(count, axis=along)
            if count:
                array = array.take(np.maximum(rows, 0), axis=along)
            else:
                shape = [*array.shape[:along], len(rows), *array.shape[along + 1 :]]
                array = np.empty(shape, array.dtype)
            at = (slice(None),) * along + (fresh,)
            array[at] = np.broadcast_to(fill, array.shape)[at]
        return array

    return pick
