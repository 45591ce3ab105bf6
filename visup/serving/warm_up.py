"""What a process does that has no job yet: what cameras need is loaded, and compiled loops with it."""

from __future__ import annotations

import select
import sys
from contextlib import suppress
from itertools import islice

from visup.agent.model.errors import VisupError
from visup.runs.demo import demo_settings
from visup.runs.wiring import build_agent, open_video

FRAMES = 12
"""Of the shipped clip: in these there is something that moves, is followed and is recognised."""


def warm_up() -> None:
    """Look at some frames of the shipped clip, as long as no job is there."""
    with suppress(VisupError):
        settings = demo_settings()
        agent = build_agent(settings)
        try:
            with open_video(settings) as video:
                for frame in islice(video, FRAMES):
                    if has_job():
                        return
                    agent.step(frame)
        finally:
            agent.close()


def has_job() -> bool:
    """Whether something was written to standard input, or nobody will."""
    return bool(select.select([sys.stdin], [], [], 0.0)[0])
