"""Whether something moves: by more than its noise, and so that its velocity is well known."""

from __future__ import annotations

import numpy as np

from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.snapshot import Codes, Snapshot, code
from visup.rules.relations.kinematics import RelationSettings

STILL_SPEED = RelationSettings().still_speed
MOVING_SIGMAS = 3.0
CLEAR = 0.005
"""How well a velocity must be known of what clearly moves, image diagonals a second (one deviation). By masks
that of chargers that are rammed is known to .0047, that of bodies that others pass before to .005 to .05."""


def moving(facts: Snapshot) -> Codes:
    """Whether an object moves in the image, by more than the noise of its outline makes."""
    still = STILL_SPEED * image_diagonal(facts.mind.frame_size)
    speeds, noise = facts.one("speed"), MOVING_SIGMAS * facts.one("velocity_sigma")
    seen = zip(speeds.tolist(), np.maximum(still, noise).tolist(), strict=True)
    codes = [MAYBE if v != v else code(v > least) for v, least in seen]  # NaN is not itself
    return np.array(codes, dtype=np.int8)


def moving_clearly(facts: Snapshot) -> Codes:
    """Whether an object moves, and so much of its outline is free that its velocity is well known.

    Where another body passes before it, what is left of its outline seems to move.
    """
    clear = facts.one("velocity_sigma") <= CLEAR * image_diagonal(facts.mind.frame_size)
    codes = moving(facts)
    return np.where((codes == YES) & ~clear, NO, codes).astype(np.int8)
