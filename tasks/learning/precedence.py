"""Order of assembly: a contact that comes later in all good runs must not hold before the earlier one.

A contact that already holds when the earlier one begins would satisfy a stage that requires both, so the
order is an invariant of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from visup.tasks.learning.bodies import moved_s
from visup.tasks.learning.order import Item, Occurrence, Plan, Series, action_text
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import RunTrace, Symbol

TOO_EARLY_S = 2.0
"""A later contact must not hold this long before the earlier one, seconds: shorter ones are incidental."""
APART_S = 1.0
"""Least time between the two contacts in every good run, seconds, for their order to count."""


@dataclass(frozen=True, slots=True)
class Precedence:
    """Contacts that must not hold yet during some stages.

    Attributes:
        contacts: The later contacts, each of a pair.
        first: The earlier contact, which must come first.
        during: The stages before them.
    """

    contacts: tuple[Symbol, ...]
    first: Symbol
    during: tuple[Occurrence, ...]


def precedences(
    plan: Plan, rows: Sequence[Sequence[CourseEvent]], runs: Sequence[RunTrace]
) -> Iterator[Precedence]:
    """The order of the lasting contacts of a plan, as far as all runs agree.

    Args:
        plan: The course.
        rows: The events of each run.
        runs: The runs, in the same order.
    """
    stages = _in_sequence(plan)
    lasting = [o for o in stages if all(_is_lasting(row, o[0]) for row in rows)]
    for earlier, later in pairwise(lasting):
        times = [(_at(row, earlier[0]), _at(row, later[0])) for row in rows]
        contacts = _contacts_with_resting_actor(earlier[0], later[0], runs)
        separated = all(b - a > APART_S for a, b in times)
        early = any(
            _held_before(run, contact, first_begin)
            for run, (first_begin, _) in zip(runs, times, strict=True)
            for contact in contacts
        )
        if contacts and separated and not early:
            first = _contacts(earlier[0])[0]
            yield Precedence(contacts, first, tuple(stages[: stages.index(earlier) + 1]))


def invariants(found: Sequence[Precedence], names: Mapping[Occurrence, str]) -> Iterator[str]:
    """Lines of a task file.

    Args:
        found: The precedences.
        names: The names of the stages.
    """
    for precedence in found:
        during = " or ".join(f"<{names[o]}>" for o in precedence.during)
        for action, actors in precedence.contacts:
            too_early = f"{action}({', '.join(actors)})"
            # A stage may be reported long after its contact was observed.
            condition = f"({too_early} and not {action_text(precedence.first)})"
            yield f"never {condition} for {TOO_EARLY_S:g} s during {during}"


def _in_sequence(plan: Plan) -> list[Occurrence]:
    """The leading stages of a plan that follow each other."""
    parts = plan.parts if isinstance(plan, Series) else (plan,)
    found: list[Occurrence] = []
    for part in parts:
        if not isinstance(part, tuple):
            break
        found.append(part)
    return found


def _contacts_with_resting_actor(
    earlier: Item, later: Item, runs: Sequence[RunTrace]
) -> tuple[Symbol, ...]:
    """The later contacts with the actor of the earlier contact that moves less."""
    actors = {a for _, pair in _contacts(earlier) for a in pair}
    resting = min(sorted(actors), key=lambda a: moved_s(runs, a), default="")
    return tuple(s for s in _contacts(later) if resting in s[1] and s not in _contacts(earlier))


def _contacts(item: Item) -> tuple[Symbol, ...]:
    symbols = (item,) if isinstance(item, tuple) else getattr(item, "parts", ())
    return tuple(s for s in symbols if s[0] == "touching")


def _is_lasting(row: Sequence[CourseEvent], item: Item) -> bool:
    """Whether an event of contact occurs once in a run, was seen to begin, and lasts to its end."""
    found = [e for e in row if e.item == item]
    return (
        bool(_contacts(item))
        and len(found) == 1
        and found[0].lasts_to_end
        and found[0].interval.begin_observed
    )


def _at(row: Sequence[CourseEvent], item: Item) -> float:
    return next(e.at for e in row if e.item == item)


def _held_before(run: RunTrace, contact: Symbol, until: float) -> bool:
    """Whether a contact held in a run for half as long as is too early, before some time."""
    earlier = [
        interval
        for interval in run.intervals
        if interval.symbol == contact and interval.begin < until
    ]
    return any(
        min(interval.end, until) - interval.begin > 0.5 * TOO_EARLY_S for interval in earlier
    )
