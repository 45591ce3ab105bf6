"""A stage of contact waits until one has slowed down at the other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from visup.agent import Event, Frame, Step
from visup.evaluation.machines.mask_regions import role_behaviours
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent

FPS = 15.0
BOAT, PIER = 1, 2
MEETS_S, STOPS_S, UNTIL_S = 3.0, 5.0, 8.0
SPEED = 60.0  # pixels a second

BERTH = """
<berth>     ::= <approach> <alongside>
<approach>  ::= converging(boat, pier)
<alongside> ::= touching(boat, pier) for 1 s
"""


def masks(stops_s: float) -> Callable[[int], NDArray[np.uint8]]:
    """A boat that comes from the left, passes before a pier from `MEETS_S` on, and stops there.

    Seen from above: its outline meets the pier's while it is still under way."""

    def mask(index: int) -> NDArray[np.uint8]:
        now = min(index / FPS, stops_s)
        out = np.zeros((240, 480), dtype=np.uint8)
        out[80:140, 260:440] = PIER
        right = round(260 + SPEED * (now - MEETS_S))
        out[120:170, max(0, right - 70) : max(0, right)] = BOAT
        return out

    return mask


def watched(folder: Path, text: str, stops_s: float) -> list[Event]:
    """The events of a task on these masks."""
    path = folder / "berth.task"
    path.write_text(text, encoding="utf-8")
    found: list[Event] = []

    def note(step: Step, frame: Frame) -> None:
        found.extend(step.events)

    settings = WatchSettings(source="drawn", tasks=(str(path),))
    eyes = role_behaviours(masks(stops_s), {"boat": BOAT, "pier": PIER}, FPS)
    agent = reasoning_agent(settings, (note,), eyes)
    blank = np.zeros((240, 480, 3), dtype=np.uint8)
    try:
        for index in range(round(UNTIL_S * FPS)):
            agent.step(Frame(index, index / FPS, blank))
    finally:
        agent.close()
    return found


def begun(events: list[Event], stage: str) -> float | None:
    """When a stage is reported to begin, seconds."""
    times = (e.time for e in events if e.kind == "stage_started" and e.data["stage"] == stage)
    return next(times, None)


@pytest.mark.parametrize("stops_s", [STOPS_S, 4.0])
def test_a_boat_is_alongside_when_it_stops_there(tmp_path: Path, stops_s: float) -> None:
    events = watched(tmp_path, BERTH, stops_s)
    approach, alongside = begun(events, "approach"), begun(events, "alongside")
    assert approach is not None
    assert approach < MEETS_S
    assert alongside is not None
    assert stops_s - 0.2 <= alongside <= stops_s + 0.7
