"""The state of a body tracked in front of a dark sky: appearance template, position, path and velocity."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.dark_sky.sky import Mask

PATH_S = 3.0  # how long a path is kept, seconds
SPEED_S = 0.5  # time over which a velocity is measured, seconds
DRIFT = 0.0006  # displacement, as a share of the image diagonal, from which a body has drifted
STEADY_FACTOR = 4.0  # the same, as a multiple of the RMS deviation from uniform motion
MIN_S = 0.5  # shortest path from which a drift is measured, seconds
SEPARATE_S = 1.0  # time alone after which a body is not taken for a part of what it touches later
LARGE = 0.004  # share of the image that a body at rest must fill; captions fill less

Point = tuple[float, float]
Corner = tuple[int, int]
Sides = tuple[bool, bool, bool, bool]
Path = tuple[tuple[float, float, float, float, float], ...]
Slices = tuple[slice, slice]


@dataclass(frozen=True, slots=True, eq=False)
class BodyTemplate:
    """Appearance template of a body, taken when it was last seen alone, or whole.

    Attributes:
        mask: (h, w) bool, its silhouette within its bounding box.
        tone: (h, w) uint8, brightness in the box.
        corner: (x, y) of the upper left corner of the box at that time, frame pixels.
    """

    mask: Mask
    tone: NDArray[np.uint8]
    corner: Corner


@dataclass(frozen=True, slots=True, eq=False)
class SkyBody:
    """The track of one body.

    Attributes:
        key: Number of the track, in order of initiation.
        template: Its appearance template.
        corner: (x, y) of the template's box in the last frame, frame pixels.
        visible: (H, W) bool, its visible pixels in the last frame in which it was seen.
        last_seen: Time of that frame, seconds.
        alone: Whether it was a connected component of its own in that frame.
        sides: Whether its template touches the left, upper, right and lower border of the image.
        first_seen: Time when it came into view, seconds; -inf if it was there from the start.
        path: (time, x, y, ground x, ground y) of its anchor, seconds and frame pixels, of the last `PATH_S`.
            It starts anew whenever `alone` or `sides` changes, since that displaces the anchor.
        velocity: (vx, vy) in the image, frame pixels per second.
        occludes: Keys of the bodies that it was last seen in front of.
        whole: Whether it has ever been alone and not cut by the border.
        is_separate: Whether it has been alone for `SEPARATE_S`, so that it is not a part of another body.
        id: Public id of its region; 0 while it has none.
    """

    key: int
    template: BodyTemplate
    corner: Corner
    visible: Mask
    last_seen: float
    alone: bool
    sides: Sides
    first_seen: float
    path: Path = ()
    velocity: Point = (0.0, 0.0)
    occludes: frozenset[int] = frozenset()
    whole: bool = False
    is_separate: bool = False
    id: int = 0

    @property
    def cut(self) -> bool:
        """Whether the border of the image cuts it."""
        return any(self.sides)

    @property
    def has_speed(self) -> bool:
        """Whether its path is long enough for its velocity to have been measured on it."""
        return self.path[-1][0] - self.path[0][0] >= MIN_S / 2

    @property
    def is_fully_visible(self) -> bool:
        """Whether it is settled, alone and in full view, and larger than a caption."""
        whole = self.is_separate and self.alone and not self.cut
        return whole and self.area >= LARGE * self.visible.size

    @property
    def area(self) -> int:
        """Area of its template, pixels."""
        return int(np.count_nonzero(self.template.mask))

    def predicted_corner(self, now: float) -> Corner:
        """The corner (x, y) of its box at a time, predicted by constant velocity, frame pixels."""
        ahead, (vx, vy) = now - self.last_seen, self.velocity
        return round(self.corner[0] + vx * ahead), round(self.corner[1] + vy * ahead)

    def has_drifted(self, diagonal: float) -> bool:
        """Whether it has moved uniformly relative to the ground, by more than its deviations from that.

        A line is fitted to its path by least squares; False unless it is alone and in full view.

        Args:
            diagonal: Of the image, frame pixels.
        """
        path = np.asarray(self.path)
        if self.cut or not self.alone or path[-1, 0] - path[0, 0] < MIN_S:
            return False
        times = np.stack(
            [np.ones(len(path)), (path[:, 0] - path[0, 0]) / np.ptp(path[:, 0])], axis=1
        )
        relative_positions = path[:, 1:3] - path[:, 3:5]
        line = np.linalg.lstsq(times, relative_positions, rcond=None)[0]
        deviation = float(
            np.sqrt(np.mean(np.sum((relative_positions - times @ line) ** 2, axis=1)))
        )
        return float(np.hypot(*line[1])) > max(DRIFT * diagonal, STEADY_FACTOR * deviation)

    def with_template(
        self, template: BodyTemplate, ground: Point, now: float, *, alone: bool
    ) -> SkyBody:
        """The track updated with a new appearance template.

        Args:
            template: The template, from this frame.
            ground: (x, y) displacement of the ground since the first frame, frame pixels.
            now: Time of the frame, seconds.
            alone: Whether it is a connected component of its own.
        """
        sides = sides_of(template, self.visible.shape)
        same = (alone, sides) == (self.alone, self.sides)
        body = replace(
            self, template=template, corner=template.corner, alone=alone, sides=sides, last_seen=now
        )
        return body.with_position(template.corner, ground, now, continues=same)

    def with_position(
        self, corner: Corner, ground: Point, now: float, *, continues: bool
    ) -> SkyBody:
        """The track updated with a new position of its template.

        Args:
            corner: (x, y) of the template's box, frame pixels.
            ground: (x, y) displacement of the ground since the first frame, frame pixels.
            now: Time of the frame, seconds.
            continues: Whether its path is continued; otherwise it starts anew.
        """
        recent = [p for p in self.path if now - p[0] <= PATH_S] if continues else []
        path = (*recent, (now, *_anchor(self.template, corner, self.sides), *ground))
        duration = now - path[0][0]
        velocity = self.velocity if duration < MIN_S / 2 else _speed(path) or self.velocity
        settled = self.is_separate or (self.alone and duration >= SEPARATE_S)
        known = replace(self, corner=corner, path=path, velocity=velocity, last_seen=now)
        return replace(
            known, is_separate=settled, whole=self.whole or (self.alone and not self.cut)
        )


def sides_of(template: BodyTemplate, shape: tuple[int, ...]) -> Sides:
    """Whether a template touches the left, upper, right and lower border of an image of `shape` (h, w)."""
    (x, y), (h, w) = template.corner, template.mask.shape
    return x <= 0, y <= 0, x + w >= shape[1], y + h >= shape[0]


def _anchor(template: BodyTemplate, corner: Corner, sides: Sides) -> Point:
    """(x, y) of a point that moves with the body, frame pixels.

    Along each axis it is the centroid, or the end in view while the border cuts off the other end: the
    centroid of what is in view moves less than the body.
    """
    sums = cv2.moments(template.mask.view(np.uint8), binaryImage=True)
    (h, w), (left, top, right, bottom) = template.mask.shape, sides
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


def template_from_mask(mask: Mask, tone: NDArray[np.uint8]) -> BodyTemplate:
    """The appearance template of a mask: both cropped to its bounding box.

    Args:
        mask: (H, W) bool, not empty.
        tone: (H, W) uint8, brightness of the frame.
    """
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    return BodyTemplate(mask[part].copy(), tone[part].copy(), (x, y))


def updated_template(
    template: BodyTemplate, corner: Corner, visible: Mask, tone: NDArray[np.uint8], bright: Mask
) -> BodyTemplate:
    """The template of a partly hidden body, updated where it is visible and kept where it is not.

    Args:
        template: The previous template.
        corner: (x, y) of its box now, frame pixels.
        visible: (H, W) bool, its visible pixels.
        tone: (H, W) uint8, brightness of the frame.
        bright: (H, W) bool, pixels brighter than the sky: elsewhere nothing can hide it, so it is not there.
    """
    shape = (tone.shape[0], tone.shape[1])
    inside, part = template_overlap(template, corner, shape)
    known = np.where(visible[inside], tone[inside], template.tone[part])
    image = tone.copy()
    image[inside] = known
    return template_from_mask(
        (template_silhouette(template, corner, shape) & bright) | visible, image
    )


def template_silhouette(template: BodyTemplate, corner: Corner, shape: tuple[int, int]) -> Mask:
    """(H, W) bool: the silhouette of a template placed in the image with its box at a corner (x, y)."""
    out = np.zeros(shape, bool)
    inside, part = template_overlap(template, corner, shape)
    out[inside] = template.mask[part]
    return out


def template_overlap(
    template: BodyTemplate, corner: Corner, shape: tuple[int, int]
) -> tuple[Slices, Slices]:
    """Slices of the image that the box of a template covers, and the same part as slices of the template."""
    (x, y), (h, w) = corner, template.mask.shape
    left, top = min(max(x, 0), shape[1]), min(max(y, 0), shape[0])
    right, bottom = max(min(x + w, shape[1]), left), max(min(y + h, shape[0]), top)
    return np.s_[top:bottom, left:right], np.s_[top - y : bottom - y, left - x : right - x]
