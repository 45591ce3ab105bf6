"""The report of a replay, with frames of the video if it still exists, else with outlines only."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from visup.agent import Frame, Verdict
from visup.agent.model.errors import ExtraMissingError, VisupError
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.agent.storage.jsonable import to_jsonable
from visup.report.collector import Collector
from visup.runs.settings import WatchSettings
from visup.runs.wiring import open_video
from visup.tasks import load_tasks
from visup.tasks.tools.outline import outline
from visup.version import __version__

GREY = 96
"""Background for outlines if the video is missing, grey level 0 to 255."""


class ReplayReport:
    """Collects the data for the report of a replay; call it with each step, and `write` at the end.

    Args:
        recording: The recorded run.
        settings: Settings of the replay.
    """

    def __init__(self, recording: Recording, settings: WatchSettings) -> None:
        source_facts = {
            k: v for k, v in recording.facts().items() if k in ("source", "fps", "size", "live")
        }
        replay_facts = {"visup": __version__, "settings": to_jsonable(settings)}
        self._facts = {**source_facts, **replay_facts, "replayed": str(recording.path)}
        self._settings = settings
        self._collector = Collector()
        self._stack = ExitStack()
        self._frames: Iterator[Frame] = iter(())
        self._next_frame: Frame | None = None
        self.notes: tuple[str, ...] = ()

    def __enter__(self) -> Self:
        path = Path(self._settings.source)
        if path.exists() and not path.is_char_device():
            try:
                self._frames = iter(self._stack.enter_context(open_video(self._settings)))
                self._next_frame = next(self._frames, None)
            except VisupError:
                self._next_frame = None
        if self._next_frame is None:
            self.notes = ("The video is no longer available: pictures show outlines only.",)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.close()

    def __call__(self, step: Step) -> None:
        """Add one step."""
        self._collector.add(step, self._frame(step))

    def write(self, folder: Path, verdict: Verdict | None) -> Path | None:
        """Write `report.html`.

        Args:
            folder: Folder of the new run.
            verdict: The verdict.

        Returns:
            The file; None if the extra for reports is missing.

        Raises:
            OutputError: It cannot be written.
        """
        from visup.report.page.html import write_report

        task_trees = [outline(t) for name in self._settings.tasks for t in load_tasks(name)]
        collected = self._collector.finish(
            verdict, self._facts, problem=None, notes=self.notes, task_trees=task_trees
        )
        try:
            write_report(collected, folder / "report.html")
        except ExtraMissingError as missing:
            self.notes = (*self.notes, str(missing))
            return None
        return folder / "report.html"

    def _frame(self, step: Step) -> Frame:
        """The frame of a step, or a grey one."""
        while self._next_frame is not None and self._next_frame.index < step.frame_index:
            self._next_frame = next(self._frames, None)
        width, height = step.mind.frame_size
        frame = self._next_frame
        if frame is not None and frame.index == step.frame_index and frame.size == (width, height):
            return Frame(step.frame_index, step.time, frame.image)
        image = np.full((height, width, 3), GREY, np.uint8)
        return Frame(step.frame_index, step.time, image)
