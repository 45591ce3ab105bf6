"""The audience of a run: observers, progress, operator, notices."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from visup.agent.model.step import Observer

if TYPE_CHECKING:
    from visup.runs.operator import HumanOperator
    from visup.runs.unattended.next_run import RunPlaces


class RunProgress(Protocol):
    """Told after each step how far a run has come."""

    def __call__(self, done: int, total: int | None, lag_s: float | None = None, /) -> None:
        """Take it down.

        Args:
            done: Frames that were looked at.
            total: Frames that there are, or None where nobody knows.
            lag_s: How long ago it was what is told now, seconds; None of what is not watched in real time.
        """


@dataclass(frozen=True, slots=True)
class RunFigures:
    """How a run does, after a step.

    Attributes:
        steps: Frames that were looked at since the run began.
        dropped: Frames that were dropped to keep pace, since this process watches.
        lag_s: How long ago it was what the frame shows, seconds; None of what is not watched in real time.
        phase_ms: What each phase of all steps took, since this process watches, milliseconds.
    """

    steps: int
    dropped: int
    lag_s: float | None
    phase_ms: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Audience:
    """The audience of a live run.

    Attributes:
        observers: Given each step and its frame, after it is recorded.
        progress: Given how far the run has come.
        operator: Who answers questions; nobody by default.
        notice: Given what cannot wait for a step, such as that a camera dropped: one sentence.
        figures: Given how the run does, after each step.
        places: Where the run that follows a live one goes; None where none does.
    """

    observers: Sequence[Observer] = ()
    progress: RunProgress | None = None
    operator: HumanOperator | None = None
    notice: Callable[[str], None] | None = None
    figures: Callable[[RunFigures], None] | None = None
    places: RunPlaces | None = None
