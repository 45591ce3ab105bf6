"""Backpointers: the completed steps on the best path to a state, and revisions of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from visup.tasks.automaton.states import TaskStep

MAX_BEHIND = 32  # completed steps remembered: at least this number, less than twice as many


@dataclass(frozen=True, slots=True)
class Backpointer:
    """A completed step with its predecessors on the best path to a state.

    Attributes:
        step: The step.
        left: Time when it was completed, seconds.
        before: Its predecessor; None if there is none, or if it is forgotten.
        length: Number of completed steps, including forgotten ones.
        begun: Time when it was first observed, seconds, or None.
    """

    step: TaskStep
    left: float
    before: Backpointer | None
    length: int
    begun: float | None = None


@dataclass(frozen=True, slots=True)
class Revision:
    """A step that was reported as completed and is no longer believed to be.

    Attributes:
        step: The step.
        reported: When it was believed to be completed, seconds.
        revised: When that was revised, seconds.
    """

    step: TaskStep
    reported: float
    revised: float

    def text(self, goes_on: bool = False) -> str:
        """What is said about it; `goes_on` if the stage is believed to be under way still."""
        believed = "still to be going on" if goes_on else "not to have happened"
        return f"`{self.step.stage}`, reported complete at {self.reported:.1f} s, is now believed {believed}"


def extended(
    backpointer: Backpointer | None,
    left: Iterable[tuple[TaskStep, float | None]],
    now: float,
) -> Backpointer | None:
    """A path extended by the steps completed now; the oldest steps are forgotten.

    Args:
        backpointer: The path so far; None if it is empty.
        left: The steps completed now, each with the time when it was first observed in seconds, or None.
        now: Current time, seconds.
    """
    for step, since in left:
        length = backpointer.length + 1 if backpointer else 1
        backpointer = Backpointer(step, now, backpointer, length, since)
    if backpointer is not None and backpointer.length % MAX_BEHIND == 0:
        return _cut(backpointer, MAX_BEHIND)
    return backpointer


def behind(backpointer: Backpointer | None) -> Iterator[Backpointer]:
    """The remembered completed steps, latest first."""
    while backpointer is not None:
        yield backpointer
        backpointer = backpointer.before


def _cut(backpointer: Backpointer, most: int) -> Backpointer:
    before = None if backpointer.before is None or most <= 1 else _cut(backpointer.before, most - 1)
    return replace(backpointer, before=before)


def revisions(old: Backpointer | None, new: Backpointer | None, now: float) -> Iterator[Revision]:
    """Steps completed on the previous best path but not on the present one, latest first."""
    while old is not None and old is not new:
        while new is not None and new.length > old.length:
            new = new.before
        if new is not None and new.length == old.length:
            if _same(old, new):
                return
            new = new.before
        yield Revision(old.step, old.left, now)
        old = old.before


def _same(one: Backpointer | None, other: Backpointer | None) -> bool:
    """Whether two paths of the same length have the same remembered steps."""
    while one is not None and other is not None and one is not other:
        if one.step != other.step:
            return False
        one, other = one.before, other.before
    return True
