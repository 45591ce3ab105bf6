"""Outlines that meet in the image although the bodies do not touch: one moves on past the other.

What is carried touches where it comes to rest, or where it is let go of; until then its outline may pass over
everything in its way.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from visup.agent import Mind, Truth
from visup.rules.coupling.contact import OutlineContact
from visup.rules.coupling.evidence import COUPLING
from visup.rules.geometry.regions import DIRECTIONS, image_diagonal
from visup.rules.relations.reasoner import kinematics, sample_window

LEAST_SAMPLES = 5
"""Fewest samples of a relative path."""

PAST = 0.05
"""Least length of a path past another body, image diagonals."""

STRAIGHT = 0.85
"""Least distance of its ends as a share of its length: who turns back comes near where he was."""

RESTING = 0.01
"""Speed below which a body rests, image diagonals per second: what is dropped is faster."""

LET_GO_GAP = 0.01
"""Gap of two coupled bodies from which on one has let go of the other, image diagonals."""


def goes_past(
    mind: Mind, objects: tuple[int, ...], rests: Callable[[tuple[int, ...]], bool]
) -> bool:
    """Whether outlines meet only because one body has passed the other, or is carried past it.

    Args:
        mind: The mind.
        objects: Two objects whose outlines meet.
        rests: Whether one of two has come to rest at the other.
    """
    if held := holds_on(mind, objects):
        contact = _contact(mind, objects)
        on = contact is not None and (contact.passing or not contact.known)
        if not all(gapes(mind, *other) for other in held):
            return on
    return mind.truth("passing_by", *objects) is Truth.TRUE and not rests(objects)


def moves_on(mind: Mind, objects: tuple[int, ...]) -> bool:
    """Whether one of two whose outlines meet has not slowed down at the other, as far as is known.

    What touches another body is stopped by it, or takes it along. Seen from above, outlines meet long
    before a boat is alongside; so a stage that consists of a contact has not begun until then. An invariant
    does not wait for it: what must not touch may do so at full speed. Nor does what is carried, which has
    a rule of its own (`goes_past`).
    """
    contact = _contact(mind, objects)
    unsettled = contact is not None and contact.settled_since is None
    return unsettled and not holds_on(mind, objects)


def went_past(mind: Mind, objects: tuple[int, ...]) -> bool:
    """Whether one of two has just gone past the other, rather than turned back before it.

    Then their relative path of the last second or so is straight, and its nearest point lies within it.
    """
    window = sample_window(mind)
    if len(objects) != 2 or not set(objects) <= set(window.ids) or holds_on(mind, objects):
        return False
    i, j = (window.ids.index(o) for o in objects)
    support = window.steady_support
    # The mean support point of an outline (its Steiner point, but for a factor) moves as the body does.
    path = 2.0 * (support[:, i] - support[:, j]) @ DIRECTIONS / len(DIRECTIONS)
    path = path[~np.isnan(path).any(axis=1)]
    if len(path) < LEAST_SAMPLES:
        return False
    way = path[-1] - path[0]
    length = float(np.hypot(*way))
    if length < PAST * image_diagonal(mind.frame_size):
        return False
    third = path[:: max(1, (len(path) - 1) // 3)]
    walked = float(np.hypot(*np.diff(third, axis=0).T).sum())
    return length > STRAIGHT * walked and float(path[0] @ way) < 0.0 < float(path[-1] @ way)


def put_down(mind: Mind, objects: tuple[int, ...]) -> bool:
    """Whether the first of some objects rests, and all that held it has let go of it."""
    first = objects[0]
    held = [c.objects for c in mind.couplings if first in c.objects]
    rests = kinematics(mind).one("speed", first) < RESTING * image_diagonal(mind.frame_size)
    return bool(held) and rests and all(gapes(mind, *pair) for pair in held)


def stopped_at(mind: Mind, objects: tuple[int, ...]) -> float:
    """When one of two whose outlines meet ceased to pass the other, seconds; minus infinity if it did not."""
    contact = _contact(mind, objects)
    return -math.inf if contact is None or contact.passing else contact.changed_at


def holds_on(mind: Mind, objects: tuple[int, ...]) -> list[tuple[int, ...]]:
    """The couplings of one of two bodies to a third one."""
    pair = set(objects)
    return [c.objects for c in mind.couplings if len(pair & set(c.objects)) == 1]


def gapes(mind: Mind, a: int, b: int) -> bool:
    """Whether there is a gap between the outlines of two bodies; False if unknown."""
    return kinematics(mind).pair("gap", a, b) > LET_GO_GAP * image_diagonal(mind.frame_size)


def _contact(mind: Mind, objects: tuple[int, ...]) -> OutlineContact | None:
    evidence = mind.recall(COUPLING).get((min(objects), max(objects)))
    return None if evidence is None else evidence.contact
