"""Observed entries to possible next steps, and whether those to steps that begin together coincide."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from math import inf
from typing import NamedTuple

from visup.agent import Relation
from visup.tasks.automaton.states import TaskStep


class StepEntry(NamedTuple):
    """The observed entry to a step.

    Attributes:
        since: Time since when it was observed, seconds.
        until: Time when it was last observed, seconds.
        held_by: The relation by which the step last held, or None.
        held_at: Time when the step last held, seconds.
    """

    since: float
    until: float
    held_by: Relation | None = None
    held_at: float = -inf


StepEntries = tuple[tuple[TaskStep, StepEntry], ...]
"""Step -> its entry."""

Meetings = tuple[tuple[tuple[TaskStep, ...], float], ...]
"""Steps that begin together -> time when the entries of all were last observed at the same time, seconds."""


def observed_entries(
    before: tuple[StepEntries, Meetings],
    possible: Iterable[tuple[TaskStep, ...]],
    entry: Callable[[TaskStep], Relation | None],
    now: float,
    *,
    refuted: Callable[[TaskStep], bool] = lambda step: False,
    held_by: Callable[[TaskStep], Relation | None] = lambda step: None,
) -> tuple[StepEntries, Meetings]:
    """Add the entries that are observed now, and drop those that have turned out to be false.

    Args:
        before: The entries and meetings so far.
        possible: The steps that may begin next; those that begin together in one tuple.
        entry: The relation by which the beginning of a step is observed now, or None.
        now: Current time, seconds.
        refuted: Whether it is known now that a step has not begun, whatever was observed before.
        held_by: The relation by which a step holds now, or None.

    Returns:
        The updated entries and meetings.
    """
    entries = {s: span for s, span in before[0] if not refuted(s)}
    met = {steps: at for steps, at in before[1] if all(s in entries for s in steps)}
    for steps in possible:
        found = ((s, entry(s)) for s in steps)
        for step, relation in found:
            if relation is not None:
                entries[step] = _observed(entries.get(step), relation.since, held_by(step), now)
        together = coincidence([entries[s][:2] for s in steps if s in entries])
        if together is not None and all(s in entries for s in steps):
            met[steps] = together
    return tuple(entries.items()), tuple(met.items())


def coincidence(spans: Sequence[tuple[float, float]]) -> float | None:
    """The last time that lies in all of some intervals, or None.

    Intervals are compared, not current observations: an entry may be confirmed, and dated back, when another
    one is no longer certain.

    Args:
        spans: Begin and end of each, seconds.
    """
    last = min((until for _, until in spans), default=None)
    return last if last is not None and max(since for since, _ in spans) <= last else None


def _observed(
    before: StepEntry | None, since: float, held_by: Relation | None, now: float
) -> StepEntry:
    if held_by is not None:
        return StepEntry(since, now, held_by, now)
    return StepEntry(since, now) if before is None else before._replace(since=since, until=now)


def held_on_entry(
    entries: StepEntries, steps: Collection[TaskStep], holds: Callable[[TaskStep], bool]
) -> dict[TaskStep, Relation]:
    """The steps that held when the others began, but have become uncertain by the time when all have begun.

    A gripper opens just as it puts a part down: once the part is known to lie there, the grasp is in doubt.

    Args:
        entries: The observed entries.
        steps: Steps that begin together, whose entries have coincided.
        holds: Whether a step is known to hold now.

    Returns:
        Step -> the relation by which it held; empty unless another one of the steps holds now.
    """
    found = {s: entry for s, entry in entries if s in steps}
    if len(found) < len(steps) or not any(holds(s) for s in steps):
        return {}
    begun = max(entry.since for entry in found.values())
    then = ((s, e.held_by) for s, e in found.items() if e.held_at >= begun and not holds(s))
    return {s: held_by for s, held_by in then if held_by is not None}
