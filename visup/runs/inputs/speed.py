"""Measures the frame rate that this machine can process, on the source itself."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import islice
from statistics import median

from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent, open_video


@dataclass(frozen=True, slots=True)
class Speed:
    """A measured speed.

    Attributes:
        possible: Frames per second that can be processed on an idle machine.
        wanted: Frames per second that the settings request.
    """

    possible: float
    wanted: float

    @property
    def load(self) -> float:
        """The share of a processor that the requested frame rate needs.

        >>> Speed(possible=20.0, wanted=5.0).load
        0.25
        """
        return self.wanted / self.possible


def measured_speed(settings: WatchSettings, frames: int) -> Speed:
    """Process the first frames of a source as a run would.

    Args:
        settings: Settings of the run.
        frames: Number of frames; the first third does not count, since loops are compiled there.

    Raises:
        VisupError: The run cannot begin.
    """
    durations = []
    agent = build_agent(settings)
    try:
        with open_video(settings) as video:
            for frame in islice(video, frames):
                begin = time.perf_counter()
                agent.step(frame)
                durations.append(time.perf_counter() - begin)
            wanted = video.fps / video.every
    finally:
        agent.close()
    return Speed(1.0 / median(durations[len(durations) // 3 :]), wanted)
