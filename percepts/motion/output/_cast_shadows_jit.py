"""Compiled loops of `cast_shadows`: tones beside those of the ground, and their detail."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Mask = NDArray[np.bool_]


@compiled
def changed_tones(
    now: Floats, ground: Floats, where: Mask, least: float
) -> tuple[Mask, Floats, Floats, Floats]:
    """Where the known ground has changed, and how.

    Args:
        now: (h, w, 3).
        ground: (h, w, 3); NaN where it is not known.
        where: (h, w) where to look.
        least: Squared difference, over three channels, from which it has changed.

    Returns:
        (h, w) where; and, for each of these M pixels, row by row, brightness as a share of the ground's, the
        squared rest of the tone as a share of its power, and that power, squared grey levels.
    """
    height, width = where.shape
    differs = np.zeros((height, width), np.bool_)
    bright, hue = np.empty(where.size, np.float32), np.empty(where.size, np.float32)
    power, count, one = np.empty(where.size, np.float32), 0, np.float32(1)
    for y in range(height):
        for x in range(width):
            if not where[y, x] or np.isnan(ground[y, x, 0]):
                continue
            own, common, both = np.float32(0), np.float32(0), np.float32(0)
            for i in range(3):
                a, b = now[y, x, i], ground[y, x, i]
                own, common, both = own + (a - b) * (a - b), common + a * b, both + b * b
            if own <= least:
                continue
            share, off = common / (both + one), np.float32(0)
            for i in range(3):
                rest = now[y, x, i] - share * ground[y, x, i]
                off += rest * rest
            differs[y, x], bright[count] = True, share
            hue[count], power[count] = off / (both + one), both + one
            count += 1
    return differs, bright[:count], hue[:count], power[:count]


@compiled
def masked_greys(image: Floats, where: Mask) -> Floats:
    """Mean of the channels of a (h, w, 3) image within a mask, and 0 elsewhere, (h, w)."""
    out = np.zeros(where.shape, np.float32)
    for y in range(where.shape[0]):
        for x in range(where.shape[1]):
            if where[y, x]:
                total = image[y, x, 0] + image[y, x, 1] + image[y, x, 2]
                out[y, x] = total / np.float32(3)
    return out
