"""Consecutive runs with the same agent, so that no beliefs are lost.

The next run has a journal and a checkpoint of its own before the first step that it records, so that whoever
is killed in between goes on with the one or the other. Books of the old one are closed beside the watching.
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
"""How a run ended that is followed by another, in its fact `ended`; `next_run` names that."""

TRY_AGAIN_S = 60.0
"""Seconds until it is tried again, where the next run cannot be started."""


class RunPlaces(Protocol):
    """Where the runs of a camera go."""

    def place(self) -> Path:
        """A folder for a further run, not made yet.

        Raises:
            OutputError: There can be none.
        """
        ...

    def go_on_with(self, run: Path) -> None:
        """Make a process that starts from now on resume this run.

        Raises:
            OutputError: That cannot be noted.
        """
        ...


class RollOver:
    """Knows when the next run begins, and closes the books of those before it.

    Args:
        options: Of the run.
    """

    def __init__(self, options: RunOptions) -> None:
        self._run_s, self._run_bytes = options.run_s, options.run_bytes
        self._begun: float | None = None
        self._not_before = 0.0
        self._closing: list[threading.Thread] = []

    def due(self, time_s: float, size: int) -> bool:
        """Whether the next run is to begin.

        Args:
            time_s: Of the step, seconds of the source.
            size: Of the journal, bytes.
        """
        self._begun = time_s if self._begun is None else self._begun
        if time_s < self._not_before:
            return False
        long = self._run_s is not None and time_s - self._begun >= self._run_s
        return long or (self._run_bytes is not None and size >= self._run_bytes)

    def begun(self, time_s: float) -> None:
        """The next run has begun."""
        self._begun = time_s

    def failed(self, time_s: float) -> None:
        """It could not be begun."""
        self._not_before = time_s + TRY_AGAIN_S

    def close_books(
        self,
        recorder: Recorder,
        checkpoints: CheckpointWriter,
        result: RunResult,
        tasks: Sequence[TaskBelief],
    ) -> None:
        """Finish the files of a run that is followed by another, in a separate thread."""

        def close() -> None:
            checkpoints.close()
            recorder.finish(result, ROLLED, tasks)
            recorder.close()

        thread = threading.Thread(target=close, name="books", daemon=True)
        thread.start()
        self._closing = [*(t for t in self._closing if t.is_alive()), thread]

    def wait(self, seconds: float) -> None:
        """Wait for the books that are being closed."""
        for thread in self._closing:
            thread.join(seconds)
