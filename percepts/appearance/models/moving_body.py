"""Independently moving bodies, and how well their colours agree with those of a taught object.

Motion segmentation gives the outline of a body, so that its colours can be compared whatever its posture.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.colours import OWN_LOG_ODDS, colour_bins, learn_colours
from visup.percepts.appearance.models.scene import Scene

RING_WIDTH = 0.25  # width of the surroundings of a body, as a share of the square root of its area


@dataclass(frozen=True, slots=True, eq=False)
class MovingBody:
    """A region that moves independently of the camera.

    Attributes:
        id: Id of its region.
        blob: Its pixels, working image.
        cut: Whether it is cut off by the border of the image.
    """

    id: int
    blob: Blob
    cut: bool


def colour_similarity(scene: Scene, appearance: Appearance, blob: Blob) -> tuple[float, float]:
    """How well the colours of a blob agree with those of a taught object.

    Args:
        scene: The frame.
        appearance: Appearance of the taught object.
        blob: Pixels of the working image.

    Returns:
        The share of the blob's pixels with colours of the object minus that of a ring around it, -1 to 1,
        and the intersection of the colour histograms of blob and object, 0 to 1.
    """
    margin = max(4, round(RING_WIDTH * np.sqrt(blob.area)))
    left, top, right, bottom = blob.window
    width, height = scene.size
    x0, y0, x1, y1 = left - margin, top - margin, right + margin, bottom + margin
    inside = np.pad(blob.mask.view(np.uint8), margin)
    around = cv2.dilate(inside, np.ones((2 * margin + 1, 2 * margin + 1), np.uint8))
    around = around - cv2.dilate(inside, np.ones((5, 5), np.uint8))
    part = np.s_[max(0, -y0) : height - y0, max(0, -x0) : width - x0]
    lab = scene.lab[0][max(0, y0) : y1, max(0, x0) : x1]
    body, ring = inside[part] > 0, around[part] > 0
    if not body.any():
        return 0.0, 0.0
    has_own_colour = appearance.colours.odds(colour_bins(lab)) > OWN_LOG_ODDS
    ring_share = float(np.mean(has_own_colour[ring])) if ring.any() else 0.0
    colours = learn_colours(lab, body.astype(np.float32), ring.astype(np.float32))
    return float(np.mean(has_own_colour[body])) - ring_share, colours.shared(appearance.colours)
