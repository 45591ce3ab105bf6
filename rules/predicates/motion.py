"""Motion predicates: moving by more than noise, and moving with a well-known velocity."""

from __future__ import annotations

import numpy as np

from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.snapshot import Codes, Snapshot, code

MOVING_SIGMAS = 3.0
"""Least speed of a moving object, in standard deviations of its velocity."""
CLEAR_MOTION_SIGMA = 0.005
"""Largest velocity sigma of clear motion, image diagonals per second. Measured from masks: up to 0.0047 for
chargers that are rammed, 0.005 to 0.05 for bodies that others pass in front of."""


def moving(facts: Snapshot) -> Codes:
    """Whether an object moves in the image by more than the noise of its outline."""
    still_speed = facts.relation_settings.still_speed * image_diagonal(facts.mind.frame_size)
    speeds, noise = facts.one("speed"), MOVING_SIGMAS * facts.one("velocity_sigma")
    pairs = zip(speeds.tolist(), np.maximum(still_speed, noise).tolist(), strict=True)
    codes = [MAYBE if v != v else code(v > least) for v, least in pairs]  # NaN is not itself
    return np.array(codes, dtype=np.int8)


def moving_clearly(facts: Snapshot) -> Codes:
    """Whether an object moves and enough of its outline is visible for its velocity to be well known.

    While another body passes in front of it, the rest of its outline appears to move.
    """
    clear = facts.one("velocity_sigma") <= CLEAR_MOTION_SIGMA * image_diagonal(
        facts.mind.frame_size
    )
    codes = moving(facts)
    return np.where((codes == YES) & ~clear, NO, codes).astype(np.int8)
