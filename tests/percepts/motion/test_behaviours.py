from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import pytest

from tests.percepts.motion.clips import clip, texture
from visup.agent import (
    Behaviour,
    Frame,
    Health,
    HealthStatus,
    Observation,
    Percept,
    Region,
    Report,
    ReportState,
)
from visup.percepts.health import HealthBehaviour
from visup.percepts.motion.behaviour import MotionBehaviour

Change = Callable[[np.ndarray, int, np.random.Generator], np.ndarray]


def seen_with(status: HealthStatus, frame: Frame) -> Observation:
    percept = Percept("health", Health(status), frame.time, "health")
    report = Report("health", ReportState.RAN, ("health",), (percept,))
    return Observation(frame.index, frame.time, frame.size, (report,))


@cache
def moving() -> tuple[Frame, ...]:
    disc = (lambda n: (60 + 2.0 * n, 80.0), 24.0, texture(2, (320, 480), 0, 255))
    return tuple(s.frame for s in clip(texture(1, (320, 480)), lambda n: (20, 30), [disc], 40))


@cache
def sky() -> tuple[Frame, ...]:
    disc = (lambda n: (100 + 0.06 * n, 80.0), 20.0, texture(2, (320, 480), 60, 255))
    dark = np.full((320, 480), 4, np.uint8)
    return tuple(s.frame for s in clip(dark, lambda n: (0, 0), [disc], 40))


def test_motion_reports_regions_and_none_when_the_image_is_not_to_be_trusted() -> None:
    behaviour = MotionBehaviour()
    assert isinstance(behaviour, Behaviour)
    told = [list(behaviour.perceive(f, seen_with(HealthStatus.OK, f), ())) for f in moving()]
    assert any(told)
    for frame, percepts in zip(moving(), told, strict=True):
        for p in percepts:
            assert (p.kind, p.source, p.time) == ("region", "motion", frame.time)
            assert isinstance(p.value, Region)
    blind = MotionBehaviour()
    for frame in moving():
        assert not list(blind.perceive(frame, seen_with(HealthStatus.BLOCKED, frame), ()))


def drifting() -> list[Frame]:
    disc = (lambda n: (60 + 0.5 * n, 80.0), 24.0, texture(2, (320, 480), 0, 255))
    return [s.frame for s in clip(texture(1, (320, 480)), lambda n: (20, 30), [disc], 50)]


def test_slow_regions_keep_their_ids_over_a_fault() -> None:
    motion, health = MotionBehaviour(), HealthBehaviour()
    told = []
    for frame in drifting():
        dark = 30 <= frame.index < 42
        image = np.zeros_like(frame.image) if dark else frame.image
        shown = Frame(frame.index, frame.time, image)
        percepts = tuple(
            health.perceive(shown, Observation(frame.index, frame.time, frame.size), ())
        )
        report = Report("health", ReportState.RAN, ("health",), percepts)
        seen = Observation(frame.index, frame.time, frame.size, (report,))
        told.append([p.value.id for p in motion.perceive(shown, seen, ())])
    assert told[29]
    assert not any(told[30:42])
    assert told[42] == told[29], told


def statuses(frames: Sequence[Frame], change: Change, start: int = 15) -> list[HealthStatus]:
    behaviour = HealthBehaviour()
    rng = np.random.default_rng(3)
    out = []
    for n, f in enumerate(frames):
        image = change(f.image, n - start, rng) if n >= start else f.image
        frame = Frame(f.index, f.time, np.asarray(image, dtype=np.uint8))
        nothing = Observation(frame.index, frame.time, frame.size)
        (percept,) = behaviour.perceive(frame, nothing, ())
        out.append(percept.value.status)
    return out


def noisy(image: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    return np.clip(image + rng.normal(0, 60, image.shape), 0, 255)


def shuffled(image: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    blocks = [
        image[y : y + 16, x : x + 16] + 0
        for y in range(0, image.shape[0], 16)
        for x in range(0, image.shape[1], 16)
    ]
    out = image.copy()
    order = rng.permutation(len(blocks))
    for i, (y, x) in enumerate(
        (y, x) for y in range(0, image.shape[0], 16) for x in range(0, image.shape[1], 16)
    ):
        out[y : y + 16, x : x + 16] = blocks[order[i]]
    return out


class Freeze:
    def __init__(self) -> None:
        self.kept: np.ndarray | None = None

    def __call__(self, image: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
        if self.kept is None:
            self.kept = image
        return self.kept


def half(image: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    out = image.copy()
    out[:, : out.shape[1] * 3 // 4] = 90
    return out


@pytest.mark.parametrize(
    ("change", "status"),
    [
        (lambda image, n, rng: np.zeros_like(image), HealthStatus.DARK),
        (lambda image, n, rng: np.full_like(image, 255), HealthStatus.SATURATED),
        (noisy, HealthStatus.NOISY),
        (Freeze(), HealthStatus.FROZEN),
        (half, HealthStatus.BLOCKED),
        (shuffled, HealthStatus.SCRAMBLED),
    ],
)
def test_each_fault_is_told_within_a_second(change: Change, status: HealthStatus) -> None:
    told = statuses(moving(), change)
    assert set(told[:15]) == {HealthStatus.OK}
    assert told[-1] is status


@pytest.mark.parametrize("frames", [moving, sky])
def test_unharmed_video_is_well(frames: Callable[[], Sequence[Frame]]) -> None:
    assert set(statuses(frames(), lambda image, n, rng: image)) == {HealthStatus.OK}


def test_a_still_image_from_the_start_is_not_called_frozen() -> None:
    still = [Frame(n, n / 25, moving()[0].image) for n in range(40)]
    assert set(statuses(still, lambda image, n, rng: image)) == {HealthStatus.OK}
