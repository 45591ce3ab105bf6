"""Standstill detection: parts of the image that stop or are covered at one moment.

A scene never stops, and is never covered, between two frames in many places at once; a freezing camera or a
cover does that. Gradual change is ignored.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.health.quantiles import quantiles

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

CELL = 10  # pixels of the small image along a cell
LAG_S = 0.2  # time over which slow motion shows, seconds
AFTER_S = 0.42  # how long the new state must have lasted, seconds
HISTORY_S = 1.0
MAX_FRAMES = 48  # most frames in the history, whatever the rate
FEWEST = 3  # fewest frames before the change
STILL_CHANGE = 1.0  # most total difference of a still part beyond noise, grey levels
MIN_JUMP = 1.0  # least jump, grey levels; codec keyframes change a dark scene by less


@dataclass(frozen=True, slots=True, eq=False)
class CellChange:
    """Change of one frame by cell.

    Attributes:
        time: Seconds.
        small: (h, w) float32, the small image.
        change: (rows, columns) float32, mean change of each cell since the previous frame.
        slow: The same over `LAG_S`.
        texture: (rows, columns) float32, standard deviation within each cell.
    """

    time: float
    small: Floats
    change: Floats
    slow: Floats
    texture: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Standstill:
    """The part of the image that has stood still since a moment.

    Attributes:
        whole: The whole image is frozen; else a part is covered.
        cells: (rows, columns) bool.
        small: The small image then.
        since: Seconds.
    """

    whole: bool
    cells: Mask
    small: Floats
    since: float


class StandstillDetector:
    """Keeps the last second of small images, and detects what stopped in it."""

    def __init__(self, covered: float) -> None:
        self._covered = covered
        self._changes: deque[CellChange] = deque(maxlen=MAX_FRAMES)
        self.standstill: Standstill | None = None

    def reset(self) -> None:
        """Reset the history."""
        self._changes.clear()
        self.standstill = None

    def update(self, small: Floats, factor: int, time: float) -> Standstill | None:
        """Add a frame.

        Args:
            small: (h, w) float32, grey.
            factor: Pixels of the image along one of these.
            time: Seconds.

        Returns:
            The cause of a standstill, or None.
        """
        if self._changes and self._changes[-1].small.shape != small.shape:
            self.reset()
        still = 0.25 + 2.0 / factor  # sensor noise of 2 grey levels, averaged
        if self.standstill is not None:
            if _persists(self.standstill, small, still):
                return self.standstill
            self.reset()
        self._push(small, time)
        self.standstill = self._detect(still)
        return self.standstill

    def _push(self, small: Floats, time: float) -> None:
        changes = self._changes
        while changes and time - changes[0].time > HISTORY_S and len(changes) > 3 * FEWEST:
            changes.popleft()
        last = changes[-1].small if changes else small
        lag = next((k.small for k in reversed(changes) if time - k.time >= LAG_S - 1e-6), last)
        changes.append(
            CellChange(
                time,
                small,
                per_cell(cv2.absdiff(small, last)),
                per_cell(cv2.absdiff(small, lag)),
                _texture(small),
            )
        )

    def _detect(self, still: float) -> Standstill | None:
        now = self._changes[-1]
        after = [k for k in self._changes if now.time - k.time < AFTER_S]
        # A slow camera gives few frames in that time, but three are needed.
        after = after if len(after) >= 4 else list(self._changes)[-4:]
        before = list(self._changes)[1 : len(self._changes) - len(after)]
        if len(before) < FEWEST:
            return None
        calm = np.median([k.change for k in after[1:]], axis=0)
        # A passing object leaves calm cells that changed; stopped or covered ones look the same since.
        passed = per_cell(cv2.absdiff(now.small, after[1].small)) >= still + STILL_CHANGE
        least = np.min([k.slow for k in before], axis=0)
        most = np.max([k.change for k in before], axis=0)
        texture = np.min([k.texture for k in before], axis=0)
        still_cells = (calm < still) & ~passed
        noise = min(still, quantiles(least, 0.1)[0])
        was_moving = least > 0.4 + 2.0 * noise
        stopped = was_moving & still_cells & (now.slow < 0.25 * least)
        then = before[-1].small
        # Light and codecs change bright parts more than dark ones.
        least_jump = MIN_JUMP + 0.1 * per_cell(then) + 3.0 * most
        jump = per_cell(cv2.absdiff(now.small, then)) > least_jump
        lost_texture = (texture > 3.0) & (now.texture < 0.3 * texture)
        moving = now.slow > np.maximum(still, 0.25 * least)
        if not moving.any() and _all_motion_stopped(was_moving, stopped):
            return Standstill(True, was_moving, now.small, after[0].time)
        affected = still_cells & (stopped | jump | lost_texture)
        motion_continues = float(np.mean(was_moving & ~stopped)) > 0.05
        if not motion_continues:
            affected &= jump | lost_texture
        part = _largest(affected)
        share = float(part.mean())
        if share < self._covered or share > 0.92 or _same_scene(part, then, now.small):
            return None
        return Standstill(False, part, now.small, after[0].time)


def per_cell(values: NDArray[np.integer[Any] | np.floating[Any]]) -> Floats:
    """Means over cells of about `CELL` x `CELL`."""
    rows, columns = (max(1, round(n / CELL)) for n in values.shape)
    out = cv2.resize(values, (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(out, dtype=np.float32).reshape(rows, columns)


def _texture(small: Floats) -> Floats:
    mean = per_cell(small)
    return np.sqrt(np.maximum(per_cell(small * small) - mean * mean, 0.0))


def _persists(halt: Standstill, small: Floats, still: float) -> bool:
    """Whether the still part changes the same as it did then."""
    if halt.small.shape != small.shape:
        return False
    apart = per_cell(cv2.absdiff(small, halt.small))[halt.cells]
    return float(np.mean(apart < still + STILL_CHANGE)) > (0.9 if halt.whole else 0.6)


def _all_motion_stopped(was_moving: Mask, stopped: Mask) -> bool:
    """Whether all motion stopped at once: of more than one object, or in a large part of the view."""
    moved = int(was_moving.sum())
    if moved == 0 or stopped.sum() < 0.97 * moved:
        return False
    groups = cv2.connectedComponents(was_moving.astype(np.uint8), connectivity=8)[0] - 1
    return float(was_moving.mean()) > (0.04 if groups > 1 else 0.3)


def _largest(cells: Mask) -> Mask:
    """The largest connected part; single missing cells are filled."""
    closed = cv2.morphologyEx(cells.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(closed, connectivity=4)
    if count < 2:
        return np.zeros(cells.shape, dtype=bool)
    best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return np.asarray(labels == best) & cells


def _same_scene(part: Mask, then: Floats, now: Floats) -> bool:
    """Whether a part shows the same scene in another light, and is not covered."""
    size = (then.shape[1], then.shape[0])
    inside = cv2.resize(part.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    a, b = then[inside], now[inside]
    if a.std() < 2.0 or b.std() < 2.0:
        return False
    return float(np.corrcoef(a, b)[0, 1]) > 0.8
