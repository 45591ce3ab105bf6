"""Recovery of those who have come apart: together again, or on their way back.

What bobs on the water, or passes at a distance, draws nearer for a while as well; that mends nothing.
"""

from __future__ import annotations

from visup.agent import Truth
from visup.tasks.verification.observation import ActionObservation

REGAINED = 0.5
"""Greatest gap at which drawing nearer counts as recovery, as a share of the greatest since a step fails."""


def farthest(before: float | None, seen: ActionObservation) -> float | None:
    """The greatest gap of the actors of a failing step so far, pixels; None if unknown."""
    if seen.distance is None or before is None:
        return before if seen.distance is None else seen.distance
    return max(before, seen.distance)


def regained(farthest_px: float | None, seen: ActionObservation) -> bool:
    """Whether an action that helps is a recovery.

    Args:
        farthest_px: Greatest gap of its actors since the step fails, pixels; None if unknown.
        seen: The observation.

    Returns:
        Whether it holds, or they have made good half of the way at least, or nothing is known of it.
    """
    if seen.holds is Truth.TRUE or farthest_px is None or seen.distance is None:
        return True
    return seen.distance <= REGAINED * farthest_px
