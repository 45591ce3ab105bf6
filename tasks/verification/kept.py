"""State of facts from step to step: how long they have held, how often, when they paused work."""

from __future__ import annotations

from dataclasses import dataclass

from visup.tasks.actions.rhythm import Beats
from visup.tasks.verification.pauses import NO_PAUSES, PauseRecord


@dataclass(frozen=True, slots=True)
class Kept:
    """State of the facts of a task at one moment, for the next.

    Attributes:
        time: Seconds of that moment, or None before the first.
        lasting: Since when what is no plain relation of the mind has been true, by key.
        beats: Of what is to happen again and again when it did, by key.
        pauses: When work was paused.
    """

    time: float | None = None
    lasting: tuple[tuple[str, float], ...] = ()
    beats: tuple[tuple[str, Beats], ...] = ()
    pauses: PauseRecord = NO_PAUSES


NOTHING_KEPT = Kept()
