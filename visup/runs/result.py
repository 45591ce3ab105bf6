"""How a run ended, and its exit code."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from visup.agent import Verdict


class ExitCode(IntEnum):
    """The exit codes of `visup watch` and `visup replay`; if several apply, the first of 1, 4, 5, 130, 3."""

    GOOD = 0
    """Success; without a task: nothing unsafe was seen from the first frame to the last."""
    BAD = 1
    """The task failed, something was unsafe, or not everything could be followed or watched."""
    BAD_INPUT = 2
    """An input is not valid; nothing was watched."""
    UNFINISHED = 3
    """The task was still in progress when the source ended; no other fault."""
    SOURCE_BROKE_OFF = 4
    """The source is truncated or damaged; no other fault in the part that was seen."""
    NOT_RECORDED = 5
    """The run, its report or its alerts could not be written or delivered completely; no other fault."""
    STOPPED = 130
    """The user stopped it (Ctrl-C); no fault until then."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run ended.

    Attributes:
        verdict: Verdict on the tasks; without a task 'interrupted' if something severe was seen, else
            'unknown'
            if a part was not watched, else None.
        steps: Number of frames.
        problem: Fault of the source, or None.
        folder: The run folder, or None.
        report: The report, or None.
        notes: Notes for the user, such as a missing extra.
        has_task: Whether there was a task.
        stopped: Whether the user stopped it.
        seconds: Time of the last frame.
        recorded: Whether everything was written.
        delivered: Whether every sink accepted all alerts.
    """

    verdict: Verdict | None
    steps: int
    problem: str | None = None
    folder: Path | None = None
    report: Path | None = None
    notes: tuple[str, ...] = ()
    has_task: bool = True
    stopped: bool = False
    seconds: float = 0.0
    recorded: bool = True
    delivered: bool = True

    @property
    def exit_code(self) -> ExitCode:
        """The exit code of the command."""
        if self.verdict not in (None, Verdict.SUCCEEDED, Verdict.IN_PROGRESS):
            return ExitCode.BAD
        if self.problem and not self.stopped:
            return ExitCode.SOURCE_BROKE_OFF
        if not (self.recorded and self.delivered):
            return ExitCode.NOT_RECORDED
        if self.stopped:
            return ExitCode.STOPPED
        return ExitCode.UNFINISHED if self.verdict is Verdict.IN_PROGRESS else ExitCode.GOOD
