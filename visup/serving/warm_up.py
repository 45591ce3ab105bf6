"""What a process does that has no job yet: what cameras need is loaded, and compiled loops with it.

As a program (`python -m visup.serving.warm_up`) it has the loops compiled, so that no run waits for that.
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
"""Of the shipped clip: in these there is something that moves, is followed and is recognised."""


def warm_up(stop: Callable[[], bool] = lambda: False) -> None:
    """Look at some frames of the shipped clip.

    Args:
        stop: Asked before each frame whether there is something better to do.
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
    """Whether something was written to standard input, or nobody will."""
    return bool(select.select([sys.stdin], [], [], 0.0)[0])


if __name__ == "__main__":
    warm_up()
