"""Motion that rests while nothing in the picture changes: most cameras see nothing for most of the day.

A look at a small picture, a hundredth of the cost, tells whether anything is other than when all was last
looked at. While nothing is, and nothing was seen to move, nothing moves.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Directive, Frame, Observation, Percept
from visup.percepts.motion.behaviour import MotionBehaviour

CELL = 8
"""Pixels of a side that are averaged: noise goes, and what covers a quarter of one is seen."""

CHANGE = 5
"""From so many levels of a colour on a cell is other than it was: noise of a camera leaves two or three."""

CALM_S = 5.0
"""Motion rests once nothing has changed or moved for so long, seconds."""


class RestingMotion(MotionBehaviour):
    """Reports regions; looks seldom while nothing changes.

    Args:
        rest_s: Seconds between two looks while nothing changes.
    """

    contract = MotionBehaviour.contract

    def __init__(self, rest_s: float) -> None:
        super().__init__()
        self._rest_s = rest_s
        self._last: NDArray[np.uint8] | None = None
        self._looked = self._moved = 0.0

    def save(self) -> Mapping[str, Any]:
        """All that is remembered of the frames so far."""
        rest = {"last": self._last, "looked": self._looked, "moved": self._moved}
        return {**super().save(), "rest": rest}

    def load(self, state: Mapping[str, Any]) -> None:
        """Take on what a behaviour of the same settings remembered."""
        super().load(state)
        rest = state["rest"]
        self._last, self._looked, self._moved = rest["last"], rest["looked"], rest["moved"]

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the regions of one frame; none, without a look, while nothing changes."""
        small = means_of_cells(frame.image)
        if self._last is None or _differ(self._last, small):
            self._moved = frame.time
        calm = frame.time - self._moved > CALM_S
        if calm and not directives and frame.time - self._looked < self._rest_s:
            return []
        found = list(super().perceive(frame, observation, directives))
        self._last, self._looked = small, frame.time
        if found:
            self._moved = frame.time
        return found


def means_of_cells(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A small picture: means over cells of `CELL` x `CELL` pixels.

    Args:
        image: (H, W, 3) uint8.
    """
    height, width = image.shape[:2]
    size = max(1, width // CELL), max(1, height // CELL)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _differ(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    return a.shape != b.shape or int(cv2.absdiff(a, b).max()) >= CHANGE
