"""Poses of objects (position, scale, in-plane rotation) and patches cut out accordingly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Doubles = NDArray[np.float64]
Image = NDArray[np.uint8] | NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class PatchPose:
    """A similarity transform from an object's patch to the image.

    Attributes:
        x: Centre of the patch in the image, pixels.
        y: The same, downwards.
        scale: Pixels of the image per pixel of the patch.
        angle: Rotation from the patch to the image, radians.
    """

    x: float
    y: float
    scale: float
    angle: float = 0.0

    def matrix(self, shape: tuple[int, ...]) -> Doubles:
        """(2, 3) from pixels of a patch to pixels of the image.

        Args:
            shape: (height, width, ...) of the patch.
        """
        cos, sin = self.scale * np.cos(self.angle), self.scale * np.sin(self.angle)
        u, v = (shape[1] - 1) / 2, (shape[0] - 1) / 2
        return np.array(
            [[cos, -sin, self.x - cos * u + sin * v], [sin, cos, self.y - sin * u - cos * v]]
        )

    def moved(self, motion: Doubles) -> PatchPose:
        """The pose after a similarity of the image, a (2, 3) matrix."""
        x, y = motion[:, :2] @ (self.x, self.y) + motion[:, 2]
        scale = float(np.hypot(motion[0, 0], motion[1, 0]))
        turn = float(np.arctan2(motion[1, 0], motion[0, 0]))
        return PatchPose(float(x), float(y), self.scale * scale, self.angle + turn)

    def shifted(self, dx: float, dy: float) -> PatchPose:
        """The pose after a shift by pixels of the patch."""
        cos, sin = self.scale * np.cos(self.angle), self.scale * np.sin(self.angle)
        return PatchPose(
            float(self.x + cos * dx - sin * dy),
            float(self.y + sin * dx + cos * dy),
            self.scale,
            self.angle,
        )

    def resized(self, by: float, turn: float = 0.0) -> PatchPose:
        """The pose scaled by a factor and rotated by radians."""
        return PatchPose(self.x, self.y, self.scale * by, self.angle + turn)

    def apart(self, other: PatchPose, radius: float) -> float:
        """How far a point at a radius (patch pixels) moves from one pose to the other, image pixels."""
        shift = float(np.hypot(self.x - other.x, self.y - other.y))
        bend = np.hypot(self.scale - other.scale, self.scale * (self.angle - other.angle))
        return shift + float(bend) * radius

    def motion_to(self, other: PatchPose) -> Doubles:
        """(2, 3) similarity of the image that maps this pose to another."""
        by, turn = other.scale / self.scale, other.angle - self.angle
        cos, sin = by * np.cos(turn), by * np.sin(turn)
        linear = np.array([[cos, -sin], [sin, cos]])
        return np.column_stack([linear, np.array([other.x, other.y]) - linear @ (self.x, self.y)])


def cut_patch(
    image: Image, pose: PatchPose, shape: tuple[int, ...], nearest: bool = False
) -> Image:
    """The patch at a pose; beyond the border the border pixels are repeated.

    Args:
        image: (H, W) or (H, W, 3).
        pose: Pose of the patch.
        shape: (height, width) of the patch.
        nearest: Nearest pixels instead of interpolation.
    """
    flags = cv2.WARP_INVERSE_MAP | (cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR)
    out = np.asarray(
        cv2.warpAffine(
            image,
            pose.matrix(shape),
            (shape[1], shape[0]),
            flags=flags,
            borderMode=cv2.BORDER_REPLICATE,
        )
    )
    return cast(Image, out)


Window = tuple[int, int, int, int]


def window_of(pose: PatchPose, shape: tuple[int, ...], size: tuple[int, int]) -> Window | None:
    """The box of the image that a patch covers.

    Args:
        pose: Pose of the patch.
        shape: (height, width) of the patch.
        size: (width, height) of the image.

    Returns:
        (left, top, right, bottom), half open; None when outside the image.
    """
    h, w = shape[:2]
    corners = np.array([[0, 0, 1], [w - 1, 0, 1], [0, h - 1, 1], [w - 1, h - 1, 1]], dtype=float)
    at = corners @ pose.matrix(shape).T
    left, top = (int(np.clip(np.floor(v), 0, n)) for v, n in zip(at.min(0), size, strict=True))
    right, bottom = (
        int(np.clip(np.ceil(v) + 1, 0, n)) for v, n in zip(at.max(0), size, strict=True)
    )
    return (left, top, right, bottom) if right - left > 1 and bottom - top > 1 else None


def paint(patch: Image, pose: PatchPose, window: Window, outside: float = 0.0) -> Image:
    """A patch rendered into a window of the image.

    Args:
        patch: (h, w) or (h, w, 3).
        pose: Pose of the patch.
        window: (left, top, right, bottom) of the image.
        outside: Value outside the patch.
    """
    left, top, right, bottom = window
    matrix = pose.matrix(patch.shape) - np.array([[0, 0, left], [0, 0, top]])
    out = np.asarray(
        cv2.warpAffine(
            patch,
            matrix,
            (right - left, bottom - top),
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(outside,) * 3,
        )
    )
    return cast(Image, out)
