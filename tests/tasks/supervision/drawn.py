"""Watching rectangles drawn as masks: from outlines to the events of a task."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.agent import Event, Frame, Step
from visup.evaluation.machines.mask_regions import role_behaviours
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent

FPS = 15.0
SHAPE = (240, 480)

Mask = NDArray[np.uint8]
Box = tuple[float, float, float, float]
"""Left, top, width and height, pixels."""


def drawn(boxes: Mapping[int, Box]) -> Mask:
    """(240, 480) label image with rectangles, later ones in front."""
    out = np.zeros(SHAPE, dtype=np.uint8)
    for label, (x, y, width, height) in boxes.items():
        left, top = round(x), round(y)
        out[
            max(0, top) : max(0, top + round(height)), max(0, left) : max(0, left + round(width))
        ] = label
    return out


def watched(
    folder: Path,
    text: str,
    mask: Callable[[float], Mask],
    roles: Mapping[str, int],
    seconds: float,
) -> list[Event]:
    """The events of a task.

    Args:
        folder: An empty folder, for the task file.
        text: The task.
        mask: The label image at a time, seconds.
        roles: Actor -> label.
        seconds: Length.
    """
    path = folder / "drawn.task"
    path.write_text(text, encoding="utf-8")
    found: list[Event] = []

    def note(step: Step, frame: Frame) -> None:
        found.extend(step.events)

    settings = WatchSettings(source="drawn", tasks=(str(path),))
    eyes = role_behaviours(lambda index: mask(index / FPS), dict(roles), FPS)
    agent = reasoning_agent(settings, (note,), eyes)
    blank = np.zeros((*SHAPE, 3), dtype=np.uint8)
    try:
        for index in range(round(seconds * FPS)):
            agent.step(Frame(index, index / FPS, blank))
    finally:
        agent.close()
    return found


def first(events: list[Event], kind: str, stage: str) -> float | None:
    """When an event of a kind about a stage is first reported, seconds."""
    times = (e.time for e in events if e.kind == kind and e.data["stage"] == stage)
    return next(times, None)
