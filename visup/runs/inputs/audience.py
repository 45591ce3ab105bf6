"""The audience of a run: observers, progress, operator, notices."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from visup.agent.model.step import Observer

if TYPE_CHECKING:
    from visup.runs.operator import HumanOperator
    from visup.runs.unattended.next_run import RunFolders


class RunProgress(Protocol):
    """Receives the progress of a run after each step."""

    def __call__(self, done: int, total: int | None, lag_s: float | None = None, /) -> None:
        """Report the progress.

        Args:
            done: Processed frames.
            total: All frames, or None if not known.
            lag_s: Age of the processed frame, seconds; None if not in real time.
        """


@dataclass(frozen=True, slots=True)
class RunFigures:
    """Figures of a run after a step.

    Attributes:
        steps: Frames processed since the run began.
        dropped: Frames dropped by this process to keep pace.
        lag_s: Age of the frame, seconds; None if not in real time.
        phase_ms: Total time of each phase in this process, milliseconds.
    """

    steps: int
    dropped: int
    lag_s: float | None
    phase_ms: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Audience:
    """The audience of a live run.

    Attributes:
        observers: Receive each step and its frame after it is recorded.
        progress: Receives the progress.
        operator: Answers questions; None by default.
        notice: Receives messages that cannot wait for a step, such as that a camera dropped: one sentence.
        figures: Receives the figures after each step.
        folders: Folders for runs that follow a live one; None if none follows.
    """

    observers: Sequence[Observer] = ()
    progress: RunProgress | None = None
    operator: HumanOperator | None = None
    notice: Callable[[str], None] | None = None
    figures: Callable[[RunFigures], None] | None = None
    folders: RunFolders | None = None
