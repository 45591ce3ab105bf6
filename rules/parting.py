"""Bodies in contact that begin to part, seen by their motion before their outlines tell.

While one body reaches in front of another, the distance of their hulls says little: its noise is
large, and nothing of a gap shows yet. The image motion of each region is known much better. So for
bodies near each other, a speed of parting that is far above its noise is taken for the trend of
their distance. It is not asked about coming closer, which is seen well before contact.
"""

from __future__ import annotations

import numpy as np

from visup.agent import ObjectBelief
from visup.rules.geometry import DIRECTIONS, OPPOSITE, Floats


def parting_speed(
    objects: tuple[ObjectBelief, ...], support: Floats, now: float
) -> tuple[Floats, Floats]:
    """How fast pairs part, from the velocities of their regions along the line between them.

    Args:
        objects: (M) objects.
        support: (M, 16) their reach now, pixels; see `reach`.
        now: Seconds.

    Returns:
        (M, M) pixels per second, positive when parting, and its standard deviation; NaN for what
        is not seen now or whose velocity is not known.
    """
    m = len(objects)
    known = [b.last_seen == now and b.region.velocity_sigma > 0.0 for b in objects]
    unknown = (np.nan, np.nan)
    velocity = np.array(
        [b.region.velocity if k else unknown for b, k in zip(objects, known, strict=True)]
    ).reshape(m, 2)
    spread = np.array([b.region.velocity_sigma for b in objects])
    reach = support[:, None, :] + support[:, OPPOSITE]
    # The direction, from the first to the second, in which the hulls overlap least.
    towards = DIRECTIONS[reach.argmin(axis=2)]
    speed: Floats = ((velocity[None] - velocity[:, None]) * towards).sum(axis=2)
    return speed, np.hypot(spread[:, None], spread[None])
