"""Data association: which region belongs to which object, over time.

The segmenter has its own region ids and may give a body a new one, such as after occlusion. The mind's memory
maps region ids to objects, so that an object keeps its id: `associate` finds the owners of a frame's regions,
`reassign_region` changes an owner when an object is re-identified (`reidentification.py`), and
`delete_objects` ends ownership. Nothing else changes the map.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from visup.agent import Hypothesis, Mind, Observation, Region
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey

OWNERS: MemoryKey[Mapping[int, int]] = MemoryKey("rules.objects", MappingProxyType({}))


def region_owners(mind: Mind) -> Mapping[int, int]:
    """Region id -> object id, for all remembered regions."""
    return mind.recall(OWNERS)


def hypotheses_by_object(
    mind: Mind, observation: Observation
) -> Mapping[int, tuple[Hypothesis, ...]]:
    """Object id -> hypotheses about its region in this step; only objects with hypotheses."""
    owner = region_owners(mind)
    hypotheses: dict[int, tuple[Hypothesis, ...]] = {}
    for h in observation.of("hypothesis"):
        object_id = owner.get(h.region_id)
        if object_id is not None:
            hypotheses[object_id] = (*hypotheses.get(object_id, ()), h)
    return hypotheses


def recognised(mind: Mind, observation: Observation) -> frozenset[int]:
    """Objects that a behaviour recognised by appearance: it reports a region together with its identity.

    Such a region is the object's own, however near another one is; of regions that merely move together
    it is unknown how many bodies they are.
    """
    owner = region_owners(mind)
    return frozenset(owner[i] for i in recognised_regions(observation) if i in owner)


def recognised_regions(observation: Observation) -> frozenset[int]:
    """Regions that a behaviour recognised by appearance; see `recognised`."""
    found = set[int]()
    for report in observation.reports:
        if {"region", "hypothesis"} <= set(report.gives):
            found.update(p.value.region_id for p in report.percepts if p.kind == "hypothesis")
    return frozenset(found)


def associate(mind: Mind, observation: Observation) -> tuple[dict[int, Region], dict[int, int]]:
    """Associate a frame's regions with objects; a region without an owner starts a new object.

    If an object owns two regions of a frame, it keeps the one that is recognised by appearance, otherwise its
    current one; the other region starts a new object. So an arm that was taken for its gripper, while the
    gripper was not seen, loses that identity when the gripper is recognised.

    Returns:
        Object id -> its region, and the owners of all known regions, those of this frame last.
    """
    owners = dict(region_owners(mind))
    named = recognised_regions(observation)
    found: dict[int, Region] = {}

    def precedence(region: Region) -> tuple[bool, bool]:
        return region.id not in named, not _is_current_region(mind, owners, region)

    for region in sorted(observation.of("region"), key=precedence):
        object_id = owners.pop(region.id, None)
        if object_id is None or object_id in found:
            object_id = _free_id(region.id, mind.objects.keys() | found.keys())
        owners[region.id] = object_id
        found[object_id] = region
    return found, owners


def reassign_region(mind: Mind, region_id: int, object_id: int) -> Mind:
    """The same mind with a region owned by another object from now on."""
    changed = {**region_owners(mind), region_id: object_id}
    return mind.remember(OWNERS, MappingProxyType(changed))


def delete_objects(mind: Mind, ids: frozenset[int]) -> Mind:
    """The same mind without some objects; their regions lose their owner."""
    if not ids:
        return mind
    remaining = {i: b for i, b in mind.objects.items() if i not in ids}
    left = {r: o for r, o in region_owners(mind).items() if o not in ids}
    answers = {i: name for i, name in mind.answers.items() if i not in ids}
    mind = replace(mind, objects=MappingProxyType(remaining), answers=MappingProxyType(answers))
    return mind.remember(OWNERS, MappingProxyType(left))


def _is_current_region(mind: Mind, owners: Mapping[int, int], region: Region) -> bool:
    belief = mind.objects.get(owners.get(region.id, -1))
    return belief is not None and belief.region.id == region.id


def _free_id(wanted: int, taken: set[int]) -> int:
    while wanted in taken:
        wanted += 1000
    return wanted
