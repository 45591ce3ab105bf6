"""While nothing changes motion rests; what comes is seen as soon as by eyes that never rest."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.clips import moving_disc
from visup.agent import Frame
from visup.agent.cycle.agent import Agent
from visup.percepts.health import HealthBehaviour
from visup.percepts.motion.behaviour import MotionBehaviour
from visup.percepts.motion.pausing import CALM_S, PausingMotionBehaviour
from visup.percepts.motion.segmenter import MotionSegmenter

FPS = 5.0
EMPTY_S = 20


def pictures() -> list[NDArray[np.uint8]]:
    """Nothing for long, then something crosses; with the noise of a camera."""
    rng = np.random.default_rng(5)
    crossing = moving_disc(60, (160, 120))
    empty = np.asarray(np.median(np.stack(crossing), axis=0), np.uint8)
    clean = [empty] * round(EMPTY_S * FPS) + crossing[::2]
    noise = [rng.normal(0.0, 2.0, empty.shape) for _ in range(7)]
    return [np.clip(image + noise[i % 7], 0, 255).astype(np.uint8) for i, image in enumerate(clean)]


PICTURES = pictures()


class Watched:
    """An agent with such eyes; how often they looked, and when something was seen."""

    def __init__(self, eyes: MotionBehaviour, monkeypatch: pytest.MonkeyPatch) -> None:
        self.looks: list[float] = []
        look = MotionSegmenter.step

        def counted(segmenter: MotionSegmenter, frame: Frame, *rest: object) -> object:
            self.looks.append(frame.time)
            return look(segmenter, frame, *rest)  # type: ignore[arg-type]

        monkeypatch.setattr(MotionSegmenter, "step", counted)
        agent = Agent([HealthBehaviour(), eyes])
        self.seen = [f.time for f in self._frames() if agent.step(f).observation.of("region")]
        monkeypatch.undo()

    def _frames(self) -> list[Frame]:
        return [Frame(i, i / FPS, image) for i, image in enumerate(PICTURES)]


def test_it_rests_and_sees_what_comes_as_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    always = Watched(MotionBehaviour(), monkeypatch)
    pausing = Watched(PausingMotionBehaviour(4.0), monkeypatch)
    idle = [t for t in pausing.looks if t < EMPTY_S]
    assert len([t for t in always.looks if t < EMPTY_S]) == EMPTY_S * FPS
    assert len(idle) <= (CALM_S + 1.0) * FPS + (EMPTY_S - CALM_S) / 4.0
    assert always.seen
    assert pausing.seen
    assert min(always.seen) >= EMPTY_S
    assert min(pausing.seen) - min(always.seen) <= 2.0 / FPS
    assert len(pausing.seen) >= 0.8 * len(always.seen)


def test_it_goes_on_as_it_was_saved() -> None:
    whole, first = PausingMotionBehaviour(4.0), PausingMotionBehaviour(4.0)
    agents = [Agent([one]) for one in (whole, first)]
    frames = [Frame(i, i / FPS, image) for i, image in enumerate(PICTURES[:60])]
    for frame in frames[:40]:
        for agent in agents:
            agent.step(frame)
    again = PausingMotionBehaviour(4.0)
    again.load(first.save())
    resumed = Agent([again])
    for frame in frames[40:]:
        assert (
            agents[0].perceive(frame).reports[0].percepts
            == resumed.perceive(frame).reports[0].percepts
        )
    assert again._looked == whole._looked
