"""The words of rules as actions: the one seam between the task language and the rule language.

Every relation and fact of `rules/` that speaks of objects and zones can be asked for by a stage,
and every quantity can be compared. A fact of a task file that is not a plain relation of the mind
(a word of rules, a comparison, a zone) gets a key, and a look that says whether it holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isnan
from types import MappingProxyType

import numpy as np

from visup.agent import Truth, Zone
from visup.rules.facts import QUANTITIES, WORDS, Facts
from visup.tasks.actions import ACTIONS, Meaning
from visup.tasks.chunk import WORDS as RESERVED
from visup.tasks.conditions import Comparison, Fact, action_of, facts_of
from visup.tasks.structure import keyed
from visup.tasks.tree import Action, Actors, Task, walk
from visup.tasks.units import value

OF_TASKS = frozenset({"unexpected", "expected", "actor"})
"""Words of rules that speak of tasks themselves: a task that asked for them would ask for itself."""

DEPTHS = frozenset({"region", "hypothesis", "depth"})

Look = Callable[[Facts, tuple[int, ...]], Truth]
"""Whether something holds between objects, by id, in a mind as rules see it."""


def words() -> Iterator[Meaning]:
    """Every word and quantity of rules that a task may ask for."""
    for name, word in WORDS.items():
        if _fits(name, word.takes):
            text = name.replace("_", " ")
            yield Meaning(
                name,
                holds=(name,),
                arity=len(word.takes),
                hold_s=0.5,
                text=text,
                takes=word.takes,
                about=word.meaning,
            )
    for name, quantity in QUANTITIES.items():
        if _fits(name, quantity.takes):
            yield Meaning(
                name,
                holds=(),
                arity=len(quantity.takes),
                hold_s=0.5,
                takes=quantity.takes,
                measures=quantity.dimension,
                needs=DEPTHS if "depth" in name else frozenset({"region"}),
                about=quantity.meaning,
            )


def _fits(name: str, takes: tuple[str, ...]) -> bool:
    known = name not in OF_TASKS and name not in RESERVED
    return known and bool(takes) and takes[0] == "object" and set(takes) <= {"object", "zone"}


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """What the facts of one task mean.

    Attributes:
        meanings: Actions by name, and comparisons and actions on zones by key.
        looks: Key or word -> whether it holds; plain relations of the mind are not among them.
    """

    meanings: Mapping[str, Meaning]
    looks: Mapping[str, Look]


def vocabulary(task: Task, actions: Mapping[str, Meaning]) -> Vocabulary:
    """What the facts of a task mean.

    Args:
        task: A task without mistakes.
        actions: All actions.
    """
    zones = {z.name for z in task.zones}
    meanings, looks = dict(actions), {n: _word(n) for n in WORDS if n not in ACTIONS}
    for fact in _facts(task):
        name, key = action_of(fact).name, keyed(task, fact)[0]
        if key == name or name not in actions:
            continue
        text = actions[name].text
        if isinstance(fact, Comparison):
            amount = task.amount(fact.amount)
            looks[key] = _comparison(name, fact.sign, value(amount))
            text = f"at a {name.replace('_', ' ')} {SIGNS[fact.sign]} {amount}"
        else:
            zone = next(str(a) for a in fact.actors if str(a) in zones)
            looks[key] = _zone_look(task, name, zone)
            text = f"{text} {zone}"
        takes = tuple(k for k in actions[name].kinds if k == "object")
        meanings[key] = replace(
            actions[name], name=key, holds=(key,), arity=len(takes), takes=takes, text=text
        )
    return Vocabulary(MappingProxyType(meanings), MappingProxyType(looks))


def _facts(task: Task) -> Iterator[Fact]:
    for stage in task.stages:
        if isinstance(stage.body, Actors):
            yield Action(stage.name, stage.body.names)
            continue
        for course in walk(stage.body):
            if isinstance(course, Action | Comparison):
                yield course
            for sign in getattr(course, "signs", ()):
                yield from facts_of(sign.condition)
    for invariant in task.invariants:
        yield from facts_of(invariant.condition)


def _word(name: str) -> Look:
    def look(facts: Facts, ids: tuple[int, ...]) -> Truth:
        if any(i not in facts.objects for i in ids):
            return Truth.UNKNOWN
        return WORDS[name].look(facts, *ids)

    return look


SIGNS = {"<": "below", "<=": "of at most", ">": "above", ">=": "of at least"}
_COMPARE: Mapping[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}


def _comparison(name: str, sign: str, bound: float) -> Look:
    def look(facts: Facts, ids: tuple[int, ...]) -> Truth:
        if any(i not in facts.objects for i in ids):
            return Truth.UNKNOWN
        measured = float(QUANTITIES[name].look(facts, *ids))
        if isnan(measured):
            return Truth.UNKNOWN
        return Truth.TRUE if _COMPARE[sign](measured, bound) else Truth.FALSE

    return look


def _zone_look(task: Task, name: str, zone: str) -> Look:
    corners = next(z.corners for z in task.zones if z.name == zone)

    def look(facts: Facts, ids: tuple[int, ...]) -> Truth:
        belief = facts.objects.get(ids[0])
        polygon = corners or _drawn(facts.mind.zones, zone)
        if belief is None or not polygon:
            return Truth.UNKNOWN
        region = belief.region
        if name == "inside":
            return _truth(bool(_within(np.array([region.centroid]), polygon)[0]))
        if name == "outside":
            return _truth(not _within(np.asarray(region.contour, dtype=float), polygon).any())
        return WORDS[name].look(facts, *ids, zone)

    return look


def _truth(holds: bool) -> Truth:
    return Truth.TRUE if holds else Truth.FALSE


Corners = tuple[tuple[float, float], ...]


def _drawn(zones: tuple[Zone, ...], name: str) -> Corners:
    """The corners of a zone of the settings; empty when there is none of that name."""
    return next((z.polygon for z in zones if z.name == name), ())


def _within(points: np.ndarray, polygon: Corners) -> np.ndarray:
    """Which of some points (N, 2) lie in a polygon, by the even-odd rule; (N,) bool."""
    x, y = points[:, 0], points[:, 1]
    inside = np.zeros(len(points), dtype=bool)
    for (ax, ay), (bx, by) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        if ay != by:
            crosses = (ay > y) != (by > y)
            inside ^= crosses & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    return inside
