"""Several things of one kind: `for each of 4 legs <mount(leg)>`, `for each new part <take(part)>`.

The first has the actors `leg_1` to `leg_4`, each a different leg. The second is a loop with a new part in
each round: `part_1` to `part_12` stand for all parts that may come, and a round is begun by one that had no
round yet. Parts that do not come are not waited for.

Read before: `templates.py` (stages of any actor), `nodes.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from visup.tasks.grammar.ast_courses import AnyOrder, Counted, Course, Repeated, walk
from visup.tasks.grammar.criteria import Another, in_order
from visup.tasks.grammar.nodes import Actor, Actors, Invariant, Stage
from visup.tasks.grammar.templates import bound, names_in

MAX_COPIES = 13
"""Maximum number of copies: one more than the limit of `any order`, so that exceeding it is reported."""
MAX_ROUNDS = 12
"""Maximum number of rounds of a loop with a new actor in each."""


def as_rounds(course: Counted | Repeated) -> AnyOrder | None:
    """The loop of a repetition with a new actor in each round, with its number of rounds; None for others."""
    loop = course.item
    if not isinstance(loop, AnyOrder) or not loop.new or loop.count is not None or loop.least != 1:
        return None
    if isinstance(course, Repeated):
        return replace(loop, least=loop.least if course.mark == "+" else 0, span=course.span)
    if course.most is None and course.least == 1:
        return replace(loop, span=course.span)
    return replace(loop, least=course.least, count=course.most, span=course.span)


def in_turn(loop: AnyOrder) -> bool:
    """Whether the completed rounds of a loop with new actors are its first ones.

    The actors are interchangeable before anything is seen, so other orders are redundant.
    """
    first = loop.new and copy_names(loop.new, 1 + MAX_ROUNDS - len(loop.items))[-1]
    return not first or first in names_in(loop.items[0])


def one_of(plural: str, course: Course) -> str:
    """The singular name that a course uses for one of several things.

    Args:
        plural: The plural name, such as `legs`.
        course: The course for each.
    """
    singular = [plural.removesuffix("s"), plural.removesuffix("es"), plural]
    singular += [plural.removesuffix("ies") + "y"] if plural.endswith("ies") else []
    used = names_in(course)
    return next((name for name in singular if name in used), singular[0])


def copy_names(name: str, count: int) -> tuple[str, ...]:
    """The actors of numbered copies.

    >>> copy_names("leg", 2)
    ('leg_1', 'leg_2')
    """
    return tuple(f"{name}_{k + 1}" for k in range(count))


def with_copies(declared: Sequence[Actor], stages: Sequence[Stage]) -> list[Actor]:
    """The declarations of actors, with that of a kind replaced by one for each copy."""
    courses = list(_copies(stages))
    kinds = dict.fromkeys(name for name, _, _ in courses)
    waited = {n: max((k for m, k, c in courses if m == n and not c.new), default=0) for n in kinds}
    spare = {copy: n for n in kinds for copy in copy_names(n, MAX_ROUNDS)[waited[n] :]}
    known = {a.name: a for a in declared}
    actors = [a for a in declared if a.name not in kinds]
    for name in kinds:
        span = next(c.span for m, _, c in courses if m == name)
        kind = known.get(name, Actor(name, span=span))
        count = max(k for m, k, _ in courses if m == name)
        actors += [a for a in _of_kind(kind, count) if a.name not in known]
    looped = {n for n, _, c in courses if c.new}
    return [replace(a, spare=spare[a.name]) if spare.get(a.name) in looped else a for a in actors]


def for_each_copy(
    invariants: Sequence[Invariant], actors: Sequence[Actor]
) -> tuple[Invariant, ...]:
    """The invariants, with those about a loop's new actor replaced by one for each copy."""
    found = list(invariants)
    for kind in dict.fromkeys(a.spare for a in actors if a.spare):
        copies = [a.name for a in actors if a.spare == kind]
        each = (
            [bound(i, {kind: c}) for c in copies] if kind in names_in(i) else [i] for i in found
        )
        found = [i for some in each for i in some]
    return tuple(found)


def _of_kind(kind: Actor, count: int) -> Iterator[Actor]:
    """A number of distinct actors of a kind."""
    first = kind if kind.models or kind.criteria else replace(kind, models=(kind.name,))
    for k, copy in enumerate(copy_names(kind.name, count)):
        criteria = in_order((*first.criteria, Another())) if k else first.criteria
        yield replace(first, name=copy, criteria=criteria)


def _copies(stages: Sequence[Stage]) -> Iterator[tuple[str, int, AnyOrder]]:
    """The singular name, number and loop of each group of copies."""
    bodies = (s.body for s in stages if not isinstance(s.body, Actors))
    courses = (c for body in bodies for c in walk(body))
    several = (c for c in courses if isinstance(c, AnyOrder))
    return ((*c.copies, c) for c in several if c.copies and not (c.new and alike(c)))


def alike(loop: AnyOrder) -> bool:
    """Whether all rounds of a loop are the same, since they do not name the new actor."""
    return len({str(i) for i in loop.items[:2]}) == 1
