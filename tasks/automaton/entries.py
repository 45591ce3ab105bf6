"""The observed entries to next steps, and whether those of steps that begin together coincide."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from visup.agent import Relation
from visup.tasks.automaton.states import TaskStep

StepEntries = tuple[tuple[TaskStep, tuple[float, float]], ...]
"""Step -> since when its entry was observed, and when last, seconds."""

Meetings = tuple[tuple[tuple[TaskStep, ...], float], ...]
"""Steps that begin together -> when the entries of all were last observed at the same time, seconds."""


def observed_entries(
    before: tuple[StepEntries, Meetings],
    possible: Iterable[tuple[TaskStep, ...]],
    entry: Callable[[TaskStep], Relation | None],
    now: float,
    *,
    refuted: Callable[[TaskStep], bool] = lambda step: False,
) -> tuple[StepEntries, Meetings]:
    """Add the entries that are observed now, and drop those that have turned out to be none.

    Args:
        before: Those so far.
        possible: The steps that may begin next, those that begin together in one tuple.
        entry: The relation by which the beginning of a step is observed now, or None.
        now: Seconds.
        refuted: Whether it is known now that a step has not begun, whatever was observed before.
    """
    entries = {s: span for s, span in before[0] if not refuted(s)}
    met = {steps: at for steps, at in before[1] if all(s in entries for s in steps)}
    for steps in possible:
        found = ((s, entry(s)) for s in steps)
        entries |= {s: (r.since, now) for s, r in found if r is not None}
        together = coincidence([entries[s] for s in steps if s in entries])
        if together is not None and all(s in entries for s in steps):
            met[steps] = together
    return tuple(entries.items()), tuple(met.items())


def coincidence(spans: Sequence[tuple[float, float]]) -> float | None:
    """The last time that lies in all of some intervals, or None.

    An entry may be confirmed, and dated back, when another one is no longer certain.

    Args:
        spans: Begin and end of each, seconds.
    """
    last = min((until for _, until in spans), default=None)
    return last if last is not None and max(since for since, _ in spans) <= last else None
