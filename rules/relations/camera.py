"""How far the camera's own motion has moved the picture where each object is.

Velocities are those in the resting scene: what rests there moves through the picture of a camera that pans,
shakes or zooms. The motion is taken at the middle of an object, so that of a zoom or a turn only the shift
is taken off, not the growth. Where nobody tells of the camera it is taken to rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from visup.agent import CameraMotion, ObjectBelief, Observation
from visup.rules.geometry.regions import Floats


def drifted(before: Floats, objects: Sequence[ObjectBelief], observation: Observation) -> Floats:
    """The drift of all objects after one more frame.

    Args:
        before: (M, 2) pixels, up to the frame before.
        objects: M of them.
        observation: What was perceived; of several motions of the camera the last counts.

    Returns:
        (M, 2) pixels; the same array where the camera rests.
    """
    told: Sequence[CameraMotion] = observation.of("camera")
    if not told or np.array_equal(told[-1].motion, np.eye(2, 3)):
        return before
    moved = [told[-1].displacement(b.region.centroid) for b in objects]
    drift: Floats = before + np.array(moved).reshape(-1, 2)
    return drift
