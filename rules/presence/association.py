"""What was seen becomes beliefs: regions to objects, health, plug-ins' percepts, what is unknown.

A new region becomes an unconfirmed object; whether it is an object at all, or one known before
that shows itself again, is for `presence.py` to say. Which object owns which region stands in the
mind's memory, so that an object keeps its id when the tracker gives its region another.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from visup.agent import (
    Hypothesis,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Percept,
    Presence,
    Region,
)
from visup.agent.model.fast_replace import replace

OWNERS = "rules.objects"
KNOWN_KINDS = frozenset({"region", "hypothesis", "depth", "health"})


@dataclass(frozen=True, slots=True)
class ObjectSettings:
    """How much is remembered, and for how long.

    Attributes:
        most_objects: Bound on remembered objects; those unseen for longest go first.
        most_owners: Bound on remembered region ids.
        forget_unconfirmed_s: A new region unseen for this long was nothing.
        forget_left_s: An object that left is remembered for this long.
        forget_hidden_s: A hidden object is remembered for this long.
        percept_age_s: Percepts of plug-ins' own kinds fade after this.
    """

    most_objects: int = 64
    most_owners: int = 256
    forget_unconfirmed_s: float = 0.5
    forget_left_s: float = 30.0
    forget_hidden_s: float = 300.0
    percept_age_s: float = 2.0


def region_owners(mind: Mind) -> Mapping[int, int]:
    """Region id -> object id, for all regions that are remembered."""
    found: Mapping[int, int] = mind.memory.get(OWNERS, MappingProxyType({}))
    return found


def hypotheses_by_object(
    mind: Mind, observation: Observation
) -> Mapping[int, tuple[Hypothesis, ...]]:
    """Object id -> what was hypothesised of its region in this step; only objects of which something was."""
    owner = region_owners(mind)
    said: dict[int, tuple[Hypothesis, ...]] = {}
    for h in observation.of("hypothesis"):
        object_id = owner.get(h.region_id)
        if object_id is not None:
            said[object_id] = (*said.get(object_id, ()), h)
    return said


def reassign_region(mind: Mind, region_id: int, object_id: int) -> Mind:
    """The same mind with a region owned by another object from now on."""
    changed = {**region_owners(mind), region_id: object_id}
    return mind.remember(OWNERS, MappingProxyType(changed))


def delete_objects(mind: Mind, ids: frozenset[int]) -> Mind:
    """The same mind without some objects; regions that they owned are owned by none."""
    if not ids:
        return mind
    kept = {i: b for i, b in mind.objects.items() if i not in ids}
    left = {r: o for r, o in region_owners(mind).items() if o not in ids}
    answers = {i: name for i, name in mind.answers.items() if i not in ids}
    mind = replace(mind, objects=MappingProxyType(kept), answers=MappingProxyType(answers))
    return mind.remember(OWNERS, MappingProxyType(left))


@dataclass(frozen=True, slots=True)
class ObjectReasoner:
    """Reasoner of the update phase: percepts enter the mind.

    When no behaviour looked for regions in this step, nothing is concluded about any object.
    """

    settings: ObjectSettings = ObjectSettings()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Take in one observation; see `Reasoner`."""
        mind = replace(
            mind,
            time=observation.time,
            frame_index=observation.frame_index,
            frame_size=observation.frame_size,
            unknown=observation.unknown,
            percepts=self._fresh(mind.percepts, observation),
        )
        for health in observation.of("health"):
            mind = replace(mind, health=health)
        if observation.observed("region"):
            mind = self._see(mind, observation)
        return Outcome(self._forget(mind))

    def _see(self, mind: Mind, observation: Observation) -> Mind:
        owner = dict(region_owners(mind))
        beliefs: dict[int, ObjectBelief] = {}
        # A region that an object held last comes first, so that it cannot lose it to an older one.
        regions = sorted(
            observation.of("region"), key=lambda r: not _is_current_region(mind, owner, r)
        )
        for region in regions:
            object_id = owner.get(region.id)
            if object_id is None or object_id in beliefs:
                object_id = _free_id(region.id, mind.objects.keys() | beliefs.keys())
            owner.pop(region.id, None)
            owner[region.id] = object_id
            beliefs[object_id] = _sighted(mind.objects.get(object_id), object_id, region, mind.time)
        newest = list(owner.items())[-self.settings.most_owners :]
        mind = mind.with_objects(*beliefs.values())
        return mind.remember(OWNERS, MappingProxyType(dict(newest)))

    def _fresh(
        self, known: Mapping[str, tuple[Percept, ...]], observation: Observation
    ) -> Mapping[str, tuple[Percept, ...]]:
        oldest = observation.time - self.settings.percept_age_s
        fresh = {
            k: kept for k, ps in known.items() if (kept := tuple(p for p in ps if p.time >= oldest))
        }
        new: dict[str, list[Percept]] = {}
        for report in observation.reports:
            for p in report.percepts:
                if p.kind not in KNOWN_KINDS:
                    new.setdefault(p.kind, []).append(p)
        return MappingProxyType({**fresh, **{k: tuple(ps) for k, ps in new.items()}})

    def _forget(self, mind: Mind) -> Mind:
        gone = {i for i, b in mind.objects.items() if self._stale(b, mind.time)}
        left = [b for i, b in mind.objects.items() if i not in gone]
        left.sort(key=lambda b: (b.confirmed, b.last_seen, b.id))
        gone |= {b.id for b in left[: max(0, len(left) - self.settings.most_objects)]}
        return delete_objects(mind, frozenset(gone))

    def _stale(self, belief: ObjectBelief, now: float) -> bool:
        unseen = now - belief.last_seen
        if not belief.confirmed:
            return unseen > self.settings.forget_unconfirmed_s
        if belief.presence is Presence.LEFT:
            return unseen > self.settings.forget_left_s
        return belief.presence is Presence.HIDDEN and unseen > self.settings.forget_hidden_s


def _is_current_region(mind: Mind, owner: Mapping[int, int], region: Region) -> bool:
    belief = mind.objects.get(owner.get(region.id, -1))
    return belief is not None and belief.region.id == region.id


def _free_id(wanted: int, taken: set[int]) -> int:
    while wanted in taken:
        wanted += 1000
    return wanted


def _sighted(old: ObjectBelief | None, id_: int, region: Region, now: float) -> ObjectBelief:
    if old is None:
        return ObjectBelief(id_, region, Presence.SEEN, first_seen=now, last_seen=now)
    return replace(old, region=region, last_seen=now)
