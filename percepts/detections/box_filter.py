"""A Kalman filter for the position and size of a moving box.

One filter for each coordinate of the centre and the size, with constant velocity of the centre (Kalman 1960).
All noise is relative to the box's size, so that near and far objects behave alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.detections.boxes import Box

Floats = NDArray[np.float64]
MEASUREMENT_NOISE = np.array([0.07, 0.07, 0.09, 0.09])
"""Measurement noise of a detector: centre (x, y) and size (w, h), standard deviations in box sizes."""
INITIAL_SPEED_NOISE = np.array([0.25, 0.12, 0.0, 0.0])
"""Prior deviation of the velocity, sizes per frame: at seven frames per second people walk 0.2."""
ACCELERATION_NOISE = np.array([0.03, 0.02, 0.0, 0.0])
"""Process noise of the velocity per frame."""
BOX_NOISE = np.array([0.02, 0.02, 0.03, 0.03])
"""Process noise of position and size per frame."""


@dataclass(frozen=True, slots=True, eq=False)
class BoxState:
    """The state of a box; the columns of each array are x, y of the centre, width, height.

    Attributes:
        mean: (4,) pixels.
        velocity: (4,) pixels per frame.
        covariance: (3, 4) variance of position, covariance with speed, variance of speed; pixels squared.
    """

    mean: Floats
    velocity: Floats
    covariance: Floats

    @property
    def box(self) -> Box:
        """(x, y, width, height), pixels."""
        x, y, w, h = self.mean.tolist()
        return x - w / 2, y - h / 2, w, h

    @property
    def size(self) -> float:
        """The side of a square of the same area, pixels."""
        return float(np.sqrt(max(self.mean[2] * self.mean[3], 1.0)))


def centre_and_size(box: Box) -> Floats:
    """(4,) x and y of the centre, width, height."""
    x, y, w, h = box
    return np.array([x + w / 2, y + h / 2, w, h])


def initial_state(box: Box) -> BoxState:
    """The state after a first box."""
    mean = centre_and_size(box)
    size = float(np.sqrt(box[2] * box[3]))
    zeros = np.zeros(4)
    return BoxState(
        mean,
        zeros,
        np.array([(MEASUREMENT_NOISE * size) ** 2, zeros, (INITIAL_SPEED_NOISE * size) ** 2]),
    )


def predicted(state: BoxState, frames: int) -> BoxState:
    """Predict the state some frames ahead."""
    mean, velocity, (variance_of_place, covariance, variance_of_velocity) = (
        state.mean,
        state.velocity,
        state.covariance,
    )
    acceleration_noise, box_noise = (
        (ACCELERATION_NOISE * state.size) ** 2,
        (BOX_NOISE * state.size) ** 2,
    )
    for _ in range(frames):
        mean = mean + velocity
        variance_of_place = variance_of_place + 2 * covariance + variance_of_velocity + box_noise
        covariance = covariance + variance_of_velocity
        variance_of_velocity = variance_of_velocity + acceleration_noise
    return BoxState(mean, velocity, np.array([variance_of_place, covariance, variance_of_velocity]))


def innovation(state: BoxState, box: Box) -> tuple[Floats, Floats]:
    """Innovation of a box and its variance; (4,) each, pixels and pixels squared."""
    return centre_and_size(box) - state.mean, state.covariance[0] + (
        MEASUREMENT_NOISE * state.size
    ) ** 2


def corrected(state: BoxState, box: Box) -> BoxState:
    """Update a predicted state with a box."""
    residual, variance = innovation(state, box)
    variance_of_place, covariance, variance_of_velocity = state.covariance
    gain, velocity_gain = variance_of_place / variance, covariance / variance
    new_covariance = np.array(
        [
            variance_of_place * (1 - gain),
            covariance * (1 - gain),
            variance_of_velocity - covariance * velocity_gain,
        ]
    )
    return BoxState(
        state.mean + gain * residual, state.velocity + velocity_gain * residual, new_covariance
    )
