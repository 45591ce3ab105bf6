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
SETTLED_S = 1.0  # time alone from which a body is no part of what it touches later, seconds
LARGE = 0.004  # share of the picture that a body at rest must fill: captions and the like fill less

Point = tuple[float, float]
Corner = tuple[int, int]
Sides = tuple[bool, bool, bool, bool]
Path = tuple[tuple[float, float, float, float, float], ...]
Slices = tuple[slice, slice]


@dataclass(frozen=True, slots=True, eq=False)
class BodyLook:
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
        sides: Whether its look touches the left, upper, right and lower border of the image.
        born: Time when it came into view, seconds; minus infinity if it was there from the first frame on.
        path: (time, x, y, ground x, ground y) of its anchor, frame pixels, since it has been alone, or not,
            and cut at these sides.
        velocity: (vx, vy) in the image, frame pixels per second.
        covers: Keys of bodies that were last seen behind it.
        whole: Whether it has ever been alone and not cut by the border.
        settled: Whether it has been alone for long enough not to be a part of something else.
        id: Public id of its region; 0 while it has none.
    """

    key: int
    look: BodyLook
    corner: Corner
    visible: Mask
    seen: float
    alone: bool
    sides: Sides
    born: float
    path: Path = ()
    velocity: Point = (0.0, 0.0)
    covers: frozenset[int] = frozenset()
    whole: bool = False
    settled: bool = False
    id: int = 0

    @property
    def cut(self) -> bool:
        """Whether the border of the image cuts it."""
        return any(self.sides)

    @property
    def has_speed(self) -> bool:
        """Whether its velocity was measured since it has been alone, or not."""
        return self.path[-1][0] - self.path[0][0] >= LEAST_S / 2

    @property
    def stands_alone(self) -> bool:
        """Whether it has been alone for long, in full view, and is larger than a caption."""
        whole = self.settled and self.alone and not self.cut
        return whole and self.area >= LARGE * self.visible.size

    @property
    def area(self) -> int:
        """Pixels of its look."""
        return int(np.count_nonzero(self.look.mask))

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

    def looking(self, look: BodyLook, ground: Point, now: float, *, alone: bool) -> SkyBody:
        """The body in the next frame, when it looks like this.

        Args:
            look: How it looks, and where.
            ground: (x, y) way of the ground since the first frame.
            now: Time of the frame, seconds.
            alone: Whether it is a component of its own.
        """
        sides = sides_of(look, self.visible.shape)
        same = (alone, sides) == (self.alone, self.sides)
        body = replace(self, look=look, corner=look.corner, alone=alone, sides=sides, seen=now)
        return body.moved_to(look.corner, ground, now, follows=same)

    def moved_to(self, corner: Corner, ground: Point, now: float, *, follows: bool) -> SkyBody:
        """The body with its path continued, or begun anew.

        Args:
            corner: (x, y) of the box of its look.
            ground: (x, y) way of the ground since the first frame.
            now: Time of the frame, seconds.
            follows: Whether its path is continued.
        """
        kept = [p for p in self.path if now - p[0] <= PATH_S] if follows else []
        path = (*kept, (now, *_anchor(self.look, corner, self.sides), *ground))
        lasts = now - path[0][0]
        velocity = self.velocity if lasts < LEAST_S / 2 else _speed(path) or self.velocity
        settled = self.settled or (self.alone and lasts >= SETTLED_S)
        known = replace(self, corner=corner, path=path, velocity=velocity, seen=now)
        return replace(known, settled=settled, whole=self.whole or (self.alone and not self.cut))


def sides_of(look: BodyLook, shape: tuple[int, ...]) -> Sides:
    """Whether a look touches the left, upper, right and lower border of the image."""
    (x, y), (h, w) = look.corner, look.mask.shape
    return x <= 0, y <= 0, x + w >= shape[1], y + h >= shape[0]


def _anchor(look: BodyLook, corner: Corner, sides: Sides) -> Point:
    """A point that moves as the body does: its centre, or its ends in view while the border cuts it."""
    sums = cv2.moments(look.mask.view(np.uint8), binaryImage=True)
    (h, w), (left, top, right, bottom) = look.mask.shape, sides
    x = sums["m10"] / sums["m00"] if left == right else w if left else 0
    y = sums["m01"] / sums["m00"] if top == bottom else h if top else 0
    return corner[0] + float(x), corner[1] + float(y)


def _speed(path: Path) -> Point | None:
    """Mean velocity in the image over the last part of a path, pixels per second; None after a gap."""
    recent = [p for p in path if path[-1][0] - p[0] <= SPEED_S]
    if len(recent) < 2:
        return None
    (t0, x0, y0, *_), (t1, x1, y1, *_) = recent[0], recent[-1]
    return (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)


def look_at(mask: Mask, tone: NDArray[np.uint8]) -> BodyLook:
    """How a body looks.

    Args:
        mask: (H, W) bool, not empty.
        tone: (H, W) uint8.
    """
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    return BodyLook(mask[part].copy(), tone[part].copy(), (x, y))


def renewed(
    look: BodyLook, corner: Corner, visible: Mask, tone: NDArray[np.uint8], bright: Mask
) -> BodyLook:
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


def pasted(look: BodyLook, corner: Corner, shape: tuple[int, int]) -> Mask:
    """The mask of a look in the image, when its box has this corner; (H, W) bool."""
    out = np.zeros(shape, bool)
    inside, part = overlap(look, corner, shape)
    out[inside] = look.mask[part]
    return out


def overlap(look: BodyLook, corner: Corner, shape: tuple[int, int]) -> tuple[Slices, Slices]:
    """The part of the image that the box of a look covers, and the same part of the box."""
    (x, y), (h, w) = corner, look.mask.shape
    left, top = min(max(x, 0), shape[1]), min(max(y, 0), shape[0])
    right, bottom = max(min(x + w, shape[1]), left), max(min(y + h, shape[0]), top)
    return np.s_[top:bottom, left:right], np.s_[top - y : bottom - y, left - x : right - x]
