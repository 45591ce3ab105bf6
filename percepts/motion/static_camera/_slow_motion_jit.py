"""Compiled loops of `slow_motion`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Mask = NDArray[np.bool_]


@compiled
def squared_difference(
    now: NDArray[np.uint8], old: NDArray[np.uint8], exposure: np.float32
) -> Floats:
    """Squared difference of two (h, w) images, the older one multiplied by `exposure`, (h, w) float32."""
    out = np.empty(now.shape, np.float32)
    for y in range(now.shape[0]):
        for x in range(now.shape[1]):
            gap = np.float32(now[y, x]) - np.float32(old[y, x]) * exposure
            out[y, x] = gap * gap
    return out


@compiled
def update_ground_belief(
    share: Floats, was_hidden: Mask, hidden: Mask, pace: tuple[np.float32, np.float32]
) -> None:
    """Update, in place, the belief that no object hides the ground.

    Args:
        share: (h, w) the belief, 0 to 1; updated.
        was_hidden: (h, w) where the ground was ever hidden; updated.
        hidden: (h, w) where it is hidden in this frame.
        pace: Growth of the belief per frame where the ground was hidden before, and where it never was.
    """
    fast, slow = pace
    for y in range(share.shape[0]):
        for x in range(share.shape[1]):
            was_hidden[y, x] |= hidden[y, x]
            grown = min(share[y, x] + (fast if was_hidden[y, x] else slow), np.float32(1))
            share[y, x] = np.float32(0) if hidden[y, x] else grown
