"""Objects in zones: parts of the image, or of the scene by relative depth, drawn in the settings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief
from visup.agent.mind import Zone
from visup.rules.facts import MAYBE, NO, SIGMAS, YES, Codes, Facts, Floats


def inside(facts: Facts, name: str) -> Codes:
    """Whether objects reach into the zone of that name; unknown while there is none.

    Args:
        facts: The mind as rules see it.
        name: Of the zone.

    Returns:
        (n,) codes of all objects.
    """
    return _any([z for z in facts.mind.zones if z.name == name], facts, MAYBE)


def zones_named(facts: Facts, beginning: str) -> Codes:
    """Whether objects reach into any zone whose name begins so; false where there is none."""
    return _any([z for z in facts.mind.zones if z.name.startswith(beginning)], facts, NO)


def _any(zones: list[Zone], facts: Facts, without: int) -> Codes:
    if not zones:
        return facts.each(lambda _: without)
    return facts.each(lambda b: max(reaches(b, z, facts.mind) for z in zones))


def reaches(belief: ObjectBelief, zone: Zone, mind: Mind) -> int:
    """Whether an object reaches into a zone.

    Args:
        belief: The object; of one that is out of sight it is not known.
        zone: The zone. With depths, the object's must lie between them, within its deviation.
        mind: Gives the moment.

    Returns:
        `YES`, `NO` or `MAYBE`.
    """
    if belief.last_seen < mind.time:
        return MAYBE
    corners = np.asarray(zone.polygon, dtype=float)
    contour = np.asarray(belief.region.contour, dtype=float)
    if not (within(contour, corners).any() or within(corners, contour).any()):
        return NO
    if zone.depth is None:
        return YES
    if belief.depth is None:
        return MAYBE
    near, far = zone.depth
    spread = SIGMAS * (belief.depth_sigma or 0.0)
    if near <= belief.depth - spread and belief.depth + spread <= far:
        return YES
    return NO if belief.depth + spread < near or belief.depth - spread > far else MAYBE


def within(points: Floats, corners: Floats) -> NDArray[np.bool_]:
    """Whether points lie in a polygon, by the even-odd rule.

    >>> within(np.array([[1.0, 1.0], [5.0, 1.0]]), np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]))
    array([ True, False])

    Args:
        points: (n, 2) pixels.
        corners: (m, 2) pixels, in order.

    Returns:
        (n,) bool.
    """
    x, y = points[:, :1], points[:, 1:]
    (x0, y0), (x1, y1) = corners.T, np.roll(corners, -1, axis=0).T
    spans = (y0 <= y) != (y1 <= y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
    odd: NDArray[np.bool_] = (spans & (x < crossing)).sum(axis=1) % 2 == 1
    return odd
