"""Scenes: frames reduced to a working size, in which taught objects are searched.

The reduced frame is called the *working image*, its pixels *working pixels*.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from visup.percepts.appearance.models.pose import Bytes, PatchPose, cut_patch

WORK_SIZE = 640
"""Most pixels along the longer side of the searched image."""

_LEVELS = 3  # most levels of the pyramid


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One frame at working size.

    Attributes:
        time: Seconds.
        lab: CIE Lab pyramid, (h, w, 3) uint8, each level half the size of the previous one; levels are
            computed on demand.
        grey: (h, w) uint8.
        frame_size: (width, height) of the frame, pixels.
    """

    time: float
    lab: list[Bytes]
    grey: Bytes
    frame_size: tuple[int, int]

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), working pixels."""
        return self.grey.shape[1], self.grey.shape[0]

    @property
    def scale(self) -> float:
        """Working pixels per pixel of the frame."""
        return float(self.grey.shape[1] / self.frame_size[0])

    def patch(self, pose: PatchPose, shape: tuple[int, ...]) -> Bytes:
        """(height, width, 3) uint8, Lab: the patch at a pose, from the pyramid level of matching scale."""
        level = int(np.clip(np.round(np.log2(max(pose.scale, 1e-3))), 0, _LEVELS - 1))
        while level >= len(self.lab) and min(self.lab[-1].shape[:2]) >= 16:
            self.lab.append(np.asarray(cv2.pyrDown(self.lab[-1]), dtype=np.uint8))
        level = min(level, len(self.lab) - 1)
        by = 2.0**-level
        at = PatchPose(
            (pose.x + 0.5) * by - 0.5, (pose.y + 0.5) * by - 0.5, pose.scale * by, pose.angle
        )
        return np.asarray(cut_patch(self.lab[level], at, shape), dtype=np.uint8)


def prepare_scene(image: Bytes, time: float) -> Scene:
    """A frame at working size.

    Args:
        image: (H, W), (H, W, 1) or (H, W, 3) uint8, BGR.
        time: Seconds.
    """
    if image.ndim == 2 or image.shape[2] == 1:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    height, width = image.shape[:2]
    scale = work_scale((width, height))
    if scale < 1:
        size = max(1, round(width * scale)), max(1, round(height * scale))
        # Area averaging is slow for fractional factors, and useful only for strong reduction.
        interpolation = cv2.INTER_AREA if scale < 0.6 else cv2.INTER_LINEAR
        image = np.asarray(cv2.resize(image, size, interpolation=interpolation), dtype=np.uint8)
    lab = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2LAB), dtype=np.uint8)
    grey = np.ascontiguousarray(lab[..., 0])
    return Scene(time, [lab], grey, (width, height))


def work_scale(size: tuple[int, int]) -> float:
    """Working pixels per pixel of a frame of (width, height)."""
    return min(1.0, WORK_SIZE / max(size))
