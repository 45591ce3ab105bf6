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
MEASURED = np.array([0.07, 0.07, 0.09, 0.09])
"""Measurement noise of a detector: centre (x, y) and size (w, h), standard deviations in box sizes."""
SPEED = np.array([0.25, 0.12, 0.0, 0.0])
"""Prior deviation of the velocity, sizes per frame: at seven frames per second people walk 0.2."""
TURNS = np.array([0.03, 0.02, 0.0, 0.0])
"""Process noise of the velocity per frame."""
DRIFTS = np.array([0.02, 0.02, 0.03, 0.03])
"""Process noise of position and size per frame."""


@dataclass(frozen=True, slots=True, eq=False)
class BoxState:
    """The state of a box; the columns of each array are x, y of the centre, width, height.

    Attributes:
        place: (4,) pixels.
        speed: (4,) pixels per frame.
        spread: (3, 4) variance of position, covariance with speed, variance of speed; pixels squared.
    """

    place: Floats
    speed: Floats
    spread: Floats

    @property
    def box(self) -> Box:
        """(x, y, width, height), pixels."""
        x, y, w, h = self.place.tolist()
        return x - w / 2, y - h / 2, w, h

    @property
    def size(self) -> float:
        """The side of a square of the same area, pixels."""
        return float(np.sqrt(max(self.place[2] * self.place[3], 1.0)))


def middle_and_size(box: Box) -> Floats:
    """(4,) x and y of the centre, width, height."""
    x, y, w, h = box
    return np.array([x + w / 2, y + h / 2, w, h])


def begun(box: Box) -> BoxState:
    """The state after a first box."""
    place = middle_and_size(box)
    size = float(np.sqrt(box[2] * box[3]))
    none = np.zeros(4)
    return BoxState(place, none, np.array([(MEASURED * size) ** 2, none, (SPEED * size) ** 2]))


def expected(state: BoxState, frames: int) -> BoxState:
    """Predict the state some frames ahead."""
    place, speed, (variance_of_place, covariance, rate) = state.place, state.speed, state.spread
    turns, drifts = (TURNS * state.size) ** 2, (DRIFTS * state.size) ** 2
    for _ in range(frames):
        place = place + speed
        variance_of_place = variance_of_place + 2 * covariance + rate + drifts
        covariance = covariance + rate
        rate = rate + turns
    return BoxState(place, speed, np.array([variance_of_place, covariance, rate]))


def innovation(state: BoxState, box: Box) -> tuple[Floats, Floats]:
    """Innovation of a box and its variance; (4,) each, pixels and pixels squared."""
    return middle_and_size(box) - state.place, state.spread[0] + (MEASURED * state.size) ** 2


def updated(state: BoxState, box: Box) -> BoxState:
    """Update a predicted state with a box."""
    off, variance = innovation(state, box)
    variance_of_place, covariance, rate = state.spread
    gain, pull = variance_of_place / variance, covariance / variance
    spread = np.array(
        [variance_of_place * (1 - gain), covariance * (1 - gain), rate - covariance * pull]
    )
    return BoxState(state.place + gain * off, state.speed + pull * off, spread)
