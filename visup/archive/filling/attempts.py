"""Counts the attempts at a clip that crashed their worker.

A worker leaves a mark before it begins a clip and removes it when it has finished, with or without success. A
mark that remains is of a worker that died. Marks are files in the lake, so that the next attempt finds them
on any worker, machine or scheduler.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import OutputError

MAX_ATTEMPTS = 2
"""A clip that has crashed this many workers is put aside."""
FOLDER = "attempts"


@dataclass(frozen=True, slots=True)
class Attempts:
    """The marks of one run.

    Attributes:
        lake: Folder of the lake.
        run: Key of the run or piece.
    """

    lake: Path
    run: str

    @property
    def exhausted(self) -> bool:
        """Whether it is given up."""
        return all(mark.exists() for mark in self._mark_files())

    def begin(self) -> bool:
        """Leave a mark; False if the limit is reached.

        Raises:
            OutputError: It cannot be written.
        """
        for mark in self._mark_files():
            try:
                mark.parent.mkdir(parents=True, exist_ok=True)
                mark.touch(exist_ok=False)
            except FileExistsError:
                continue
            except OSError as fault:
                message = f"the lake cannot be written ({fault.strerror})"
                raise OutputError(message, where=str(mark)) from fault
            return True
        return False

    def exhaust(self) -> None:
        """Give it up: leave as many marks as the limit.

        Raises:
            OutputError: They cannot be written.
        """
        while self.begin():
            pass

    def clear(self) -> None:
        """Remove all marks, after a worker finished or to try again."""
        for mark in self._mark_files():
            mark.unlink(missing_ok=True)

    def _mark_files(self) -> list[Path]:
        return [self.lake / FOLDER / f"{self.run}.{n}" for n in range(1, MAX_ATTEMPTS + 1)]


def forget_interrupted(lake: Path, *, include_failed: bool = False) -> None:
    """Remove the marks of clips that were merely in progress when filling was stopped.

    Args:
        lake: Folder of the lake; no other process is filling it.
        include_failed: Whether to remove those of clips put aside, too.
    """
    marks = sorted((lake / FOLDER).glob("*.*"))
    for run in {mark.stem for mark in marks}:
        attempts = Attempts(lake, run)
        if include_failed or not attempts.exhausted:
            attempts.clear()
