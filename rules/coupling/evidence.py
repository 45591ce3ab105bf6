"""What is remembered and seen of two bodies that may be one, and what of it becomes relations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from visup.agent import Column, Coupling, Mind, Presence, Region, RelationTable
from visup.agent.model.memory import MemoryKey
from visup.agent.model.relation_columns import UNKNOWN_CODE, ColumnLayout, RelationBlock
from visup.rules.coupling.contact import ContactSettings, OutlineContact
from visup.rules.coupling.relative_motion import RelativeTrack
from visup.rules.presence.object_tracks import merged_pairs
from visup.rules.relations.reasoner import kinematics

CONFIDENCE = 0.9
"""How sure couplings are: outlines at rest to each other may still be apart in depth."""

COLUMNS = ColumnLayout(
    (
        Column(("", "coupled"), (0, 0), 0),
        Column(("", "in_contact"), (1, 1), 0, listed="none"),
        Column(("", "passing_by"), (2, 2), 0, listed="none"),
    )
)

YES, MAYBE, NO = 1, 0, -1
"""Codes of truths."""

Pair = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class CouplingEvidence:
    """What is remembered of one pair: seconds since when each holds, or None.

    Attributes:
        converged_at: When they last were converging, not touching yet.
        rest_odds: Logarithm of the odds, from 0 on, that they touch and are at rest.
        rest_since: Since when these are above 0.
        apart_since: Since when they are apart.
        relative_track: How they have moved relative to each other since they are near.
        contact: Whether their outlines meet, and whether that is meant.
        decoupled_at: Since when they are no longer coupled, if they were.
    """

    converged_at: float | None = None
    rest_odds: float = 0.0
    rest_since: float | None = None
    apart_since: float | None = None
    relative_track: RelativeTrack | None = None
    contact: OutlineContact | None = None
    decoupled_at: float | None = None


COUPLING: MemoryKey[Mapping[Pair, CouplingEvidence]] = MemoryKey(
    "rules.coupling", MappingProxyType({})
)


NO_EVIDENCE = CouplingEvidence()


class PairObservation(NamedTuple):
    """Two objects as they are seen now; lives only while the reasoner runs.

    Attributes:
        pair: Their ids.
        touching: Code of a truth, and
        converging: the same, and
        diverging: the same.
        gap: Of their outlines, pixels; NaN unknown.
        host: Id of the one in whose region both are merged, or None.
    """

    pair: Pair
    touching: int
    converging: int
    diverging: int
    gap: float
    host: int | None


def common_speed(mind: Mind, pair: Pair) -> float:
    """The speed of the slower of two, pixels per second; that of the one whose speed is known; else 0."""
    speeds = [own_speed(mind, i) for i in pair]
    return min((s for s in speeds if s is not None), default=0.0)


def own_speed(mind: Mind, number: int) -> float | None:
    """Speed of a body itself, pixels per second; None while unknown.

    The outline of what is being covered goes back as fast as what covers it comes on, and that of what
    comes nearer grows; image motion knows neither. So the slower of both is taken.

    An approximation: image motion still has the camera's in it. What a moving camera follows counts as
    slow, and must rest at the other for longer before the two count as one.
    """
    body = mind.objects[number]
    told = [kinematics(mind).one("speed", number)]
    if body.last_seen == mind.time and body.region.velocity_sigma > 0.0:
        told.append(float(np.hypot(*body.region.velocity)))
    return min((s for s in told if s == s), default=None)  # NaN is not equal to itself


def observed_pairs(table: RelationTable, mind: Mind) -> list[PairObservation]:
    """All pairs of present objects as they are seen now."""
    ids, now = table.ids, kinematics(mind)
    hosts = {(min(pair), max(pair)): pair[1] for pair in merged_pairs(mind)}
    gaps = now.gap.tolist() if now.ids == ids else None
    told = zip(*map(table.codes, ("touching", "converging", "diverging")), strict=True)
    observed = []
    for i, a in enumerate(ids):
        for j in range(i + 1, len(ids)):
            b = ids[j]
            gap = gaps[i][j] if gaps else now.pair("gap", a, b)
            touching, closing, parting = next(told)
            host = hosts.get((a, b))
            observed.append(PairObservation((a, b), touching, closing, parting, gap, host))
    return observed


def relation_table(mind: Mind) -> RelationTable:
    """The relations of all present objects."""
    ids, table = tuple([b.id for b in mind.present()]), mind.relations
    if isinstance(table, RelationTable) and table.ids == ids:
        return table
    return RelationTable(ids, extra=tuple(table))


def coupling_cells(
    observed: Sequence[PairObservation],
    coupled: Mapping[Pair, Coupling],
    kept: Mapping[Pair, CouplingEvidence],
    mind: Mind,
) -> RelationBlock:
    """The relations of being coupled and in contact."""
    hidden = {i for i, b in mind.objects.items() if b.presence is not Presence.SEEN}
    state = np.zeros((3, len(observed)), dtype=np.int8)
    since = np.full(state.shape, mind.time)
    for k, seen in enumerate(observed):
        contact = kept[seen.pair].contact
        if contact is not None:
            settled = contact.settled_since
            state[1, k] = UNKNOWN_CODE if settled is None else 1
            since[1, k] = contact.met_at if settled is None else min(settled, contact.changed_at)
            state[2, k] = _in_front(contact, seen.pair, mind)
            since[2, k] = contact.changed_at
        if seen.pair in coupled:
            doubted = kept[seen.pair].apart_since is not None
            state[:2, k], state[2, k] = UNKNOWN_CODE if doubted else 1, 0
            since[0, k] = coupled[seen.pair].since
        elif seen.touching == MAYBE or (hidden and not hidden.isdisjoint(seen.pair)):
            state[:, k] = UNKNOWN_CODE
        elif (parted := kept[seen.pair].decoupled_at) is not None:
            since[0, k] = parted
    return RelationBlock(COLUMNS, state, since, np.full((1, len(observed)), CONFIDENCE))


def _in_front(contact: OutlineContact, pair: Pair, mind: Mind) -> bool:
    """Whether one of two whose outlines meet has gone so far across the other that it does not touch it."""
    size = min(float(np.sqrt(mind.objects[i].region.area)) for i in pair)
    return contact.passing and contact.path > ContactSettings().doubt_share * size


def pair_regions(seen: PairObservation, mind: Mind) -> tuple[Region, Region] | None:
    """The regions in which the two are seen now, twice the same one when they are merged.

    What still shows of a body that another one hides moves as the edge of that one does: it tells nothing.
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


def regions_apart(pair: Pair, mind: Mind) -> tuple[Region, Region]:
    """The regions of two that are merged: what was last seen of the one, and the merged one."""
    first, second = (mind.objects[i].region for i in pair)
    return first, second
