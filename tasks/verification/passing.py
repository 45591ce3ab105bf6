"""Outlines that meet in the image although the bodies do not touch: one moves on past the other.

What is carried touches where it comes to rest, or where it is let go of; until then its outline may pass over
everything in its way.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from visup.agent import Mind, Truth
from visup.rules.coupling.contact import OutlineContact
from visup.rules.coupling.evidence import COUPLING
from visup.rules.geometry.regions import image_diagonal
from visup.rules.relations.reasoner import kinematics

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
