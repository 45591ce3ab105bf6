"""Checks of names and amounts: actors, zones, parameters and units of the right kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AnySet
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from math import isinf

from visup.agent.model.did_you_mean import did_you_mean
from visup.rules.formula.nodes import SIGNAL_WORDS, Comparison
from visup.rules.formula.units import UNITS_MEANT, Number, Span, Unit
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.actions.describe import written
from visup.tasks.actions.floor import floor_map
from visup.tasks.diagnostics.recovery import ParsedFile
from visup.tasks.grammar.conditions import (
    Amount,
    Condition,
    Name,
    ParameterRef,
    action_of,
    bounds_of,
    durations_of,
    facts_of,
    is_periodic,
)
from visup.tasks.grammar.criteria import Extent
from visup.tasks.grammar.nodes import (
    Actor,
    Actors,
    Clause,
    Conditioned,
    Course,
    Delay,
    Parameter,
    Task,
    Timed,
    ZoneDeclaration,
    walk,
)
from visup.tasks.grammar.structure import spare_kinds, task_actors
from visup.tasks.grammar.units import LENGTH, SIZE, TIME, UNITS, dimension, units_of, value

Declared = Actor | ZoneDeclaration | Parameter
ActionUse = tuple[str, tuple[Name, ...], Span]
"""An action of a file, its actors, and its position."""


@dataclass(frozen=True)
class NameCheck:
    """Checks the names and amounts of a task.

    Attributes:
        parsed: The tree, and information about statements that did not parse.
        source: For positions.
        actions: The available actions.
        percepts: The available kinds of percept.
        uses: Every action of the file.
    """

    parsed: ParsedFile
    source: Source
    actions: Mapping[str, ActionDefinition]
    percepts: AnySet[str]
    uses: list[ActionUse]

    @cached_property
    def task(self) -> Task:
        """The parsed tree."""
        return self.parsed.task

    @cached_property
    def courses(self) -> list[Course]:
        """Every course of every stage."""
        bodies = (s.body for s in self.task.stages)
        return [c for body in bodies if not isinstance(body, Actors) for c in walk(body)]

    @cached_property
    def comparisons(self) -> list[Comparison]:
        """Every comparison of the file."""
        found = [c for c in self.courses if isinstance(c, Comparison)]
        facts = (f for c in self.conditions for f in facts_of(c))
        return found + [f for f in facts if isinstance(f, Comparison)]

    @cached_property
    def conditions(self) -> list[Condition]:
        """Every condition of the file, of stages and of invariants."""
        signs = (s for c in self.courses if isinstance(c, Conditioned) for s in c.conditions)
        return [s.condition for s in signs] + [i.condition for i in self.task.invariants]

    def faults(self) -> Iterator[Diagnostic]:
        """All faults of names and amounts."""
        yield from self.amounts()
        yield from self.comparison_faults()
        yield from self.ranges()
        yield from self.grounds()
        yield from self.kinds()
        yield from self.duplicate_declarations()
        yield from self.unused()
        yield from self.unobserved()
        yield from self.outside_loop()

    def used_amounts(self) -> Iterator[tuple[Amount, str]]:
        """Every used amount with its expected dimension; empty if unknown."""
        for course in self.courses:
            if isinstance(course, Timed):
                yield from ((a, TIME) for c in course.clauses for a in _durations(c))
            if isinstance(course, Conditioned):
                yield from ((s.lasting.duration, TIME) for s in course.conditions if s.lasting)
        yield from ((i.lasting.duration, TIME) for i in self.task.invariants if i.lasting)
        yield from ((d, TIME) for c in self.conditions for d in durations_of(c))
        yield from ((a.size, SIZE) for a in self.task.actors if a.size)
        criteria = (c for a in (*self.task.actors, *self.task.bystanders) for c in a.criteria)
        yield from ((c.amount, LENGTH) for c in criteria if isinstance(c, Extent))
        for comparison in self.comparisons:
            meaning = self.actions.get(action_of(comparison).name)
            wanted = TIME if is_periodic(comparison) else meaning.measures if meaning else ""
            for amount in bounds_of(comparison):
                on_floor = action_of(comparison).name == "gap" and self.measured(amount) == SIZE
                of_signal = wanted != TIME and action_of(comparison).name in SIGNAL_WORDS
                yield amount, SIZE if on_floor else ANY_DIMENSION if of_signal else wanted

    def measured(self, amount: Amount) -> str:
        """The dimension of an amount, or of its parameter."""
        return dimension(self.task.amount(amount))

    def amounts(self) -> Iterator[Diagnostic]:
        """Amounts that are zero, of a wrong dimension, in unknown units, or of unknown parameters."""
        for parameter in self.task.parameters:
            if isinstance(parameter.amount, ParameterRef):
                what = f"parameter `{parameter.name}` is not given a number"
                expected = "a number and a unit, such as `90 s`"
                yield self.source.fault("E132", what, parameter.amount.span, expected)
            else:
                yield from self.amount(parameter.amount, "")
        known = {p.name: p.amount for p in self.task.parameters}
        for amount, wanted in self.used_amounts():
            if isinstance(amount, Number):
                yield from self.amount(amount, wanted)
            elif amount.name not in known:
                if not self.parsed.lacking and amount.name not in self.parsed.defined:
                    hint = (
                        did_you_mean(amount.name, known, "`{}`")
                        if len(known) < MAX_COMPARED
                        else None
                    )
                    what = f"parameter `{amount}` is not declared"
                    expected = f"`parameter {amount} is 90 s`"
                    yield self.source.fault("E223", what, amount.span, expected, hint)
            else:
                yield from self.dimension_faults(self.task.amount(amount), wanted, amount)

    def amount(self, amount: Number, wanted: str) -> Iterator[Diagnostic]:
        """Faults of one amount that is not a parameter."""
        if wanted == ANY_DIMENSION and amount.unit == Unit.NONE:
            return
        if wanted == ANY_DIMENSION:
            what = f"the numbers of signals have no unit, unlike `{amount}`"
            if amount.unit == Unit.PERCENT:
                what = f"the numbers of signals have no unit, and `{amount}` is {value(amount):g}"
            change = f"write `{amount.value:g}`"
            yield self.source.fault("E226", what, amount.span, "a plain number", change)
            return
        if amount.unit not in UNITS:
            known_unit = UNITS_MEANT.get(amount.unit.casefold())
            hint = f"did you mean `{known_unit}`?" if known_unit else None
            if wanted == TIME and amount.unit == "m":
                hint = "did you mean `min`?"
            what = f"`{amount.unit}` is not a unit{' of time' if wanted == TIME else ''}"
            expected = units_of(wanted) if wanted in _MEASURED else ", ".join(UNITS)
            yield self.source.fault("E218", what, amount.span, expected, hint)
        elif isinf(amount.value):
            yield self.source.fault(
                "E217", "the number is too large", amount.span, "a smaller number"
            )
        elif amount.value <= 0 and wanted == TIME:
            yield self.source.fault("E217", f"`{amount}` is not a positive duration", amount.span)
        elif amount.value <= 0 and wanted == SIZE:
            yield self.source.fault("E217", f"`{amount}` is not a positive size", amount.span)
        else:
            yield from self.dimension_faults(amount, wanted, amount)

    def dimension_faults(self, amount: Number, wanted: str, used: Amount) -> Iterator[Diagnostic]:
        """A fault if an amount has a wrong dimension for its use."""
        measured = dimension(amount)
        if wanted in _MEASURED and measured and measured != wanted:
            noun = _with_article(DIMENSION_WORDS.get(wanted, wanted))
            what = f"`{used}` is not {noun}"
            if isinstance(used, ParameterRef):
                what = f"parameter `{used}` is `{amount}`, which is not {noun}"
            hint = "did you mean `min`?" if (wanted, amount.unit) == (TIME, "m") else None
            yield self.source.fault("E226", what, used.span, units_of(wanted), hint)

    def comparison_faults(self) -> Iterator[Diagnostic]:
        """Quantities without comparison, comparisons without quantity."""
        compared = {id(action_of(c).span) for c in self.comparisons if not is_periodic(c)}
        for name, _, span in self.uses:
            meaning = self.actions.get(name)
            if meaning is None:
                continue
            if meaning.measures and id(span) not in compared:
                what = f"`{name}` is a quantity and is not compared with anything"
                yield self.source.fault("E227", what, span, f"such as `{written(meaning)}`")
            elif not meaning.measures and id(span) in compared:
                what = f"`{name}` is not a quantity, so it cannot be compared"
                quantities = sorted(m.name for m in self.actions.values() if m.measures)
                yield self.source.fault("E228", what, span, f"a quantity: {', '.join(quantities)}")

    def ranges(self) -> Iterator[Diagnostic]:
        """Empty ranges."""
        for comparison in self.comparisons:
            ends = [self.task.amount(a) for a in bounds_of(comparison)]
            same_dimension = len({dimension(e) for e in ends} - {""}) == 1
            if len(ends) == 2 and same_dimension and value(ends[0]) >= value(ends[1]):
                what = f"nothing lies between {ends[0]} and {ends[1]}"
                expected = "the lesser amount first, then a greater one"
                yield self.source.fault("E238", what, comparison.span, expected)

    def kinds(self) -> Iterator[Diagnostic]:
        """Zones in place of actors, and vice versa."""
        zones = {z.name for z in self.task.zones}
        for name, actors, _ in self.uses:
            meaning = self.actions.get(name)
            if meaning is None or len(actors) != meaning.arity:
                continue
            for actor, kind in zip(actors, meaning.kinds, strict=True):
                actor_name = str(actor)
                known = (
                    actor_name in zones or actor_name in self.parsed.defined or self.parsed.lacking
                )
                if kind == "zone" and not known:
                    what = f"`{name}` takes a zone, but `{actor_name}` is not one"
                    hint = did_you_mean(actor_name, zones, "`{}`")
                    yield self.source.fault(
                        "E229", what, actor.span, f"`zone {actor_name} is ...`", hint
                    )
                elif kind == "object" and actor_name in zones:
                    what = f"`{actor_name}` is a zone, but `{name}` takes an actor here"
                    yield self.source.fault("E229", what, actor.span, "an actor")

    def grounds(self) -> Iterator[Diagnostic]:
        """A ground defined twice, or by points that do not determine it."""
        floors = [*(z.floor for z in self.task.zones), *(g.floor for g in self.task.grounds)]
        for side in (side for floor in floors for point in floor for side in point):
            known = side.unit in UNITS  # a position may be 0 m
            yield from self.dimension_faults(side, SIZE, side) if known else self.amount(side, SIZE)
        for ground in self.task.grounds[1:]:
            hint = "several tasks of one file share it"
            yield self.source.fault("E224", "`ground` is declared twice", ground.span, hint=hint)
        for ground in self.task.grounds[:1]:
            if floor_map(ground) is None:
                what = "three of the points lie on a line, so they do not determine the floor"
                expected = "four points, such as the corners of a rectangle on the floor"
                yield self.source.fault("E136", what, ground.span, expected)

    def duplicate_declarations(self) -> Iterator[Diagnostic]:
        """Names declared twice; actors are checked elsewhere."""
        first: dict[str, str] = {a.name: "an actor" for a in self.task.actors}
        bystanders = [b for b in self.task.bystanders if b.name]
        for b in bystanders:
            if b.name in task_actors(self.task):
                what = f"`{b.name}` is declared as a bystander, but it takes part"
                expected = f"`optional actor {b.name}`, or another name"
                yield self.source.fault("E224", what, b.span, expected)
        kinds: tuple[tuple[str, Sequence[Declared]], ...] = (
            ("a bystander", bystanders),
            ("a zone", self.task.zones),
            ("a parameter", self.task.parameters),
        )
        for kind, declared in kinds:
            for one in declared:
                if one.name in first:
                    what = f"`{one.name}` is declared as {kind} and is {first[one.name]} already"
                    yield self.source.fault("E224", what, one.span, "another name")
                first.setdefault(one.name, kind)

    def unused(self) -> Iterator[Diagnostic]:
        """Unused zones and parameters, except those of included files."""
        if self.parsed.faults:
            return
        named = {str(a) for _, actors, _ in self.uses for a in actors}
        named |= {a.name for a, _ in self.used_amounts() if isinstance(a, ParameterRef)}
        for kind, declared in (("zone", self.task.zones), ("parameter", self.task.parameters)):
            for one in declared:
                if one.name not in named and not one.span.file:
                    what = f"{kind} `{one.name}` is declared but not used"
                    yield self.source.fault("E225", what, one.span)

    def unobserved(self) -> Iterator[Diagnostic]:
        """Actions whose percepts are not available, each reported once."""
        reported = set()
        for name, _, span in self.uses:
            meaning = self.actions.get(name)
            missing = sorted(meaning.needs - self.percepts) if meaning else []
            if missing and name not in reported:
                reported.add(name)
                missing_kinds = " and ".join(f"`{m}`" for m in missing)
                what = f"`{name}` can never be observed: it needs {missing_kinds}, which nothing provides"
                hint = "enable the behaviour that provides it, or require something else"
                yield self.source.fault("E231", what, span, hint=hint)

    def outside_loop(self) -> Iterator[Diagnostic]:
        """New actors of a loop used outside of it."""
        for kind in spare_kinds(self.task):
            outside = ((n, actors, a) for n, actors, _ in self.uses for a in actors if a == kind)
            for name, actors, actor in islice(outside, 1):
                what = f"`{kind}`, another one in each round of `for each new {kind}`, stands outside of it"
                call = f"{name}({', '.join(map(str, actors))})"
                hint = f"write `for each new {kind} {call}` in place of `{call}`"
                expected = "an actor that stays the same, or another such loop"
                yield self.source.fault("E240", what, actor.span, expected, hint)


ANY_DIMENSION = "any"
MAX_COMPARED = 500  # limit for pairwise comparison of names
DIMENSION_WORDS = {
    "angular_speed": "speed of turning",
    "size": "real size",
}
_MEASURED = frozenset(d for d, _ in UNITS.values())


def _with_article(noun: str) -> str:
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def _durations(clause: Clause) -> tuple[Amount, ...]:
    """The durations of a clause that must be positive; `after 0 s to 60 s` may begin at once."""
    if not isinstance(clause, Delay) or clause.most is None:
        return (clause.duration,)
    at_once = isinstance(clause.duration, Number) and clause.duration.value == 0
    return (clause.most,) if at_once else (clause.duration, clause.most)
