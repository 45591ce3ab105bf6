"""Motion segmentation that pauses while nothing in the image changes, as in most cameras most of the time.

A change detector on cell means, at a hundredth of the cost, decides whether the image differs from that of
the last full step. While it does not and nothing moved, no regions are reported.
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
"""Side of an averaged cell, pixels: noise averages out; a change over a quarter of a cell still shows."""

CHANGE = 5
"""Levels of a colour channel from which a cell has changed: camera noise causes two or three."""

CALM_S = 5.0
"""Segmentation pauses once nothing has changed or moved for this many seconds."""


class PausingMotionBehaviour(MotionBehaviour):
    """Reports regions; runs seldom while nothing changes.

    Args:
        rest_s: Seconds between two steps while nothing changes.
    """

    contract = MotionBehaviour.contract

    def __init__(self, rest_s: float) -> None:
        super().__init__()
        self._rest_s = rest_s
        self._last: NDArray[np.uint8] | None = None
        self._looked = self._moved = 0.0

    def save(self) -> Mapping[str, Any]:
        """The state after the frames so far."""
        rest = {"last": self._last, "looked": self._looked, "moved": self._moved}
        return {**super().save(), "rest": rest}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a behaviour with the same settings."""
        super().load(state)
        rest = state["rest"]
        self._last, self._looked, self._moved = rest["last"], rest["looked"], rest["moved"]

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the regions of one frame; none, without segmentation, while nothing changes."""
        small = cell_means(frame.image)
        if self._last is None or _have_changed(self._last, small):
            self._moved = frame.time
        calm = frame.time - self._moved > CALM_S
        if calm and not directives and frame.time - self._looked < self._rest_s:
            return []
        found = list(super().perceive(frame, observation, directives))
        self._last, self._looked = small, frame.time
        if found:
            self._moved = frame.time
        return found


def cell_means(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A small image: means over cells of `CELL` x `CELL` pixels.

    Args:
        image: (H, W, 3) uint8.
    """
    height, width = image.shape[:2]
    size = max(1, width // CELL), max(1, height // CELL)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _have_changed(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> bool:
    return a.shape != b.shape or int(cv2.absdiff(a, b).max()) >= CHANGE
