"""Parts that are put together in one order: what comes later in all good runs must not have come before.

A contact that holds already when the one before it comes about would satisfy a stage that asks for both, so
the order is an invariant of its own.
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
"""A later contact must not hold so long before the earlier one, seconds: outlines also meet in passing."""
APART_S = 1.0
"""Least time between the two contacts in every good run, seconds, for their order to be meant."""


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
        contacts = _brought_to(earlier[0], later[0], runs)
        apart = all(b - a > APART_S for a, b in times)
        early = any(
            _held_before(run, contact, at)
            for run, (at, _) in zip(runs, times, strict=True)
            for contact in contacts
        )
        if contacts and apart and not early:
            first = _contacts(earlier[0])[0]
            yield Precedence(contacts, first, tuple(stages[: stages.index(earlier) + 1]))


def invariants(found: Sequence[Precedence], names: Mapping[Occurrence, str]) -> Iterator[str]:
    """Lines of a task file.

    Args:
        found: What must not come too early.
        names: The names of the stages.
    """
    for one in found:
        during = " or ".join(f"<{names[o]}>" for o in one.during)
        for action, actors in one.contacts:
            early = f"{action}({', '.join(actors)})"
            # A stage may be told late, when its contact has long been seen.
            said = f"({early} and not {action_text(one.first)})"
            yield f"never {said} for {TOO_EARLY_S:g} s during {during}"


def _in_sequence(plan: Plan) -> list[Occurrence]:
    """The leading stages of a plan that follow each other."""
    parts = plan.parts if isinstance(plan, Series) else (plan,)
    found: list[Occurrence] = []
    for part in parts:
        if not isinstance(part, tuple):
            break
        found.append(part)
    return found


def _brought_to(earlier: Item, later: Item, runs: Sequence[RunTrace]) -> tuple[Symbol, ...]:
    """The later contacts with the one of the earlier contact that moves less: parts may lie side by side."""
    actors = {a for _, pair in _contacts(earlier) for a in pair}
    still = min(sorted(actors), key=lambda a: moved_s(runs, a), default="")
    return tuple(s for s in _contacts(later) if still in s[1] and s not in _contacts(earlier))


def _contacts(item: Item) -> tuple[Symbol, ...]:
    symbols = (item,) if isinstance(item, tuple) else getattr(item, "parts", ())
    return tuple(s for s in symbols if s[0] == "touching")


def _is_lasting(row: Sequence[CourseEvent], item: Item) -> bool:
    """Whether an event of contact occurs once in a run, was seen to begin, and lasts to its end."""
    found = [e for e in row if e.item == item]
    return bool(_contacts(item)) and len(found) == 1 and found[0].lasts and found[0].happening.begun


def _at(row: Sequence[CourseEvent], item: Item) -> float:
    return next(e.at for e in row if e.item == item)


def _held_before(run: RunTrace, contact: Symbol, until: float) -> bool:
    """Whether a contact held in a run for half as long as is too early, before some time."""
    spells = [h for h in run.happenings if h.symbol == contact and h.begin < until]
    return any(min(h.end, until) - h.begin > 0.5 * TOO_EARLY_S for h in spells)
