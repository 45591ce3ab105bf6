"""How many frames a second this machine can look at, measured on the source itself."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import islice
from statistics import median

from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent, open_video


@dataclass(frozen=True, slots=True)
class Speed:
    """What was measured.

    Attributes:
        possible: Frames a second that can be looked at, where nothing else is done.
        wanted: Frames a second that the settings ask for.
    """

    possible: float
    wanted: float

    @property
    def load(self) -> float:
        """The number of processors that the requested frame rates take.

        >>> Speed(possible=20.0, wanted=5.0).load
        0.25
        """
        return self.wanted / self.possible


def measured_speed(settings: WatchSettings, frames: int) -> Speed:
    """Look at the first frames of a source as a run would.

    Args:
        settings: Of the run.
        frames: How many are looked at; of the first third the time does not count, since loops are
            compiled there.

    Raises:
        VisupError: No such run can begin.
    """
    took = []
    agent = build_agent(settings)
    try:
        with open_video(settings) as video:
            for frame in islice(video, frames):
                begin = time.perf_counter()
                agent.step(frame)
                took.append(time.perf_counter() - begin)
            wanted = video.fps / video.every
    finally:
        agent.close()
    return Speed(1.0 / median(took[len(took) // 3 :]), wanted)
