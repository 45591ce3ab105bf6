"""The data of one moment for the report: weight, votes and distances, states, matches."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

from visup.agent import (
    Event,
    Hypothesis,
    Mind,
    ObjectBelief,
    Presence,
)
from visup.report.records import (
    Distance,
    MatchRow,
    Sample,
)
from visup.rules.geometry.outlines import outline_gap

MAX_MATCHES = 5
MAX_OBJECTS = 8
MAX_PAIRED = 5
MAX_CANDIDATES = 8
MOTION_RELATIONS = ("converging", "diverging", "keeping_distance")
KIND_WEIGHTS: Mapping[str, int] = {
    "verdict": 6,
    "stage_failing": 6,
    "stage_done": 5,
    "stage_started": 4,
    "stage_paused": 4,
    "coupled": 5,
    "decoupled": 5,
    "entry": 3,
    "noticed": 3,
    "reappearance": 3,
    "exit": 2,
    "occlusion": 2,
    "identified": 2,
}


def weight_of(events: Sequence[Event]) -> int:
    """The weight of a moment for the report; 0 if it needs no picture."""
    return max((KIND_WEIGHTS.get(e.kind, 0) + 4 * int(e.severity) for e in events), default=0)


def sample_of(mind: Mind) -> Sample:
    """The samples of one moment: votes of visible objects, distances between them.

    Distances are those of the relation 'distance' if rules report it, else the gap between the outlines of
    two visible objects.
    """
    objects = sorted(mind.present(), key=lambda b: -b.region.area)[:MAX_OBJECTS]
    votes = {
        b.id: {c.name: c.votes for c in b.candidates[:MAX_CANDIDATES]}
        for b in objects
        if b.candidates
    }
    pairs = itertools.combinations(sorted(objects[:MAX_PAIRED], key=lambda b: b.id), 2)
    distances = {(a.id, b.id): _distance(mind, a, b) for a, b in pairs}
    likely = {
        b.id: {c.name: c.confidence for c in b.candidates[:MAX_CANDIDATES]}
        for b in objects
        if b.candidates
    }
    known = {k: d for k, d in distances.items() if d is not None}
    return Sample(mind.time, votes, known, likely)


def _distance(mind: Mind, a: ObjectBelief, b: ObjectBelief) -> Distance | None:
    relation = mind.relation("distance", a.id, b.id)
    if relation is not None and relation.value is not None:
        return Distance(relation.value, relation.sigma)
    if not (a.presence is b.presence is Presence.SEEN):
        return None
    gap = outline_gap(a.region, b.region, math.inf)
    return None if gap is None else Distance(gap)


def state_of(mind: Mind) -> dict[tuple[str, ...], str]:
    """The values of the timelines: stages, relations of pairs, objects in view."""
    values: dict[tuple[str, ...], str] = {}
    for task in mind.tasks:
        values |= {("stage", task.task, s.stage): s.status.value for s in task.stages}
    for belief in mind.present():
        values["presence", str(belief.id)] = belief.presence.value
    for relation in mind.holding(*MOTION_RELATIONS):
        if len(relation.objects) == 2:
            low, high = sorted(relation.objects)
            values["relation", str(low), str(high)] = relation.name
    for coupling in mind.couplings:
        low, high = coupling.objects
        values["relation", str(low), str(high)] = "coupled"
    return values


def matches_of(hypotheses: Sequence[Hypothesis]) -> dict[int, tuple[MatchRow, ...]]:
    """The most similar views of each region, best first."""
    found: dict[int, list[MatchRow]] = {}
    for h in sorted(hypotheses, key=lambda h: (-h.similarity, h.name, h.view)):
        rows = found.setdefault(h.region_id, [])
        if len(rows) < MAX_MATCHES:
            rows.append(MatchRow(h.name, h.view, h.similarity))
    return {region: tuple(matches) for region, matches in found.items()}
