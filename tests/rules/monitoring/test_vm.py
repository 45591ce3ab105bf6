"""All choices of objects at once: the same as each by itself, its quantifiers written out."""

from dataclasses import replace
from itertools import product
from random import Random
from typing import Any

import numpy as np
import pytest

from tests.oracles.reasoning.rules import alike
from tests.oracles.rule_formulas import random_times
from visup.rules.formula.nodes import (
    And,
    Comparison,
    Formula,
    Not,
    Or,
    PastOperator,
    Predicate,
    Quantified,
    Since,
    TimeWindow,
)
from visup.rules.formula.terms import (
    Arithmetic,
    Measure,
    Negative,
    PointwiseFunction,
    Term,
    WindowFunction,
)
from visup.rules.formula.units import Number, Unit, ticks
from visup.rules.monitoring.compiler import Compiler
from visup.rules.monitoring.intervals import FALSE, TRUE, UNKNOWN, Interval
from visup.rules.monitoring.monitor import Monitor
from visup.rules.safety.compiled_rules import CompiledRules

FACTS = {"healthy": 0, "seen": 1, "moving": 1, "touching": 2, "north_of": 2}
QUANTITIES = {"speed": 1, "in_view": 1, "gap": 2, "closing_speed": 2}
Objects = dict[str, int]
Sample = dict[tuple[str, tuple[int, ...]], Interval]
"""(word, objects) -> what is known of it."""


def words_for(rng: Random, count: int, scope: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(rng.sample(scope, count))


def term(rng: Random, scope: tuple[str, ...], depth: int) -> Term:
    pick = rng.randrange(7) if depth else 0
    if pick < 2:
        usable = [q for q, count in QUANTITIES.items() if count <= len(scope)]
        name = rng.choice(usable)
        return Measure(name, words_for(rng, QUANTITIES[name], scope))
    part = term(rng, scope, depth - 1)
    match pick:
        case 2:
            return Negative(part)
        case 3:
            return PointwiseFunction(
                rng.choice(("min", "max")), (part, term(rng, scope, depth - 1))
            )
        case 4:
            return PointwiseFunction("abs", (part,))
        case 5:
            return WindowFunction(
                rng.choice(("rate", "before", "lowest", "last")), part, seconds(rng)
            )
    return Arithmetic(part, rng.choice("+-*/"), term(rng, scope, depth - 1))


def seconds(rng: Random) -> Number:
    return Number(rng.choice((40.0, 100.0, 300.0, 700.0)), Unit.MS)


def formula(rng: Random, scope: tuple[str, ...], depth: int) -> Formula:
    pick = rng.randrange(8) if depth else rng.randrange(2)
    if pick == 0:
        usable = [f for f, count in FACTS.items() if count <= len(scope)]
        name = rng.choice(usable)
        return Predicate(name, words_for(rng, FACTS[name], scope))
    if pick == 1:
        other: Term = Number(rng.choice((-1.0, 0.5, 2.0)), Unit.NONE)
        leave = Number(other.value - 0.5, Unit.NONE) if rng.random() < 0.3 else None  # type: ignore[union-attr]
        if leave is None and rng.random() < 0.5:
            other = term(rng, scope, 1)
        operator = ">" if leave else rng.choice(("<", "<=", ">", ">="))
        return Comparison(term(rng, scope, 1), operator, other, leave)
    if pick == 2 and len(scope) < 3:
        inner = formula(rng, (*scope, f"v{len(scope)}"), depth - 1)
        kind = rng.choice(("exists", "forall"))
        return Quantified(kind, f"v{len(scope)}", inner, rng.random() < 0.4)
    part = formula(rng, scope, depth - 1)
    window = TimeWindow(Number(0.0, Unit.S), seconds(rng)) if rng.random() < 0.7 else None
    match pick:
        case 3:
            return Not(part)
        case 4 | 5:
            return PastOperator(rng.choice(("always", "once")), part, window)
        case 6:
            return Since(part, formula(rng, scope, depth - 1), window)
    join = rng.choice((And, Or))
    return join((part, formula(rng, scope, depth - 1)))


def written_out(f: Any, where: Objects, repeats: frozenset[str], ids: tuple[int, ...]) -> Any:
    """The formula for one choice of objects: each word of these is a signal of its own."""

    def inner(part: Any) -> Any:
        return written_out(part, where, repeats, ids)

    match f:
        case Predicate(name=name, arguments=words):
            return Comparison(signal(name, words, where), ">", Number(0.0, Unit.NONE))
        case Measure(name=name, arguments=words):
            return signal(name, words, where)
        case Quantified(kind=kind, variable=variable, part=part, may_repeat=may_repeat):
            taken = () if may_repeat else {i for v, i in where.items() if v not in repeats}
            parts = tuple(
                written_out(
                    part,
                    {**where, variable: i},
                    repeats | {variable} if may_repeat else repeats,
                    ids,
                )
                for i in ids
                if i not in taken
            )
            nobody = Comparison(Measure("nobody_" + kind), ">", Number(0.0, Unit.NONE))
            join = Or if kind == "exists" else And
            return join((nobody, *parts))
        case Number():
            return f
        case And(parts=parts) | Or(parts=parts):
            return type(f)(tuple(map(inner, parts)))
        case PointwiseFunction(name=name, parts=parts):
            return PointwiseFunction(name, tuple(map(inner, parts)))
        case Since(left=left, right=right) | Arithmetic(left=left, right=right):
            return replace(f, left=inner(left), right=inner(right))
        case Comparison(left=left, right=right):
            return replace(f, left=inner(left), right=inner(right))
    return replace(f, part=inner(f.part))


def signal(name: str, words: tuple[str, ...], where: Objects) -> Measure:
    return Measure("_".join([name, *(str(where[w]) for w in words)]))


def drawn(rng: Random, ids: tuple[int, ...]) -> Sample:
    sample: Sample = {}
    for name, count in {**FACTS, **QUANTITIES}.items():
        for objects in product(ids, repeat=count):
            if name in FACTS:
                sample[name, objects] = rng.choice((TRUE, FALSE, UNKNOWN))
            else:
                low, high = sorted((rng.randint(-4, 8) / 2, rng.randint(-4, 8) / 2))
                sample[name, objects] = rng.choice(((low, low), (low, high), UNKNOWN))
    return sample


def laid(prepared: CompiledRules, ids: tuple[int, ...], sample: Sample) -> tuple[Any, Any]:
    """Codes and intervals as a step looks them up."""
    layout, n = prepared.layout(len(ids)), len(ids)
    codes, arena = np.zeros(layout.codes, np.int8), np.full(layout.size, np.nan)
    for step, node in layout.program.lookups():
        count = len(layout.program.steps[step].order)
        values = [sample[node.name, objects] for objects in product(ids, repeat=count)]
        order = layout.program.steps[step].order
        table = np.array(values).reshape(*(n,) * count, 2)
        if isinstance(node, Predicate):
            at = layout.facts[step]
            low, high = table[..., 0].ravel(), table[..., 1].ravel()
            codes[at : at + n**count] = (low > 0).astype(np.int8) - (high < 0)
        else:
            turned = count == 2 and order[0] > order[1]
            table = table.swapaxes(0, 1) if turned else table
            at = layout.places[step]
            arena[at : at + 2 * n**count] = np.moveaxis(table, -1, 0).ravel()
    return codes, arena


@pytest.mark.parametrize("block", range(4))
def test_each_choice_of_objects_is_what_it_is_by_itself(block: int) -> None:
    for seed in range(60 * block, 60 * block + 60):
        rng = Random(f"choices {seed}")
        variables, ids = ("v0", "v1")[: rng.randint(1, 2)], tuple(range(1, rng.randint(1, 3) + 1))
        repeats = frozenset(v for v in variables if rng.random() < 0.3)
        f = formula(rng, variables, rng.randint(1, 3))
        compiler = Compiler()
        place = compiler.formula(f, tuple((v, v in repeats) for v in variables))
        prepared = CompiledRules((), compiler, ())
        layout = prepared.layout(len(ids))
        choices = list(product(ids, repeat=len(variables)))
        alone = {
            c: Monitor(written_out(f, dict(zip(variables, c, strict=True)), repeats, ids))
            for c in choices
        }
        states = layout.fresh
        for time in random_times(rng, 10):
            sample = drawn(rng, ids)
            codes, arena = laid(prepared, ids, sample)
            states = layout.step(states, ticks(time), codes, arena)
            signals = {"_".join([n, *map(str, objects)]): v for (n, objects), v in sample.items()}
            signals |= {"nobody_exists": FALSE, "nobody_forall": TRUE}
            for c, monitor in alone.items():
                rows = tuple(ids.index(i) for i in c)
                found = layout.interval(place.step, rows, arena)
                assert alike(found, monitor.step(time, signals)), f"{seed}: {f} of {c}"
