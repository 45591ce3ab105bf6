"""Words of the rule language as actions: the interface between the two languages.

Every relation and predicate of `rules/` about objects and zones can be required by a stage, and every
quantity can be compared. A fact of a task file that is not a plain relation of the mind (a predicate, a
comparison, a zone) gets a key and an evaluator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from visup.agent import Truth
from visup.rules.formula.nodes import SIGNAL_WORDS
from visup.rules.formula.truth import NEGATION, TRUTH_OF, truth_if
from visup.rules.formula.units import Number
from visup.rules.predicates.inputs_missing import inputs_missing
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES
from visup.rules.relations.zones import contains, zone_truth
from visup.tasks.actions.actions import ACTIONS, ActionDefinition
from visup.tasks.actions.floor import floor_distance, floor_polygon, stands_in
from visup.tasks.actions.rhythm import Rhythm
from visup.tasks.grammar.conditions import Fact, action_of, bounds_of, facts_of, is_periodic, once
from visup.tasks.grammar.nodes import Action, Actors, Comparison, Conditioned, Task, walk
from visup.tasks.grammar.statement import RESERVED_WORDS as RESERVED
from visup.tasks.grammar.structure import fact_key, period_of
from visup.tasks.grammar.units import MEASURES, SIZE, dimension, value

OF_TASKS = frozenset({"unexpected", "expected", "actor", "bystander", "one_machine"})
"""Words of rules about tasks, which would be circular in a task."""

BETWEEN = "between"
DEPTHS = frozenset({"region", "hypothesis", "depth"})

NEARNESS = frozenset({"gap", "distance"})
"""Quantities that are small for objects near each other."""

FactEvaluator = Callable[[Snapshot, tuple[int, ...]], Truth]
"""Evaluates a fact for objects, by id, in a snapshot."""


Measured = Callable[[Snapshot, tuple[int, ...]], tuple[float, float]]
"""Returns the interval of a quantity of objects, by their rows in the snapshot, in the base unit."""


def rule_actions() -> Iterator[ActionDefinition]:
    """Every word and quantity of rules that is available in tasks."""
    for name, word in PREDICATES.items():
        if _fits(name, word.argument_kinds):
            text = name.replace("_", " ")
            yield ActionDefinition(
                name,
                holds=(name,),
                arity=len(word.argument_kinds),
                hold_s=0.5,
                text=text,
                takes=word.argument_kinds,
                needs=_needs(name),
                about=word.meaning,
            )
    for name, quantity in QUANTITIES.items():
        if _fits(name, quantity.argument_kinds):
            yield ActionDefinition(
                name,
                holds=(),
                arity=len(quantity.argument_kinds),
                hold_s=0.5,
                takes=quantity.argument_kinds,
                measures=MEASURES[quantity.dimension],
                needs=_needs(name),
                about=quantity.meaning,
            )


def _needs(name: str) -> frozenset[str]:
    """Kinds of percept without which a word or quantity is never observed."""
    if name in SIGNAL_WORDS:
        return frozenset({"signal"})
    return DEPTHS if "depth" in name and name in QUANTITIES else frozenset({"region"})


def _fits(name: str, takes: tuple[str, ...]) -> bool:
    if name in SIGNAL_WORDS:
        return True
    known = name not in OF_TASKS and name not in RESERVED
    return known and bool(takes) and takes[0] == "object" and set(takes) <= {"object", "zone"}


@dataclass(frozen=True, slots=True)
class TaskVocabulary:
    """The meanings of the facts of one task.

    Attributes:
        meanings: Actions by name, and comparisons and actions on zones by key.
        evaluators: Key or word -> evaluator, except for plain relations of the mind.
        rhythms: Keys of periodic actions, and of their contraries.
    """

    meanings: Mapping[str, ActionDefinition]
    evaluators: Mapping[str, FactEvaluator]
    rhythms: Mapping[str, Rhythm]


def task_vocabulary(task: Task, actions: Mapping[str, ActionDefinition]) -> TaskVocabulary:
    """The vocabulary of a task.

    Args:
        task: A valid task.
        actions: All actions.
    """
    zones = {z.name for z in task.zones}
    meanings, evaluators = dict(actions), {n: _word(n) for n in PREDICATES if n not in ACTIONS}
    rhythms: dict[str, Rhythm] = {}
    for fact in _facts(task):
        name, key = action_of(fact).name, fact_key(task, fact)[0]
        if key == name or name not in actions:
            continue
        if isinstance(fact, Comparison) and is_periodic(fact):
            of = meanings[fact_key(task, once(fact))[0]]
            found = _again(key, of, period_of(task, fact), str(fact.right))
            meanings |= {m.name: m for m, _ in found}
            rhythms |= {m.name: r for m, r in found}
            continue
        text = actions[name].text
        if isinstance(fact, Comparison):
            amounts = [task.amount(a) for a in bounds_of(fact)]
            measured = _measure(task, fact, amounts[0])
            evaluators[key] = _comparison(name, measured, fact.operator, *map(value, amounts))
            text = _compared(fact, name, amounts)
        elif name in SIGNAL_WORDS:
            evaluators[key] = _word(name, tuple(map(str, fact.arguments)))
            text = f"as `{fact}` says"
        else:
            zone = next(str(a) for a in fact.arguments if a in zones)
            evaluators[key] = _zone_evaluator(task, name, zone)
            text = f"{text} {zone}"
        meaning = _with_trend(actions[name], fact)
        takes = tuple(k for k in meaning.kinds if k == "object")
        meanings[key] = replace(
            meaning, name=key, holds=(key,), arity=len(takes), takes=takes, text=text
        )
        if isinstance(fact, Comparison) and fact.operator == BETWEEN:
            # Staying within a range lasts until the next step begins, and fails outside it.
            outside = f"outside {key}"
            evaluators[outside] = _outside(evaluators[key])
            meanings[key] = replace(meanings[key], lasts=True, contrary=(outside,))
    return TaskVocabulary(
        MappingProxyType(meanings), MappingProxyType(evaluators), MappingProxyType(rhythms)
    )


def _compared(fact: Comparison, name: str, amounts: Sequence[Number]) -> str:
    """The wording of a comparison: "at a gap below 20 px"."""
    if name in SIGNAL_WORDS:
        return f"as `{fact}` says"
    said = " and ".join(map(str, amounts))
    return f"at a {name.replace('_', ' ')} {SIGNS[fact.operator]} {said}"


def _with_trend(action: ActionDefinition, fact: Fact) -> ActionDefinition:
    """What requires nearness expects approaching, and fails if they draw apart; the reverse for distance."""
    if not isinstance(fact, Comparison) or action.name not in NEARNESS:
        return action
    near = fact.operator in ("<", "<=", BETWEEN)
    expected, contrary = ("converging", "diverging") if near else ("diverging", "converging")
    return replace(action, expects=(expected,), contrary=(contrary,))


def _again(
    key: str, of: ActionDefinition, period: tuple[float, float], said: str
) -> tuple[tuple[ActionDefinition, Rhythm], tuple[ActionDefinition, Rhythm]]:
    """A periodic action, which lasts while it keeps its period, and its contrary."""
    late = f"out of time {key}"
    expects = tuple(dict.fromkeys((of.name, *of.helps, *of.expects)))
    again = replace(
        of,
        name=key,
        holds=(key,),
        lasts=True,
        hold_s=2 * period[1],
        entry=(),
        progress=(),
        contrary=(late,),
        expects=expects,
        text=f"{of.text} every {said}",
    )
    lost = replace(again, name=late, holds=(late,), contrary=(), text="out of time")
    rhythm = Rhythm(key, of.holds, period)
    return (again, rhythm), (lost, replace(rhythm, late=True))


def _facts(task: Task) -> Iterator[Fact]:
    """The facts of a task; the action of a periodic one precedes it."""
    for fact in _said(task):
        if isinstance(fact, Comparison) and is_periodic(fact):
            yield once(fact)
        yield fact


def _said(task: Task) -> Iterator[Fact]:
    for stage in task.stages:
        if isinstance(stage.body, Actors):
            yield Action(stage.name, stage.body.names)
            continue
        for course in walk(stage.body):
            if isinstance(course, Action | Comparison):
                yield course
            if isinstance(course, Conditioned):
                for sign in course.conditions:
                    yield from facts_of(sign.condition)
    for invariant in task.invariants:
        yield from facts_of(invariant.condition)


def _word(name: str, words: tuple[str, ...] = ()) -> FactEvaluator:
    """The evaluator of a word of rules; `words` are its arguments other than objects."""

    def evaluate(facts: Snapshot, ids: tuple[int, ...]) -> Truth:
        rows = _rows(facts, ids)
        if rows is None or inputs_missing(facts.mind, name):
            return Truth.UNKNOWN
        return TRUTH_OF[int(PREDICATES[name].evaluate(facts, *words)[rows])]

    return evaluate


def _rows(facts: Snapshot, ids: tuple[int, ...]) -> tuple[int, ...] | None:
    """The rows of objects in a snapshot, or None if one of them is missing."""
    return tuple(facts.row[i] for i in ids) if facts.row.keys() >= set(ids) else None


SIGNS = {BETWEEN: BETWEEN, "<": "below", "<=": "of at most", ">": "above", ">=": "of at least"}
_COMPARE: Mapping[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}


def _outside(within: FactEvaluator) -> FactEvaluator:
    return lambda facts, ids: NEGATION[within(facts, ids)]


def _measure(task: Task, fact: Comparison, amount: Number) -> Measured:
    """The measure of a quantity: on the floor for a gap in metres, else as in rules."""
    name = action_of(fact).name
    words = tuple(map(str, action_of(fact).arguments)) if name in SIGNAL_WORDS else ()
    if name == "gap" and dimension(amount) == SIZE:
        distance = floor_distance(task.ground)

        def on_floor(facts: Snapshot, rows: tuple[int, ...]) -> tuple[float, float]:
            metres = distance(facts, rows)
            return (metres, metres) if metres == metres else (-np.inf, np.inf)

        return on_floor

    def plain(facts: Snapshot, rows: tuple[int, ...]) -> tuple[float, float]:
        low, high = (float(side[rows]) for side in QUANTITIES[name].evaluate(facts, *words))
        return low, high

    return plain


def _comparison(
    name: str, measured: Measured, sign: str, bound: float, most: float = 0.0
) -> FactEvaluator:
    """Compare a quantity with a bound: true or false if its whole interval agrees, else unknown."""

    def evaluate(facts: Snapshot, ids: tuple[int, ...]) -> Truth:
        rows = _rows(facts, ids)
        if rows is None or inputs_missing(facts.mind, name):
            return Truth.UNKNOWN
        low, high = measured(facts, rows)
        if sign == BETWEEN:
            return _within(low, high, bound, most)
        truths = {_COMPARE[sign](low, bound), _COMPARE[sign](high, bound)}
        return Truth.UNKNOWN if len(truths) > 1 else truth_if(truths.pop())

    return evaluate


def _within(low: float, high: float, least: float, most: float) -> Truth:
    """Whether an interval is between two bounds; unknown if only part of it is."""
    if least <= low and high <= most:
        return Truth.TRUE
    return Truth.FALSE if high < least or low > most else Truth.UNKNOWN


def _zone_evaluator(task: Task, name: str, zone: str) -> FactEvaluator:
    """The evaluator of a zone: one defined in the task directly, one of the settings as in rules."""
    declared = next(z for z in task.zones if z.name == zone)
    corners, floor = declared.corners, floor_polygon(declared, task.ground)
    polygon = np.asarray(corners, dtype=float)
    question = "reaching" if name == "outside" else name

    def evaluate(facts: Snapshot, ids: tuple[int, ...]) -> Truth:
        rows = _rows(facts, ids)
        if rows is None:
            return Truth.UNKNOWN
        if declared.floor:
            truth = Truth.UNKNOWN
            if floor is not None:
                truth = stands_in(facts.beliefs[rows[0]], floor, question, facts.mind.frame_size)
        elif corners:
            region = facts.beliefs[rows[0]].region
            centre = np.array([region.centroid])
            points = centre if name == "inside" else np.asarray(region.contour, dtype=float)
            within = contains(points, polygon)
            truth = truth_if(bool(within.all() if name == "wholly_inside" else within.any()))
        else:
            truth = zone_truth(facts.mind, question, ids[0], zone)
        return NEGATION[truth] if name == "outside" else truth

    return evaluate
