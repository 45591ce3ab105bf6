"""`for each of 4 legs <mount(leg)>`: the actors `leg_1` to `leg_4`, each of them another leg.

Read before: `templates.py` (stages of any actor), `nodes.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from visup.rules.formula.units import Span
from visup.tasks.grammar.ast_courses import AnyOrder, Course, walk
from visup.tasks.grammar.criteria import Another, in_order
from visup.tasks.grammar.nodes import Actor, Actors, Stage
from visup.tasks.grammar.templates import names_in

MOST_COPIES = 13
"""So many are made at most: more than may stand in any order, which is told."""


def one_of(plural: str, course: Course) -> str:
    """What a course calls one of several things.

    Args:
        plural: What they are called together, such as `legs`.
        course: What is done with each.
    """
    singular = [plural.removesuffix("s"), plural.removesuffix("es"), plural]
    singular += [plural.removesuffix("ies") + "y"] if plural.endswith("ies") else []
    used = names_in(course)
    return next((name for name in singular if name in used), singular[0])


def copy_names(name: str, count: int) -> tuple[str, ...]:
    """The actors that stand for so many things.

    >>> copy_names("leg", 2)
    ('leg_1', 'leg_2')
    """
    return tuple(f"{name}_{k + 1}" for k in range(count))


def with_copies(declared: Sequence[Actor], stages: Sequence[Stage]) -> list[Actor]:
    """The declarations of actors, with one for each of several things instead of that of their kind."""
    most: dict[str, int] = {}
    said: dict[str, Span] = {}
    for name, count, span in _copies(stages):
        most[name] = max(count, most.get(name, 0))
        said.setdefault(name, span)
    known = {a.name: a for a in declared}
    actors = [a for a in declared if a.name not in most]
    for name, count in most.items():
        kind = known.get(name, Actor(name, span=said[name]))
        plain = kind.models or kind.criteria
        first = kind if plain else replace(kind, models=(name,))
        for k, copy in enumerate(copy_names(name, count)):
            criteria = in_order((*first.criteria, Another())) if k else first.criteria
            if copy not in known:
                actors.append(replace(first, name=copy, criteria=criteria))
    return actors


def _copies(stages: Sequence[Stage]) -> Iterator[tuple[str, int, Span]]:
    """What several things are called, how many there are, and where that is said."""
    bodies = (s.body for s in stages if not isinstance(s.body, Actors))
    courses = (c for body in bodies for c in walk(body))
    return ((*c.copies, c.span) for c in courses if isinstance(c, AnyOrder) and c.copies)
