"""How a run ended, and its exit code."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from visup.agent import Verdict


class ExitCode(IntEnum):
    """What `visup watch` and `visup replay` end with; of several the first of 1, 4, 5, 130, 3."""

    GOOD = 0
    """It went well; without a task: nothing unsafe was seen, from the first frame to the last."""
    BAD = 1
    """It failed, was unsafe, or could not be followed or watched whole."""
    BAD_INPUT = 2
    """Something given is not as it should be; nothing was watched."""
    UNFINISHED = 3
    """The task was still in progress when the source ended, and nothing was wrong."""
    SOURCE_BROKE_OFF = 4
    """The source is cut off or damaged; nothing was wrong in the part that was seen."""
    NOT_RECORDED = 5
    """The run, its report or its alerts could not be written or delivered whole; nothing was wrong else."""
    STOPPED = 130
    """The user stopped it (Ctrl-C); nothing was wrong until then."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run ended.

    Attributes:
        verdict: Of the tasks; without a task 'interrupted' if something grave was seen, else 'unknown' if
            a part was not watched, else None.
        steps: Frames supervised.
        problem: What was wrong with the source, or None.
        folder: The run folder, or None.
        report: The report, or None.
        notes: What the user should know, such as an extra that is missing.
        has_task: Whether there was a task to judge.
        stopped: Whether the user stopped it.
        seconds: Time of the last frame.
        recorded: Whether all that was to be written was written.
        delivered: Whether every sink for alerts took all that it was sent.
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
        """What the command ends with."""
        if self.verdict not in (None, Verdict.SUCCEEDED, Verdict.IN_PROGRESS):
            return ExitCode.BAD
        if self.problem and not self.stopped:
            return ExitCode.SOURCE_BROKE_OFF
        if not (self.recorded and self.delivered):
            return ExitCode.NOT_RECORDED
        if self.stopped:
            return ExitCode.STOPPED
        return ExitCode.UNFINISHED if self.verdict is Verdict.IN_PROGRESS else ExitCode.GOOD
