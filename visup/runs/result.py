"""How a run ended."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from visup.agent import Verdict


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run ended.

    Attributes:
        verdict: Of the tasks; without a task 'interrupted' if something grave was told, else None.
        steps: Frames supervised.
        problem: What was wrong with the source, or None.
        folder: The run folder, or None.
        report: The report, or None.
        notes: What the user should know, such as an extra that is missing.
    """

    verdict: Verdict | None
    steps: int
    problem: str | None = None
    folder: Path | None = None
    report: Path | None = None
    notes: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 when all went well, 1 when it failed, was unsafe, or could not be followed."""
        return 0 if self.verdict in (None, Verdict.SUCCEEDED, Verdict.IN_PROGRESS) else 1
