"""A box that moves: where it is expected, how sure that is, and what a new box says of it.

A Kalman filter for each of the middle's place and the size, with constant velocity of the middle (Kalman
1960). All lengths are shares of the box's own size, so that near and far things are alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.detections.boxes import Box

Floats = NDArray[np.float64]
MEASURED = np.array([0.07, 0.07, 0.09, 0.09])
"""Standard deviation of what a detector says of the middle (x, y) and the size (w, h), shares of the size."""
SPEED = np.array([0.25, 0.12, 0.0, 0.0])
"""The same of a velocity that is not known yet, sizes a frame: at seven frames a second people walk 0.2."""
TURNS = np.array([0.03, 0.02, 0.0, 0.0])
"""How much a velocity changes from frame to frame."""
DRIFTS = np.array([0.02, 0.02, 0.03, 0.03])
"""How much place and size change beside that."""


@dataclass(frozen=True, slots=True, eq=False)
class BoxState:
    """What is known of a box; each array is of x, y of the middle, width, height.

    Attributes:
        place: (4,) pixels.
        speed: (4,) pixels a frame.
        spread: (3, 4) variances of place, of place with speed, and of speed; pixels squared.
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
    """(4,) x and y of the middle, width, height."""
    x, y, w, h = box
    return np.array([x + w / 2, y + h / 2, w, h])


def begun(box: Box) -> BoxState:
    """What one box says."""
    place = middle_and_size(box)
    size = float(np.sqrt(box[2] * box[3]))
    none = np.zeros(4)
    return BoxState(place, none, np.array([(MEASURED * size) ** 2, none, (SPEED * size) ** 2]))


def expected(state: BoxState, frames: int) -> BoxState:
    """What is expected some frames later."""
    place, speed, (own, both, rate) = state.place, state.speed, state.spread
    turns, drifts = (TURNS * state.size) ** 2, (DRIFTS * state.size) ** 2
    for _ in range(frames):
        place = place + speed
        own = own + 2 * both + rate + drifts
        both = both + rate
        rate = rate + turns
    return BoxState(place, speed, np.array([own, both, rate]))


def innovation(state: BoxState, box: Box) -> tuple[Floats, Floats]:
    """How far a box lies off, and the variance of that; (4,) each, pixels and pixels squared."""
    return middle_and_size(box) - state.place, state.spread[0] + (MEASURED * state.size) ** 2


def updated(state: BoxState, box: Box) -> BoxState:
    """What is known when a box was found where one was expected."""
    off, variance = innovation(state, box)
    own, both, rate = state.spread
    gain, pull = own / variance, both / variance
    spread = np.array([own * (1 - gain), both * (1 - gain), rate - both * pull])
    return BoxState(state.place + gain * off, state.speed + pull * off, spread)
