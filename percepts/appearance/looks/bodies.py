"""Bodies that move by themselves, and their colours: their outline is known, whatever their posture."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from visup.percepts.appearance.looks.blob import Blob
from visup.percepts.appearance.looks.colours import OWN, colour_bins, learn_colours
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import Appearance

RING = 0.25  # width of the surroundings of a body, in its sides


@dataclass(frozen=True, slots=True, eq=False)
class MovingBody:
    """A body that moves by itself.

    Attributes:
        id: Id of its region.
        blob: Its pixels.
        cut: Whether the border of the picture cuts it.
    """

    id: int
    blob: Blob
    cut: bool


def body_colours(scene: Scene, it: Appearance, blob: Blob) -> tuple[float, float]:
    """Excess of an object's colours in a blob over its surroundings, and the common share of colours."""
    wide = max(4, round(RING * np.sqrt(blob.area)))
    left, top, right, bottom = blob.window
    width, height = scene.size
    x0, y0, x1, y1 = left - wide, top - wide, right + wide, bottom + wide
    inside = np.pad(blob.mask.view(np.uint8), wide)
    around = cv2.dilate(inside, np.ones((2 * wide + 1, 2 * wide + 1), np.uint8))
    around = around - cv2.dilate(inside, np.ones((5, 5), np.uint8))
    part = np.s_[max(0, -y0) : height - y0, max(0, -x0) : width - x0]
    lab = scene.lab[0][max(0, y0) : y1, max(0, x0) : x1]
    seen, ring = inside[part] > 0, around[part] > 0
    if not seen.any():
        return 0.0, 0.0
    own = it.colours.odds(colour_bins(lab)) > OWN
    beside = float(np.mean(own[ring])) if ring.any() else 0.0
    colours = learn_colours(lab, seen.astype(np.float32), ring.astype(np.float32))
    return float(np.mean(own[seen])) - beside, colours.shared(it.colours)
