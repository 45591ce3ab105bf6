"""An image that stands still under fresh noise is told from a scene in which hardly anything moves."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.percepts.motion.clips import texture
from visup.agent import Frame, HealthStatus
from visup.evaluation.health.runner import statuses
from visup.percepts.health.frozen_under_noise import change_statistics
from visup.percepts.health.image_quality import measure_quality

SIZE = (320, 480)
START, LENGTH, FPS = 20, 50, 25.0
GROUND = cv2.resize(texture(1, (80, 120), 20, 230), SIZE[::-1]).astype(np.float32)


def changed_share(rng: np.random.Generator) -> np.ndarray:
    """The ground as a codec leaves it: a little off, and alike in neighbouring pixels."""
    off = rng.normal(0, 1.2, (40, 60)).astype(np.float32)
    return np.asarray(GROUND + cv2.resize(off, SIZE[::-1]))


def frames(images: list[np.ndarray]) -> list[Frame]:
    return [
        Frame(n, n / FPS, np.repeat(np.clip(np.rint(i), 0, 255).astype(np.uint8)[..., None], 3, 2))
        for n, i in enumerate(images)
    ]


def told(images: list[np.ndarray]) -> set[HealthStatus]:
    return {s for _, s in statuses(frames(images))} - {HealthStatus.OK}


@pytest.mark.parametrize("sigma", [0.3, 0.8])
def test_a_frozen_image_under_fresh_noise_is_told_though_nothing_had_moved(sigma: float) -> None:
    rng = np.random.default_rng(3)
    live = [changed_share(rng) for _ in range(START)]
    frozen = [live[-1] + rng.normal(0, sigma, SIZE) for _ in range(LENGTH - START)]
    assert told(live + frozen) == {HealthStatus.FROZEN}
    assert told(live + [changed_share(rng) for _ in frozen]) == set()


def test_a_camera_whose_own_noise_is_white_is_not_frozen_when_nothing_moves() -> None:
    rng = np.random.default_rng(4)
    assert told([GROUND + rng.normal(0, 1.5, SIZE) for _ in range(LENGTH)]) == set()


def test_what_moves_under_noise_that_has_just_come_is_not_frozen() -> None:
    rng = np.random.default_rng(5)
    live = [changed_share(rng) for _ in range(START)]
    ys, xs = np.mgrid[: SIZE[0], : SIZE[1]]
    images = []
    for n in range(LENGTH - START):
        glow = 60 * np.exp(-((xs - 150 - 2 * n) ** 2 + (ys - 160) ** 2) / 40.0**2)
        images.append(live[-1] + glow + rng.normal(0, 0.8, SIZE))
    assert told(live + images) == set()


@pytest.mark.parametrize("sigma", [0.5, 1.0, 1.5])
def test_the_change_of_white_noise_is_white_and_that_of_a_shift_is_not(sigma: float) -> None:
    rng = np.random.default_rng(6)
    one, two = (
        measure_quality(f.image) for f in frames([GROUND, GROUND + rng.normal(0, sigma, SIZE)])
    )
    change = change_statistics(one, two)
    assert change.median_ratio == pytest.approx(1.0, abs=0.15)
    assert change.is_white
    moved = measure_quality(frames([np.roll(GROUND, 1, axis=1)])[0].image)
    assert change_statistics(one, moved).median_ratio > 3
    assert not change_statistics(one, moved).is_white
    assert not change_statistics(one, one).is_white
