"""Consecutive runs with the same agent, so that no beliefs are lost.

The next run has its journal and checkpoint before its first step, so that a process killed in between resumes
one or the other. The files of the old run are finished in the background.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from visup.agent import TaskBelief
from visup.runs.checkpoints import CheckpointWriter
from visup.runs.recorder import Recorder
from visup.runs.result import RunResult
from visup.runs.settings import RunOptions

ROLLED = "rolled"
"""Value of the fact `ended` for a run followed by another, which `next_run` names."""

RETRY_S = 60.0
"""Seconds between attempts to start the next run."""


class RunFolders(Protocol):
    """Provides the folders for the runs of a camera."""

    def next_folder(self) -> Path:
        """A folder for a further run, not yet created.

        Raises:
            OutputError: It cannot be created.
        """
        ...

    def set_current(self, run: Path) -> None:
        """Make a process that starts from now on resume this run.

        Raises:
            OutputError: It cannot be recorded.
        """
        ...


class RollOver:
    """Decides when the next run begins, and finishes the files of earlier runs.

    Args:
        options: Options of the run.
    """

    def __init__(self, options: RunOptions) -> None:
        self._run_s, self._run_bytes = options.run_s, options.run_bytes
        self._started: float | None = None
        self._retry_at = 0.0
        self._closing: list[threading.Thread] = []

    def due(self, time_s: float, size: int) -> bool:
        """Whether the next run is due.

        Args:
            time_s: Time of the step, seconds of the source.
            size: Size of the journal, bytes.
        """
        self._started = time_s if self._started is None else self._started
        if time_s < self._retry_at:
            return False
        long = self._run_s is not None and time_s - self._started >= self._run_s
        return long or (self._run_bytes is not None and size >= self._run_bytes)

    def begun(self, time_s: float) -> None:
        """Record that the next run has begun."""
        self._started = time_s

    def failed(self, time_s: float) -> None:
        """Record that it could not begin."""
        self._retry_at = time_s + RETRY_S

    def finish_files(
        self,
        recorder: Recorder,
        checkpoints: CheckpointWriter,
        result: RunResult,
        tasks: Sequence[TaskBelief],
    ) -> None:
        """Finish the files of a run in a separate thread."""

        def close() -> None:
            checkpoints.close()
            recorder.finish(result, ROLLED, tasks)
            recorder.close()

        thread = threading.Thread(target=close, name="books", daemon=True)
        thread.start()
        self._closing = [*(t for t in self._closing if t.is_alive()), thread]

    def wait(self, seconds: float) -> None:
        """Wait for the files being finished."""
        for thread in self._closing:
            thread.join(seconds)
