"""Warms up a process that has no job yet: loads the modules and the compiled loops.

As a program (`python -m visup.serving.warm_up`) it compiles the loops, so that no run waits for that: the
whole shipped clip is watched in few frames, and a part of it as a moving camera would see it.
"""

from __future__ import annotations

import select
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import islice

import numpy as np

from visup.agent.model.errors import VisupError
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.runs.demo import demo_settings
from visup.runs.wiring import build_agent, open_video

FRAMES = 12
"""Frames of the shipped clip, enough for something to move, be tracked and be recognised."""
EVERY = 6  # frames of it from one to the next when all loops are to be compiled
PAN_FRAMES, PAN_PX = 12, 4
"""Frames of it as seen by a camera that pans, and pixels between two of them."""


def warm_up(
    stop: Callable[[], bool] = lambda: False, frames: int | None = FRAMES, every: int = 2
) -> None:
    """Process some frames of the shipped clip.

    Args:
        stop: Asked before each frame; True ends the warm-up.
        frames: How many; None for all.
        every: Frames of the clip from one to the next.
    """
    with suppress(VisupError):
        settings = demo_settings(every)
        agent = build_agent(settings)
        try:
            with open_video(settings) as video:
                for frame in islice(video, frames):
                    if stop():
                        return
                    agent.step(frame)
        finally:
            agent.close()


def warm_up_moving_camera() -> None:
    """Segment some frames of the shipped clip, each seen a little further to the right."""
    segmenter = MotionSegmenter()
    with suppress(VisupError), open_video(demo_settings()) as video:
        for number, frame in enumerate(islice(video, PAN_FRAMES)):
            left = number * PAN_PX
            right = frame.image.shape[1] - (PAN_FRAMES - number) * PAN_PX
            segmenter.step(replace(frame, image=np.ascontiguousarray(frame.image[:, left:right])))


def has_job() -> bool:
    """Whether standard input has data or is closed."""
    return bool(select.select([sys.stdin], [], [], 0.0)[0])


if __name__ == "__main__":
    warm_up(frames=None, every=EVERY)
    warm_up_moving_camera()
