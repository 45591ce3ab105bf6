"""Evidence on coupling: the memory and the observations of pairs, and the relations derived from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from visup.agent import (
    CameraMotion,
    Column,
    Coupling,
    Mind,
    Presence,
    Region,
    RelationTable,
)
from visup.agent.model.memory import MemoryKey
from visup.agent.model.relation_columns import UNKNOWN_CODE, ColumnLayout, RelationBlock
from visup.rules.coupling.contact import ContactSettings, Feet, OutlineContact
from visup.rules.coupling.relative_motion import RelativeTrack, RelativeVelocity
from visup.rules.geometry.regions import image_diagonal
from visup.rules.presence.object_tracks import merged_pairs
from visup.rules.relations.reasoner import kinematics

CONFIDENCE = 0.9
"""Confidence of couplings: outlines at rest relative to each other may still be apart in depth."""

ALONG_SPEED = 0.05
"""Least speed of two bodies that may move as one although their outlines are apart, image diagonals per
second."""

ALONG_SHARE = 0.4
"""Greatest relative speed of such bodies, as a share of the speed of the slower one."""

COLUMNS = ColumnLayout(
    (
        Column(("", "coupled"), (0, 0), 0),
        Column(("", "in_contact"), (1, 1), 0, listed="none"),
        Column(("", "passing_by"), (2, 2), 0, listed="none"),
    )
)

YES, MAYBE, NO = 1, 0, -1
"""Codes of truth values: true, unknown, false."""

Pair = tuple[int, int]
Camera = CameraMotion | None


@dataclass(frozen=True, slots=True, eq=False)
class CouplingEvidence:
    """The memory of one pair; times in seconds.

    Attributes:
        converged_at: Time when they were last converging without touching, or None.
        rest_odds: Log odds, at least 0, that they touch and are at rest relative to each other.
        rest_since: Time since when these have been above 0, or None.
        apart_since: Time since when they are apart, or None.
        apart_path: Relative path length since then, while they were tracked, pixels.
        relative_track: Their relative motion while they are near each other, or None.
        contact: Contact of their outlines; None while these do not meet.
        decoupled_at: Time when they were last decoupled, or None.
    """

    converged_at: float | None = None
    rest_odds: float = 0.0
    rest_since: float | None = None
    apart_since: float | None = None
    apart_path: float = 0.0
    relative_track: RelativeTrack | None = None
    contact: OutlineContact | None = None
    decoupled_at: float | None = None

    def was_decoupled_since(self, moment: float) -> bool:
        """Whether they were decoupled after a given time, seconds."""
        return self.decoupled_at is not None and self.decoupled_at > moment


COUPLING: MemoryKey[Mapping[Pair, CouplingEvidence]] = MemoryKey(
    "rules.coupling", MappingProxyType({})
)


NO_EVIDENCE = CouplingEvidence()


class PairObservation(NamedTuple):
    """The observation of a pair in one step; lives only while the reasoner runs.

    Attributes:
        pair: Ids of the two objects, ascending.
        touching: Truth code.
        converging: Truth code.
        diverging: Truth code.
        gap: Gap between their outlines, pixels; NaN if unknown.
        host: Id of the object whose region contains both, or None.
    """

    pair: Pair
    touching: int
    converging: int
    diverging: int
    gap: float
    host: int | None


def common_speed(mind: Mind, pair: Pair) -> float:
    """The speed of the slower body of a pair, pixels per second; unknown ones are ignored, 0 if both are."""
    speeds = [own_speed(mind, i) for i in pair]
    return min((s for s in speeds if s is not None), default=0.0)


def common_speed_nearby(
    mind: Mind, pair: Pair, track: RelativeTrack | None, relative: RelativeVelocity | None
) -> float:
    """`common_speed` with only the part of a larger body near the other one: an arm is slower than its hand.

    The velocity of the part near the other body is that of the other body, changed by their relative one.
    """
    if track is None or relative is None or track.first.local == track.second.local:
        return common_speed(mind, pair)
    one = own_velocity(mind, pair[1] if track.first.local else pair[0])
    if one is None:
        return common_speed(mind, pair)
    towards = -1.0 if track.first.local else 1.0
    part = np.add(one, towards * relative.velocity)
    return float(min(np.hypot(*one), np.hypot(*part)))


def move_alike(mind: Mind, pair: Pair) -> bool:
    """Whether two fast bodies move alike, so that a gap between them does not mean that they have separated.

    The visible outline of an arm that leaves the image shrinks towards the border, and so seems to recede
    from the object in its hand. An object that is dropped, or left behind, soon moves differently.
    """
    shared_speed, relative_speed = (
        common_speed(mind, pair),
        kinematics(mind).pair("relative_speed", *pair),
    )
    fast = shared_speed > ALONG_SPEED * image_diagonal(mind.frame_size)
    return bool(fast and relative_speed < ALONG_SHARE * shared_speed)


def own_velocity(mind: Mind, number: int) -> tuple[float, float] | None:
    """Velocity of a body, pixels per second: the smaller of outline motion and image motion; None if unknown.

    The outline of a body that is being covered recedes as fast as its occluder advances, and that of an
    approaching body grows; image motion is free of both effects.

    An approximation: image motion contains the camera's. A body followed by a moving camera counts as slow,
    and must rest relative to another one for longer before the two count as coupled.
    """
    body, now = mind.objects[number], kinematics(mind)
    found = [now.velocity[now.ids.index(number)]] if number in now.ids else []
    if body.last_seen == mind.time and body.region.velocity_sigma > 0.0:
        found.append(np.asarray(body.region.velocity))
    known = [(float(v[0]), float(v[1])) for v in found if not np.isnan(v).any()]
    return min(known, key=lambda v: math.hypot(*v), default=None)


def own_speed(mind: Mind, number: int) -> float | None:
    """The speed that belongs to `own_velocity`, pixels per second."""
    velocity = own_velocity(mind, number)
    return None if velocity is None else math.hypot(*velocity)


def observed_pairs(table: RelationTable, mind: Mind) -> list[PairObservation]:
    """Observations of all pairs of present objects."""
    ids, now = table.ids, kinematics(mind)
    hosts = {(min(pair), max(pair)): pair[1] for pair in merged_pairs(mind)}
    gaps = now.gap.tolist() if now.ids == ids else None
    codes = zip(*map(table.codes, ("touching", "converging", "diverging")), strict=True)
    observed = []
    for i, a in enumerate(ids):
        for j in range(i + 1, len(ids)):
            b = ids[j]
            gap = gaps[i][j] if gaps else now.pair("gap", a, b)
            touching, closing, parting = next(codes)
            host = hosts.get((a, b))
            observed.append(PairObservation((a, b), touching, closing, parting, gap, host))
    return observed


def touching_bodies(observed: Sequence[PairObservation]) -> dict[int, set[int]]:
    """Id of an object -> ids of the objects that touch it; pairs that share a region are left out."""
    found: dict[int, set[int]] = {}
    for seen in observed:
        if seen.touching == YES and seen.host is None:
            a, b = seen.pair
            found.setdefault(a, set()).add(b)
            found.setdefault(b, set()).add(a)
    return found


def relation_table(mind: Mind) -> RelationTable:
    """The relations of all present objects."""
    ids, table = tuple([b.id for b in mind.present()]), mind.relations
    if isinstance(table, RelationTable) and table.ids == ids:
        return table
    return RelationTable(ids, extra=tuple(table))


def coupling_cells(
    observed: Sequence[PairObservation],
    coupled: Mapping[Pair, Coupling],
    evidence: Mapping[Pair, CouplingEvidence],
    mind: Mind,
    settings: ContactSettings,
) -> RelationBlock:
    """The columns of the relations `coupled`, `in_contact` and `passing_by` for all observed pairs."""
    hidden = {i for i, b in mind.objects.items() if b.presence is not Presence.SEEN}
    state = np.zeros((3, len(observed)), dtype=np.int8)
    since = np.full(state.shape, mind.time)
    for k, seen in enumerate(observed):
        contact = evidence[seen.pair].contact
        if contact is not None:
            confirmed = contact.confirmed_since
            unconfirmed = 0 if contact.in_front else UNKNOWN_CODE
            state[1, k] = unconfirmed if confirmed is None else 1
            since[1, k] = (
                contact.met_at if confirmed is None else min(confirmed, contact.changed_at)
            )
            least_path = settings.doubt_share * smaller_size(seen.pair, mind)
            state[2, k] = _in_front(contact, least_path)
            since[2, k] = contact.changed_at
        if seen.pair in coupled:
            doubted = evidence[seen.pair].apart_since is not None
            state[:2, k], state[2, k] = UNKNOWN_CODE if doubted else 1, 0
            since[0, k] = coupled[seen.pair].since
        elif seen.touching == MAYBE or (hidden and not hidden.isdisjoint(seen.pair)):
            state[:, k] = UNKNOWN_CODE
        elif (decoupled := evidence[seen.pair].decoupled_at) is not None:
            since[0, k] = decoupled
    return RelationBlock(COLUMNS, state, since, np.full((1, len(observed)), CONFIDENCE))


def _in_front(contact: OutlineContact, far: float) -> bool:
    """Whether one body has moved more than `far` pixels across the other, so in front of it or behind it."""
    return contact.in_front or (contact.passing and contact.path > far)


def smaller_size(pair: tuple[int, ...], mind: Mind) -> float:
    """Size of the smaller one of two bodies: the square root of its area, pixels."""
    return min(float(np.sqrt(mind.objects[i].region.area)) for i in pair)


def pair_regions(seen: PairObservation, mind: Mind) -> tuple[Region, Region] | None:
    """The current regions of a pair, twice the same one when they are merged; None if either is not usable.

    The visible rest of a hidden body is not usable: it moves like the edge of its occluder.
    """
    if seen.host is not None:
        host = mind.objects[seen.host]
        return (host.region, host.region) if host.last_seen == mind.time else None
    first, second = (mind.objects[i] for i in seen.pair)
    if first.last_seen < mind.time or second.last_seen < mind.time:
        return None
    if Presence.HIDDEN in (first.presence, second.presence):
        return None
    return first.region, second.region


def feet_of(seen: PairObservation, mind: Mind) -> Feet | None:
    """The lowest points of a pair of which exactly one body is carried by a third one; None otherwise.

    None also if either is not seen, or if they share a region.
    """
    others = (c.objects for c in mind.couplings if c.objects != seen.pair)
    coupled = {i for objects in others if not mind.one_machine(*objects) for i in objects}
    carried = coupled.intersection(seen.pair)
    regions = pair_regions(seen, mind)
    if len(carried) != 1 or regions is None or seen.host is not None:
        return None
    one, other = regions if seen.pair[0] in carried else regions[::-1]
    (_, y, _, height), (_, top, _, size) = one.bbox, other.bbox
    return Feet(float(y + height), float(top + size), float(height))


def regions_apart(pair: Pair, mind: Mind) -> tuple[Region, Region]:
    """The regions of a merged pair: the last one of the hidden body, and the merged one."""
    first, second = (mind.objects[i].region for i in pair)
    return first, second
