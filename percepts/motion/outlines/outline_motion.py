"""The motion of either side of an outline, and to which a pixel belongs by it.

Where an object and what lies behind it have the same colours, tones mislead; where both are textured,
motion does not. The flow well inside and well outside is carried up to the outline, where flow itself is
blurred, and a pixel belongs to the side by whose flow it is found in the previous image. Where nothing is
textured, or both sides move alike, motion says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.outlines._outline_motion_jit import Places, carried_flow, moved_log_odds

SURE = 3  # pixels from the outline beyond which flow is that of one side
REACH = 10  # half-size pixels: how far flow is carried to the outline
LEAST = 4.0  # half-size pixels of a side that must lie in the window
NOISE = 4.0  # standard deviation of grey levels
OFF = 0.35  # standard deviation of displacements, pixels
FAR = 9.0  # greatest squared distance, in variances: uncovered and occluded pixels fit neither
MOST = 3.0  # log odds that motion may give to a pixel at most

Flows = tuple[Floats, Floats]
"""(h / 2, w / 2, 3) each, inside and outside: flow back, pixels, and 1 where it is known."""


@dataclass(frozen=True, slots=True, eq=False)
class CropMotion:
    """A part of the newest image and where it comes from.

    Attributes:
        grey: (h, w) uint8.
        gradients: (h, w) float32 each, along x and y, grey levels per pixel.
        flow: (h, w, 2) float32, dense flow back to the previous image, pixels.
        old: (H, W) uint8, the whole previous image.
        corner: (x, y) of the part.
    """

    grey: NDArray[np.uint8]
    gradients: tuple[Floats, Floats]
    flow: Floats
    old: NDArray[np.uint8]
    corner: tuple[int, int]

    def side_flows(self, inside: NDArray[np.uint8]) -> Flows:
        """The flow of either side of an outline, carried up to it and across.

        Args:
            inside: (h, w) 1 inside, 0 elsewhere.

        Returns:
            Flow inside and outside.
        """
        square = np.ones((2 * SURE + 1, 2 * SURE + 1), np.uint8)
        flow = np.ascontiguousarray(self.flow[::2, ::2])
        within = np.asarray(cv2.erode(inside, square), np.uint8)
        beyond = 1 - np.asarray(cv2.dilate(inside, square), np.uint8)
        ours, others = (
            np.ascontiguousarray(within[::2, ::2]),
            np.ascontiguousarray(beyond[::2, ::2]),
        )
        return carried_flow(flow, ours, REACH, LEAST), carried_flow(flow, others, REACH, LEAST)

    def log_odds(self, near: Places, flows: Flows) -> Floats:
        """Log odds of pixels to be inside, by the motion of either side.

        Args:
            near: (N, 2) rows and columns of the pixels.
            flows: From `side_flows`.

        Returns:
            (N,) float32; 0 where the flow of a side is not known.
        """
        now, before = (self.grey, *self.gradients), (self.old, self.corner)
        return moved_log_odds(near, now, before, flows, (NOISE, OFF, FAR, MOST))


def part_motion(
    image: WorkImage, old: WorkImage, flow: Floats, part: tuple[slice, slice]
) -> CropMotion:
    """The motion of a part of the newest image.

    Args:
        image: The newest image.
        old: The previous one.
        flow: (H, W, 2) float32, dense flow back to it, pixels.
        part: Rows and columns.

    Returns:
        The motion.
    """
    grey = np.ascontiguousarray(image.grey[part])
    gradients = (np.ascontiguousarray(image.gx[part]), np.ascontiguousarray(image.gy[part]))
    corner = (int(part[1].start), int(part[0].start))
    return CropMotion(grey, gradients, flow[part], old.grey, corner)
