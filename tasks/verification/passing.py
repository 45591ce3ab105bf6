"""Outlines that meet in the image although the bodies are not in contact: one passes the other.

A carried body is in contact with another one where it comes to rest, or where it is released; until then its
outline may pass over anything in its way.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, Relation, Truth
from visup.rules.coupling.contact import ContactSettings, OutlineContact
from visup.rules.coupling.evidence import COUPLING, smaller_size
from visup.rules.formula.truth import truth_if
from visup.rules.geometry.regions import DIRECTIONS, Floats, image_diagonal
from visup.rules.presence.object_tracks import presence_memory
from visup.rules.relations.reasoner import kinematics, sample_window
from visup.rules.relations.samples import SampleWindow

MIN_SAMPLES = 5
"""Fewest samples of a relative path."""

MIN_PATH = 0.05
"""Least length of a path past another body, image diagonals."""

STRAIGHT = 0.85
"""Least distance between the ends of such a path, as a share of its length; less for a body that turns
back."""

STILL_MOVING = 0.5
"""Least speed in the last third of such a path, as a share of the mean speed."""

BEYOND = 0.2
"""Least share of such a path that lies beyond the point nearest to the other body."""

RADIAL_SHARE = 0.45
"""Least rate of change of distance, as a share of the relative speed, that counts as a trend; for a body that
flies around another one it reaches 0.4."""

RESTED_S = 0.6
"""How long a body must have rested to have been put down, seconds."""

LET_GO_GAP = 0.01
"""Gap between coupled bodies from which one has released the other, image diagonals."""

MEETING_PX = 1.0
"""Gap below which outlines meet, pixels."""


def goes_past(
    mind: Mind, objects: tuple[int, ...], rests: Callable[[tuple[int, ...]], bool]
) -> bool:
    """Whether outlines meet only because one body has passed the other, or is carried past it.

    Args:
        mind: The mind.
        objects: Ids of two objects whose outlines meet.
        rests: Whether two objects are at rest relative to each other.
    """
    contact = _contact(mind, objects)
    if contact is not None and contact.in_front:
        return True
    if held := holds_on(mind, objects):
        on = contact is not None and (contact.passing or not contact.motion_known)
        if not all(gapes(mind, *other) for other in held):
            return on
        # A released body falls onto the one that it met, unless it has moved across that by more than the
        # size of the smaller one.
        return on and contact is not None and contact.path > smaller_size(objects, mind)
    return mind.truth("passing_by", *objects) is Truth.TRUE and not rests(objects)


def passed_since(mind: Mind, objects: tuple[int, ...]) -> float | None:
    """Time since when one of two bodies has been passing the other, by their outlines as well, or None.

    Something that moves over a body at rest may be mistaken for motion of that body, not of its outline. None
    also for a carried body, which has a rule of its own (`goes_past`).
    """
    passing = mind.relation("passing_by", *objects)
    if passing is None or passing.truth is not Truth.TRUE or holds_on(mind, objects):
        return None
    return passing.since if slow(mind, objects) is Truth.FALSE else None


def slow(mind: Mind, objects: tuple[int, ...]) -> Truth:
    """Whether two bodies hardly move relative to each other now."""
    speed = kinematics(mind).pair("relative_speed", *objects)
    least = ContactSettings().passing * image_diagonal(mind.frame_size)
    return Truth.UNKNOWN if math.isnan(speed) else truth_if(speed < least)


def moves_on(mind: Mind, objects: tuple[int, ...]) -> bool:
    """Whether the outlines of two bodies meet, but neither is known to have slowed down at the other.

    A body that touches another one is stopped by it, or takes it along. Seen from above, outlines meet long
    before a boat is alongside; so a stage that consists of a contact has not begun until it slows down. This
    does not apply to invariants, since bodies that must not touch may collide at full speed, nor to carried
    bodies, which have a rule of their own (`goes_past`).
    """
    contact = _contact(mind, objects)
    unsettled = contact is not None and contact.confirmed_since is None
    return unsettled and not holds_on(mind, objects)


def went_past(mind: Mind, recession: Relation) -> bool:
    """Whether one of two receding bodies has just passed the other and moves on, rather than turned back.

    It has if their relative path of the last second or so is straight, its point nearest to the other body
    lies well within it, and they have receded since then. (A jump of the outline later, when parts of a body
    go out of view, is not a passage.) False for a carried body, which may be on a detour.

    Args:
        mind: The mind.
        recession: The relation that the two recede.
    """
    objects = recession.objects
    if len(objects) != 2 or holds_on(mind, objects):
        return False
    diagonal, times = image_diagonal(mind.frame_size), sample_window(mind).times
    path = _centres(mind, objects[0]) - _centres(mind, objects[1])
    path = path[~np.isnan(path).any(axis=1)]
    if len(path) < MIN_SAMPLES or recession.since < times[0]:
        return False
    thirds = path[[0, len(path) // 3, 2 * len(path) // 3, -1]]
    walked = np.hypot(*np.diff(thirds, axis=0).T)
    way = path[-1] - path[0]
    length = float(np.hypot(*way))
    if length < MIN_PATH * diagonal or length < STRAIGHT * float(walked.sum()):
        return False
    along = path @ way / length
    still = float(walked[-1]) > STILL_MOVING * length / 3
    return still and float(along[0]) < 0.0 and float(along[-1]) > BEYOND * length


def goes_round(mind: Mind, trend: str, objects: tuple[int, ...]) -> bool:
    """Whether a trend is due to one body moving around the other now; False if unknown."""
    now, pair = kinematics(mind), (objects[0], objects[1])
    rate, speed = now.pair("rate", *pair), now.pair("relative_speed", *pair)
    return (rate if trend == "diverging" else -rate) < RADIAL_SHARE * speed


def went_round(mind: Mind, trend: Relation) -> bool:
    """Whether a trend was due to one body moving around the other, even if it has come to rest since.

    It was if the gap has changed little, compared with their relative displacement since the trend began.
    """
    window, objects = sample_window(mind), trend.objects
    if not set(objects) <= set(window.ids):
        return False
    i, j = (window.ids.index(o) for o in objects)
    gap, path = window.separation[:, i, j], _centres(mind, objects[0]) - _centres(mind, objects[1])
    known = (window.times >= trend.since) & ~np.isnan(gap) & ~np.isnan(path).any(axis=1)
    gap, path = gap[known], path[known]
    way = float(np.hypot(*(path[-1] - path[0]))) if len(path) > 1 else 0.0
    if way < MIN_PATH * image_diagonal(mind.frame_size):
        return False
    change = float(gap[-1] - gap[0])
    return (change if trend.name == "diverging" else -change) < RADIAL_SHARE * way


def put_down(mind: Mind, objects: tuple[int, ...]) -> bool:
    """Whether the first of some objects has just been put down: it rests, and all that held it released it.

    It must rest, since an object that is dropped falls first.
    """
    first, window = objects[0], sample_window(mind)
    held = {pair: at for pair, at in _held(mind).items() if first in pair}
    if not held or first not in window.ids:
        return False
    recent = window.times > min(held.values()) - RESTED_S
    least = LET_GO_GAP * image_diagonal(mind.frame_size)
    path = _centres(mind, first)[recent]
    path = path[~np.isnan(path).any(axis=1)]
    rests = len(path) > 1 and float(np.ptp(path, axis=0).max()) < least
    opened = all(_opened(window, pair, recent) > least for pair in held)
    # Decoupling is required as well, since a jump of an outline also opens a gap.
    return rests and opened and all(mind.truth("coupled", *p) is not Truth.TRUE for p in held)


def _held(mind: Mind) -> dict[tuple[int, ...], float]:
    """Pairs that are coupled, or were at most `RESTED_S` ago -> until when, seconds."""
    held: dict[tuple[int, ...], float] = {c.objects: mind.time for c in mind.couplings}
    for pair, evidence in mind.recall(COUPLING).items():
        parted = evidence.decoupled_at
        if parted is not None and parted > mind.time - RESTED_S:
            held.setdefault(pair, parted)
    return held


def _opened(window: SampleWindow, pair: tuple[int, ...], recent: NDArray[np.bool_]) -> float:
    """Growth of the gap between two bodies since its minimum in the recent samples, pixels; 0 if unknown."""
    if not set(pair) <= set(window.ids):
        return 0.0
    i, j = (window.ids.index(o) for o in pair)
    distance = window.separation[recent, i, j]
    distance = np.maximum(distance[~np.isnan(distance)], 0.0)
    return float(distance[-1] - distance.min()) if len(distance) else 0.0


def _centres(mind: Mind, body: int) -> Floats:
    """(T, 2) pixels: Steiner point of an outline relative to the static scene; NaN where unseen."""
    window = sample_window(mind)
    if body not in window.ids:
        return np.full((len(window.times), 2), np.nan)
    support = window.steady_support[:, window.ids.index(body)]
    centres: Floats = 2.0 / len(DIRECTIONS) * support @ DIRECTIONS
    return centres


def vanished_into(mind: Mind, objects: tuple[int, ...]) -> float | None:
    """Time since when one of two objects has been hidden by the other, which it approached; None otherwise.

    It counts as contact: a parcel has been dropped into a bin. *Approximation*: it may also have gone behind.
    Therefore this is used where a stage requires the contact, and never against a task.
    """
    if len(objects) != 2:
        return None
    tracks = presence_memory(mind).tracks
    for body, other in (objects, objects[::-1]):
        if body in tracks and tracks[body].vanished_into == other:
            return tracks[body].last_seen
    return None


def stopped_at(mind: Mind, objects: tuple[int, ...]) -> float:
    """When one of two bodies ceased to pass the other, seconds; minus infinity if it still does.

    Also minus infinity if their outlines do not meet.
    """
    contact = _contact(mind, objects)
    return -math.inf if contact is None or contact.passing else contact.changed_at


def holds_on(mind: Mind, objects: tuple[int, ...]) -> list[tuple[int, ...]]:
    """The couplings (pairs of ids) of either of two bodies to a third one."""
    pair = set(objects)
    return [c.objects for c in mind.couplings if len(pair & set(c.objects)) == 1]


def came_apart(mind: Mind, objects: tuple[int, ...]) -> Relation | None:
    """The relation `decoupled` of two bodies that were coupled, are apart now, and do not move together.

    None otherwise. It contradicts `moving_together` where no diverging trend does, since the two may stay
    near each other: a gripper goes after an object that it has dropped.
    """
    evidence = mind.recall(COUPLING).get((min(objects), max(objects)))
    apart = {mind.truth(name, *objects) for name in ("touching", "coupled")} == {Truth.FALSE}
    if evidence is None or evidence.decoupled_at is None or not apart:
        return None
    if mind.truth("moving_together", *objects) is Truth.TRUE:
        return None
    return Relation("decoupled", objects, Truth.TRUE, evidence.decoupled_at)


def still_meet(mind: Mind, objects: tuple[int, ...]) -> bool:
    """Whether two bodies are in contact and their outlines still meet, so that an observed trend is spurious.

    Fingers that close, and an arm that comes further into view, seem to recede from the object they hold.
    """
    gap = gap_between(mind, objects)
    touches = mind.truth("in_contact", *objects) is Truth.TRUE
    return touches and gap is not None and gap < MEETING_PX


def gapes(mind: Mind, a: int, b: int) -> bool:
    """Whether there is a gap between the outlines of two bodies; False if unknown."""
    return kinematics(mind).pair("gap", a, b) > LET_GO_GAP * image_diagonal(mind.frame_size)


def gap_between(mind: Mind, objects: tuple[int | None, ...]) -> float | None:
    """The gap between the outlines of two bodies, pixels; None if unknown, or if there are not two."""
    if len(objects) != 2 or objects[0] is None or objects[1] is None:
        return None
    gap = kinematics(mind).pair("gap", objects[0], objects[1])
    return None if math.isnan(gap) else gap


def _contact(mind: Mind, objects: tuple[int, ...]) -> OutlineContact | None:
    evidence = mind.recall(COUPLING).get((min(objects), max(objects)))
    return None if evidence is None else evidence.contact
