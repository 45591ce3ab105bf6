"""Where a box is expected: a Kalman filter held against its textbook form in matrices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.percepts.detections.box_filter import (
    DRIFTS,
    MEASURED,
    TURNS,
    begun,
    expected,
    innovation,
    middle_and_size,
    updated,
)

BOXES = st.tuples(st.floats(0, 80), st.floats(0, 80), st.floats(5, 40), st.floats(5, 40))


@given(BOXES, BOXES, st.integers(1, 5))
def test_as_the_filter_in_matrices(
    first: tuple[float, ...], second: tuple[float, ...], frames: int
) -> None:
    start = begun(first)  # type: ignore[arg-type]
    got = updated(expected(start, frames), second)  # type: ignore[arg-type]
    for k in range(4):
        x = np.array([start.place[k], start.speed[k]])
        p = np.array(
            [[start.spread[0][k], start.spread[1][k]], [start.spread[1][k], start.spread[2][k]]]
        )
        step = np.array([[1.0, 1.0], [0.0, 1.0]])
        q = np.diag([(DRIFTS[k] * start.size) ** 2, (TURNS[k] * start.size) ** 2])
        for _ in range(frames):
            x, p = step @ x, step @ p @ step.T + q
        r = (MEASURED[k] * expected(start, frames).size) ** 2
        gain = p[:, 0] / (p[0, 0] + r)
        x = x + gain * (middle_and_size(second)[k] - x[0])  # type: ignore[arg-type]
        p = p - np.outer(gain, p[0])
        assert [got.place[k], got.speed[k]] == pytest.approx(x.tolist())
        assert got.spread[:, k] == pytest.approx([p[0, 0], p[0, 1], p[1, 1]], abs=1e-9)


def test_what_goes_on_evenly_is_expected_ever_more_exactly() -> None:
    state = begun((0.0, 0.0, 10.0, 20.0))
    for k in range(1, 20):
        state = updated(expected(state, 1), (2.0 * k, 0.0, 10.0, 20.0))
    off, variance = innovation(expected(state, 1), (40.0, 0.0, 10.0, 20.0))
    assert np.abs(off).max() < 0.2
    assert (
        variance[0] < innovation(expected(begun((0.0, 0.0, 10.0, 20.0)), 1), (0, 0, 10, 20))[1][0]
    )
