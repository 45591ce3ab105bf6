"""Recovery of a failing step: whether its actors, having separated, have come back far enough.

A body that bobs on the water, or passes at a distance, also approaches for a while; that is not a recovery.
"""

from __future__ import annotations

from visup.agent import Truth
from visup.tasks.verification.observation import ActionObservation

RECOVERY_SHARE = 0.5
"""Greatest gap at which an approach counts as recovery, as a share of the greatest gap since the failure."""


def greatest_gap(before: float | None, seen: ActionObservation) -> float | None:
    """The greatest gap between the actors of a failing step so far, pixels; None if unknown.

    Args:
        before: The greatest gap before this observation.
        seen: The observation.
    """
    if seen.distance is None or before is None:
        return before if seen.distance is None else seen.distance
    return max(before, seen.distance)


def has_come_back(greatest_gap_px: float | None, seen: ActionObservation) -> bool:
    """Whether observed progress of a failing step counts as recovery.

    Args:
        greatest_gap_px: Greatest gap between its actors since it fails, pixels; None if unknown.
        seen: The observation.

    Returns:
        True if the action holds, if the gap is at most half of the greatest, or if either gap is unknown.
    """
    if seen.holds is Truth.TRUE or greatest_gap_px is None or seen.distance is None:
        return True
    return seen.distance <= RECOVERY_SHARE * greatest_gap_px
