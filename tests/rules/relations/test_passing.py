"""Outlines shift while a third body passes by, which is no trend of two bodies that hardly move."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import Truth
from visup.rules.relations._kinematics_jit import covered_pairs

FPS, FAST, NEAR, CHANGE = 25.0, 10.0, 30.0, 8.0
velocities = st.floats(-15, 15) | st.just(float("nan"))
distances = st.floats(-50, 100) | st.just(float("nan"))


@st.composite
def histories(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """(T, M, M) distances of the hulls, and (M, 2) velocities."""
    times, count = draw(st.integers(0, 4)), draw(st.integers(0, 4))
    half = np.triu(draw(arrays(float, (times, count, count), elements=distances)), 1)
    return half + np.swapaxes(half, 1, 2), draw(arrays(float, (count, 2), elements=velocities))


def by_sentences(apart: np.ndarray, velocity: np.ndarray) -> list[bool]:
    """The same pair by pair, word by word."""

    def slow(of: np.ndarray) -> bool:
        return bool(np.hypot(*of) < FAST)

    def passes(i: int, third: int) -> bool:
        known = [x for x in apart[:, i, third].tolist() if x == x]
        near = bool(known) and min(known) < NEAR
        moves = not slow(velocity[i] - velocity[third])
        return near and (moves or max(known) - min(known) > CHANGE)

    count = len(velocity)
    return [
        slow(velocity[i])
        and slow(velocity[j])
        and any(passes(i, k) or passes(j, k) for k in range(count) if k not in (i, j))
        for i in range(count)
        for j in range(i + 1, count)
    ]


@given(histories())
def test_pairs_beside_a_third_body_that_moves(history: tuple[np.ndarray, np.ndarray]) -> None:
    apart, velocity = history
    found = covered_pairs(apart, velocity, (FAST, NEAR, CHANGE))
    assert found.tolist() == by_sentences(apart, velocity)


def converging(speed: float, passing: float | None, seconds: float = 2.4) -> Truth:
    """Whether two boxes converge, of which one moves while a third one passes it, or is away; px/s."""
    boxes = []
    for i in range(round(seconds * FPS)):
        now = i / FPS
        scene = [
            box_region(1, (100, 200, 80, 60)),
            box_region(2, (300 - speed * now, 200, 80, 60)),
        ]
        if passing is not None:
            scene.append(box_region(3, (240 + passing * now, 135, 40, 60)))
        boxes.append(seen(i, scene, FPS))
    found = reason(boxes)[-1].mind.relation("converging", 1, 2)
    assert found is not None
    return found.truth


@pytest.mark.parametrize(
    ("speed", "passing", "expected"),
    [
        (4.0, None, Truth.TRUE),
        (4.0, 0.0, Truth.TRUE),
        (4.0, 40.0, Truth.FALSE),
        (25.0, None, Truth.TRUE),
        (25.0, 40.0, Truth.TRUE),
    ],
)
def test_a_slow_shift_beside_a_body_that_passes_is_no_approach(
    speed: float, passing: float | None, expected: Truth
) -> None:
    assert converging(speed, passing) is expected
