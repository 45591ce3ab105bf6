"""State of facts carried from step to step: since when they hold, their rhythm, and pauses."""

from __future__ import annotations

from dataclasses import dataclass

from visup.tasks.actions.rhythm import Beats
from visup.tasks.verification.pauses import NO_PAUSES, PauseRecord


@dataclass(frozen=True, slots=True)
class Kept:
    """State of the facts of a task at one moment, for the next.

    Attributes:
        time: Seconds of that moment, or None before the first.
        lasting: Since when each fact that is no plain relation of the mind has been true, by key.
        beats: Occurrences of periodic facts, by key.
        pauses: All pauses so far.
    """

    time: float | None = None
    lasting: tuple[tuple[str, float], ...] = ()
    beats: tuple[tuple[str, Beats], ...] = ()
    pauses: PauseRecord = NO_PAUSES


NOTHING_KEPT = Kept()
