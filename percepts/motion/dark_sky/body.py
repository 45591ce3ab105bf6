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
DRIFT = 0.0006  # way, as a share of the image diagonal, from which a body has moved by itself
STEADY = 4.0  # the same, in root mean squares of its deviations from a steady course
LEAST_S = 0.5  # time over which a drift is measured at least, seconds

Point = tuple[float, float]
Corner = tuple[int, int]
Path = tuple[tuple[float, float, float, float, float], ...]
Slices = tuple[slice, slice]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """How a body looked when it was last seen alone, or whole.

    Attributes:
        mask: (h, w) bool, cropped to its box.
        tone: (h, w) uint8 brightness in the box.
        corner: (x, y) of the box then, frame pixels.
    """

    mask: Mask
    tone: NDArray[np.uint8]
    corner: Corner


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
        velocity: (vx, vy) in the image, frame pixels per second.
        id: Public id of its region; 0 while it has none.
    """

    key: int
    look: Look
    corner: Corner
    visible: Mask
    seen: float
    alone: bool
    cut: bool
    path: Path = ()
    velocity: Point = (0.0, 0.0)
    id: int = 0

    @property
    def area(self) -> int:
        """Pixels of its look."""
        return int(np.count_nonzero(self.look.mask))

    @property
    def span(self) -> float:
        """How long it has been alone, or not, seconds; `PATH_S` at most."""
        return self.path[-1][0] - self.path[0][0]

    def expected(self, now: float) -> Corner:
        """The corner of its box at a time soon after it was seen."""
        ahead, (vx, vy) = now - self.seen, self.velocity
        return round(self.corner[0] + vx * ahead), round(self.corner[1] + vy * ahead)

    def drifted(self, diagonal: float) -> bool:
        """Whether it has moved steadily against the ground while it was alone, beyond its wobble."""
        way = np.asarray(self.path)
        if self.cut or not self.alone or way[-1, 0] - way[0, 0] < LEAST_S:
            return False
        times = np.stack([np.ones(len(way)), (way[:, 0] - way[0, 0]) / np.ptp(way[:, 0])], axis=1)
        places = way[:, 1:3] - way[:, 3:5]
        course = np.linalg.lstsq(times, places, rcond=None)[0]
        wobble = float(np.sqrt(np.mean(np.sum((places - times @ course) ** 2, axis=1))))
        return float(np.hypot(*course[1])) > max(DRIFT * diagonal, STEADY * wobble)

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
        velocity = self.velocity if now - path[0][0] < LEAST_S / 2 else _speed(path)
        return replace(self, path=path, velocity=velocity, alone=alone, seen=now)


def _speed(path: Path) -> Point:
    """Mean velocity in the image over the last part of a path, pixels per second."""
    recent = [p for p in path if path[-1][0] - p[0] <= SPEED_S]
    (t0, x0, y0, *_), (t1, x1, y1, *_) = recent[0], recent[-1]
    return (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)


def centre_of(mask: Mask, corner: Corner = (0, 0)) -> Point:
    """The centre of a mask that is not empty, frame pixels."""
    sums = cv2.moments(mask.view(np.uint8), binaryImage=True)
    return sums["m10"] / sums["m00"] + corner[0], sums["m01"] / sums["m00"] + corner[1]


def look_at(mask: Mask, tone: NDArray[np.uint8]) -> Look:
    """How a body looks.

    Args:
        mask: (H, W) bool, not empty.
        tone: (H, W) uint8.
    """
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    return Look(mask[part].copy(), tone[part].copy(), (x, y))


def renewed(
    look: Look, corner: Corner, visible: Mask, tone: NDArray[np.uint8], bright: Mask
) -> Look:
    """How a body looks when a part of it may be hidden: there as it looked before.

    Args:
        look: How it looked before.
        corner: (x, y) of its box now.
        visible: (H, W) bool: its pixels that are not hidden.
        tone: (H, W) uint8.
        bright: (H, W) bool: where there is something.
    """
    shape = (tone.shape[0], tone.shape[1])
    inside, part = overlap(look, corner, shape)
    known = np.where(visible[inside], tone[inside], look.tone[part])
    both = tone.copy()
    both[inside] = known
    return look_at((pasted(look, corner, shape) & bright) | visible, both)


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
