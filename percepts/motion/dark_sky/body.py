"""A body before a dark sky: its outline, its picture, and where it has been."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.dark_sky.sky import Mask

PATH_S = 3.0  # how long a path is kept, seconds
SPEED_S = 0.5  # time over which a speed is measured, seconds
DRIFT = 0.002  # way, as a share of the image diagonal, from which a body has moved by itself

Point = tuple[float, float]
Corner = tuple[int, int]
Slices = tuple[slice, slice]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """How a body looked when it was last seen alone, or whole.

    Attributes:
        mask: (h, w) bool, cropped to its box.
        tone: (h, w) uint8 brightness in the box.
    """

    mask: Mask
    tone: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class SkyBody:
    """What is known of one body.

    Attributes:
        key: Its number.
        look: How it looked when it was last seen alone, or whole.
        corner: (x, y) of the box of that look in the last frame, frame pixels.
        visible: (H, W) bool: its pixels in the last frame in which it was seen.
        seen: Time of that frame, seconds.
        alone: Whether it was a component of its own in that frame.
        cut: Whether it touched the border of the image when it was last alone.
        path: (time, x, y, ground x, ground y) of its centre since it has been alone, or not: frame pixels.
        id: Public id of its region; 0 while it has none.
    """

    key: int
    look: Look
    corner: Corner
    visible: Mask
    seen: float
    alone: bool
    cut: bool
    path: tuple[tuple[float, float, float, float, float], ...] = ()
    id: int = 0

    @property
    def area(self) -> int:
        """Pixels of its look."""
        return int(np.count_nonzero(self.look.mask))

    @property
    def velocity(self) -> Point:
        """(vx, vy) in the image, frame pixels per second."""
        recent = [p for p in self.path if self.path[-1][0] - p[0] <= SPEED_S]
        if len(recent) < 2:
            return 0.0, 0.0
        (t0, x0, y0, *_), (t1, x1, y1, *_) = recent[0], recent[-1]
        return (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)

    def expected(self, now: float) -> Corner:
        """The corner of its box at a time soon after it was seen."""
        ahead, (vx, vy) = now - self.seen, self.velocity
        return round(self.corner[0] + vx * ahead), round(self.corner[1] + vy * ahead)

    def drifted(self, diagonal: float) -> bool:
        """Whether it has moved against the ground while it was alone, beyond what outlines wobble."""
        if self.cut or not self.alone or len(self.path) < 2:
            return False
        (_, x0, y0, gx0, gy0), (_, x1, y1, gx1, gy1) = self.path[0], self.path[-1]
        return float(np.hypot(x1 - x0 - gx1 + gx0, y1 - y0 - gy1 + gy0)) > DRIFT * diagonal

    def moved_to(self, now: float, centre: Point, ground: Point, *, alone: bool) -> SkyBody:
        """The body with its path continued; the path begins anew when it meets or leaves others.

        Args:
            now: Time of the frame, seconds.
            centre: (x, y) of its centre.
            ground: (x, y) way of the ground since the first frame.
            alone: Whether it is a component of its own in this frame.
        """
        kept = [p for p in self.path if now - p[0] <= PATH_S] if alone == self.alone else []
        path = (*kept, (now, *centre, *ground))
        return replace(self, path=path, alone=alone, seen=now)


def centre_of(mask: Mask, corner: Corner = (0, 0)) -> Point:
    """The centre of a mask that is not empty, frame pixels."""
    sums = cv2.moments(mask.view(np.uint8), binaryImage=True)
    return sums["m10"] / sums["m00"] + corner[0], sums["m01"] / sums["m00"] + corner[1]


def look_at(mask: Mask, tone: NDArray[np.uint8]) -> tuple[Look, Corner]:
    """How a body looks, and the corner of its box.

    Args:
        mask: (H, W) bool, not empty.
        tone: (H, W) uint8.
    """
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    return Look(mask[part].copy(), tone[part].copy()), (x, y)


def pasted(look: Look, corner: Corner, shape: tuple[int, int]) -> Mask:
    """The mask of a look in the image, when its box has this corner; (H, W) bool."""
    out = np.zeros(shape, bool)
    inside, part = overlap(look, corner, shape)
    out[inside] = look.mask[part]
    return out


def overlap(look: Look, corner: Corner, shape: tuple[int, int]) -> tuple[Slices, Slices]:
    """The part of the image that the box of a look covers, and the same part of the box."""
    (x, y), (h, w) = corner, look.mask.shape
    left, top = min(max(x, 0), shape[1]), min(max(y, 0), shape[0])
    right, bottom = max(min(x + w, shape[1]), left), max(min(y + h, shape[0]), top)
    return np.s_[top:bottom, left:right], np.s_[top - y : bottom - y, left - x : right - x]
