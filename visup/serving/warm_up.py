"""Warms up a process that has no job yet: loads the modules and the compiled loops.

As a program (`python -m visup.serving.warm_up`) it compiles the loops, so that no run waits for that.
"""

from __future__ import annotations

import select
import sys
from collections.abc import Callable
from contextlib import suppress
from itertools import islice

from visup.agent.model.errors import VisupError
from visup.runs.demo import demo_settings
from visup.runs.wiring import build_agent, open_video

FRAMES = 12
"""Frames of the shipped clip, enough for something to move, be tracked and be recognised."""


def warm_up(stop: Callable[[], bool] = lambda: False) -> None:
    """Process some frames of the shipped clip.

    Args:
        stop: Asked before each frame; True ends the warm-up.
    """
    with suppress(VisupError):
        settings = demo_settings()
        agent = build_agent(settings)
        try:
            with open_video(settings) as video:
                for frame in islice(video, FRAMES):
                    if stop():
                        return
                    agent.step(frame)
        finally:
            agent.close()


def has_job() -> bool:
    """Whether standard input has data or is closed."""
    return bool(select.select([sys.stdin], [], [], 0.0)[0])


if __name__ == "__main__":
    warm_up()
