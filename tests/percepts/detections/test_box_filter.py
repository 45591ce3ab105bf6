"""Where a box is expected: a Kalman filter held against its textbook form in matrices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.percepts.detections.box_filter import (
    ACCELERATION_NOISE,
    BOX_NOISE,
    MEASUREMENT_NOISE,
    centre_and_size,
    corrected,
    initial_state,
    innovation,
    predicted,
)

BOXES = st.tuples(st.floats(0, 80), st.floats(0, 80), st.floats(5, 40), st.floats(5, 40))


@given(BOXES, BOXES, st.integers(1, 5))
def test_as_the_filter_in_matrices(
    first: tuple[float, ...], second: tuple[float, ...], frames: int
) -> None:
    start = initial_state(first)  # type: ignore[arg-type]
    got = corrected(predicted(start, frames), second)  # type: ignore[arg-type]
    for k in range(4):
        x = np.array([start.mean[k], start.velocity[k]])
        p = np.array(
            [
                [start.covariance[0][k], start.covariance[1][k]],
                [start.covariance[1][k], start.covariance[2][k]],
            ]
        )
        step = np.array([[1.0, 1.0], [0.0, 1.0]])
        q = np.diag([(BOX_NOISE[k] * start.size) ** 2, (ACCELERATION_NOISE[k] * start.size) ** 2])
        for _ in range(frames):
            x, p = step @ x, step @ p @ step.T + q
        r = (MEASUREMENT_NOISE[k] * predicted(start, frames).size) ** 2
        gain = p[:, 0] / (p[0, 0] + r)
        x = x + gain * (centre_and_size(second)[k] - x[0])  # type: ignore[arg-type]
        p = p - np.outer(gain, p[0])
        assert [got.mean[k], got.velocity[k]] == pytest.approx(x.tolist())
        assert got.covariance[:, k] == pytest.approx([p[0, 0], p[0, 1], p[1, 1]], abs=1e-9)


def test_what_goes_on_evenly_is_expected_ever_more_exactly() -> None:
    state = initial_state((0.0, 0.0, 10.0, 20.0))
    for k in range(1, 20):
        state = corrected(predicted(state, 1), (2.0 * k, 0.0, 10.0, 20.0))
    off, variance = innovation(predicted(state, 1), (40.0, 0.0, 10.0, 20.0))
    assert np.abs(off).max() < 0.2
    assert (
        variance[0]
        < innovation(predicted(initial_state((0.0, 0.0, 10.0, 20.0)), 1), (0, 0, 10, 20))[1][0]
    )
