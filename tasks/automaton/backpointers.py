"""What lies behind a task by the best way to where it is, and what of it is taken back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from visup.tasks.automaton.states import TaskStep

MOST_BEHIND = 32  # at least so many steps are remembered, and less than twice as many


@dataclass(frozen=True, slots=True)
class Backpointer:
    """A step that lies behind, with those before it: the best way to a place.

    Attributes:
        step: The step.
        left: When it was left, seconds.
        before: What lies further back; None where that is forgotten too.
        length: How many steps lie behind, with those forgotten.
    """

    step: TaskStep
    left: float
    before: Backpointer | None
    length: int


@dataclass(frozen=True, slots=True)
class Revision:
    """A step that was reported to be over and is now believed not to have been.

    Attributes:
        step: The step.
        reported: When it was believed to have ended, seconds.
        revised: When that was taken back, seconds.
    """

    step: TaskStep
    reported: float
    revised: float

    def __str__(self) -> str:
        return (
            f"`{self.step.stage}`, reported complete at {self.reported:.1f} s, "
            f"is now believed not to have happened"
        )


def extended(
    backpointer: Backpointer | None, left: tuple[TaskStep, ...], now: float
) -> Backpointer | None:
    """A trail with some steps more that were left now; what lies too far back is forgotten."""
    for step in left:
        backpointer = Backpointer(
            step, now, backpointer, backpointer.length + 1 if backpointer else 1
        )
    if backpointer is not None and backpointer.length % MOST_BEHIND == 0:
        return _cut(backpointer, MOST_BEHIND)
    return backpointer


def behind(backpointer: Backpointer | None) -> Iterator[Backpointer]:
    """What lies behind, the last first, as far as it is remembered."""
    while backpointer is not None:
        yield backpointer
        backpointer = backpointer.before


def _cut(backpointer: Backpointer, most: int) -> Backpointer:
    before = None if backpointer.before is None or most <= 1 else _cut(backpointer.before, most - 1)
    return replace(backpointer, before=before)


def revisions(old: Backpointer | None, new: Backpointer | None, now: float) -> Iterator[Revision]:
    """Steps that lay behind by the best way before, and do not by the best way now, the last first."""
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
    """Whether two trails of one length pass through the same steps, as far as they are remembered."""
    while one is not None and other is not None and one is not other:
        if one.step != other.step:
            return False
        one, other = one.before, other.before
    return True
