"""Outlines that meet in the image although the bodies do not touch: one moves on past the other.

What is carried touches where it comes to rest, or where it is let go of; until then its outline may pass over
everything in its way.
"""

from __future__ import annotations

from collections.abc import Callable

from visup.agent import Mind, Truth
from visup.rules.coupling.evidence import COUPLING
from visup.rules.geometry.regions import image_diagonal
from visup.rules.relations.reasoner import kinematics

LET_GO_GAP = 0.01
"""Gap of two coupled bodies from which on one has let go of the other, image diagonals."""


def goes_past(
    mind: Mind, objects: tuple[int, ...], rests: Callable[[tuple[int, ...]], bool]
) -> bool:
    """Whether outlines meet only because one body moves on past the other, or is carried past it.

    Args:
        mind: The mind.
        objects: Two objects whose outlines meet.
        rests: Whether one of two has come to rest at the other.
    """
    pair = set(objects)
    held = [c.objects for c in mind.couplings if len(pair & set(c.objects)) == 1]
    if held:
        return _moves_on(mind, objects)
    if mind.truth("passing_by", *objects) is Truth.TRUE and not rests(objects):
        return True
    evidence = mind.recall(COUPLING).get((min(objects), max(objects)))
    contact = None if evidence is None else evidence.contact
    return contact is not None and contact.settled_since is None


def gapes(mind: Mind, a: int, b: int) -> bool:
    """Whether there is a gap between the outlines of two bodies; False if unknown."""
    return kinematics(mind).pair("gap", a, b) > LET_GO_GAP * image_diagonal(mind.frame_size)


def _moves_on(mind: Mind, objects: tuple[int, ...]) -> bool:
    """Whether one has not slowed down since their outlines met, as far as is known."""
    evidence = mind.recall(COUPLING).get((min(objects), max(objects)))
    contact = None if evidence is None else evidence.contact
    return contact is not None and (contact.passing or not contact.known)
