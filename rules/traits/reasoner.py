"""Memory of the traits of each object: colours, size, first position, first motion.

The reasoner is only present if some task describes an actor by traits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp
from types import MappingProxyType

from visup.agent import Mind, ObjectBelief, Observation, Outcome, Presence, Region
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.rules.geometry.regions import Box, image_diagonal
from visup.rules.relations.kinematics import RelationSettings
from visup.rules.relations.reasoner import kinematics

Palette = tuple[tuple[float, float, float, float], ...]
"""(L*, a*, b*, share) of each colour, the greatest share first."""

SIDES = ("left", "top", "right", "bottom")


@dataclass(frozen=True, slots=True)
class TraitSettings:
    """Settings of traits.

    Attributes:
        tau_s: Time constant over which colours and sizes are averaged.
        border: An outline first seen within this share of the image's side may have come over it.
        inwards: Distance it must have moved inwards to have entered over that side, image diagonals.
        start_s: An object first seen this early did not enter.
        in_view_s: An object in view for this long before it moved did not enter either.
        moving_s: How long it must move to have moved.
        entries: Most colours stored per object.
        relations: Settings of the relations, which say how slow an object at rest is.
    """

    tau_s: float = 2.0
    border: float = 0.1
    inwards: float = 0.02
    start_s: float = 1.0
    in_view_s: float = 1.0
    moving_s: float = 0.3
    entries: int = 24
    relations: RelationSettings = field(default_factory=RelationSettings)


@dataclass(frozen=True, slots=True)
class Traits:
    """The traits of one object.

    Attributes:
        palette: Its colours; empty until observed.
        extent: Its largest extent, pixels; NaN until seen whole.
        first_box: Its box when first seen, pixels.
        first_centroid: (x, y) of its centroid then, pixels.
        may_have_entered: Whether it may have entered; an object present before did not.
        side: The side of the image over which it entered, or empty.
        moving_since: Since when it has been moving, seconds; None while it is not.
        first_moved: When it first moved, seconds; None until then.
        resting_since: Since when it has been at rest, seconds; None while it moves.
    """

    palette: Palette = ()
    extent: float = math.nan
    first_box: Box = (0, 0, 0, 0)
    first_centroid: tuple[float, float] = (0.0, 0.0)
    may_have_entered: bool = False
    side: str = ""
    moving_since: float | None = None
    first_moved: float | None = None
    resting_since: float | None = None


@dataclass(frozen=True, slots=True)
class TraitMemory:
    """The traits of all objects.

    Attributes:
        start: Seconds of the first step.
        time: Seconds of the last step.
        traits: Object id -> its traits.
        colours_at: Seconds of the newest colours used.
    """

    start: float = 0.0
    time: float = 0.0
    traits: Mapping[int, Traits] = field(default_factory=lambda: MappingProxyType({}))
    colours_at: float = -math.inf


TRAITS: MemoryKey[TraitMemory | None] = MemoryKey("rules.traits", None)
NO_TRAITS = Traits()


def traits_of(mind: Mind, object_id: int) -> Traits | None:
    """The traits of an object, or None."""
    memory = mind.recall(TRAITS)
    return memory.traits.get(object_id) if memory is not None else None


@dataclass(frozen=True, slots=True)
class TraitReasoner:
    """Reasoner of the cogitate phase, after the relations: maintains the traits of all objects."""

    settings: TraitSettings = field(default_factory=TraitSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Update from one step; see `Reasoner`."""
        old = mind.recall(TRAITS) or TraitMemory(mind.time, mind.time)
        keep = exp(-max(0.0, mind.time - old.time) / self.settings.tau_s)
        palettes = _palettes(mind, observation)
        moving = _moving(mind, self.settings.relations)
        of = {}
        for object_id, belief in sorted(mind.objects.items()):
            known = old.traits.get(object_id) or self._initial_traits(belief, old.start)
            if belief.presence is Presence.SEEN and belief.last_seen == mind.time:
                known = self._with_observation(known, belief, mind, keep)
                known = self._with_motion(known, moving.get(object_id), mind.time)
            if object_id in palettes:
                merged = blend_palettes(
                    known.palette, palettes[object_id], self._colour_weight(old, mind)
                )
                known = replace(known, palette=merged[: self.settings.entries])
            of[object_id] = known
        seen_at = mind.time if palettes else old.colours_at
        memory = TraitMemory(old.start, mind.time, MappingProxyType(of), seen_at)
        return Outcome(mind.remember(TRAITS, memory))

    def _colour_weight(self, old: TraitMemory, mind: Mind) -> float:
        """Weight of new colours relative to the stored ones."""
        return 1.0 - exp(-min(1e3, mind.time - old.colours_at) / self.settings.tau_s)

    def _initial_traits(self, belief: ObjectBelief, start: float) -> Traits:
        region, s = belief.region, self.settings
        since = region.visible_since
        in_view_before = since is not None and belief.first_seen - since >= s.in_view_s
        came = belief.first_seen - start > s.start_s and not in_view_before
        return Traits(first_box=region.bbox, first_centroid=region.centroid, may_have_entered=came)

    def _with_observation(
        self, known: Traits, belief: ObjectBelief, mind: Mind, keep: float
    ) -> Traits:
        region = belief.region
        extent = known.extent
        if not region.cut:
            now = largest_extent(region)
            extent = now if extent != extent else keep * extent + (1.0 - keep) * now
        side = known.side
        if not side and known.may_have_entered:
            side = self._entry_side(known, region, mind.frame_size)
        return replace(known, extent=extent, side=side)

    def _entry_side(self, known: Traits, region: Region, size: tuple[int, int]) -> str:
        """The side over which an object entered, once it has moved inwards."""
        (width, height), (x, y, w, h) = size, known.first_box
        dx, dy = (region.centroid[k] - known.first_centroid[k] for k in (0, 1))
        least = self.settings.inwards * image_diagonal(size)
        margins = (x / width, y / height, 1 - (x + w) / width, 1 - (y + h) / height)
        advance = (dx, dy, -dx, -dy)
        candidates = (
            k for k in range(4) if margins[k] <= self.settings.border and advance[k] >= least
        )
        best = min(candidates, key=lambda k: (margins[k], -advance[k]), default=None)
        return "" if best is None else SIDES[best]

    def _with_motion(self, known: Traits, moving: bool | None, now: float) -> Traits:
        if moving is None:
            return known
        if not moving:
            stopped = now if known.resting_since is None else known.resting_since
            return replace(known, moving_since=None, resting_since=stopped)
        since = now if known.moving_since is None else known.moving_since
        lasting = now - since >= self.settings.moving_s
        moved = since if known.first_moved is None and lasting else known.first_moved
        rests = None if lasting else known.resting_since
        return replace(known, moving_since=since, first_moved=moved, resting_since=rests)


def blend_palettes(before: Palette, new: Palette, weight: float) -> Palette:
    """Blend two palettes of the same bins with a weight for the new one; an empty one is ignored.

    Example:
        >>> blend_palettes(((50.0, 0.0, 0.0, 1.0),), ((50.0, 0.0, 0.0, 0.5), (20.0, 0.0, 0.0, 0.5)), 0.5)
        ((50.0, 0.0, 0.0, 0.75), (20.0, 0.0, 0.0, 0.25))
    """
    if not before:
        return new
    shares = {entry[:3]: (1.0 - weight) * entry[3] for entry in before}
    for entry in new:
        shares[entry[:3]] = shares.get(entry[:3], 0.0) + weight * entry[3]
    ranked = sorted(shares.items(), key=lambda item: (-item[1], item[0]))
    return tuple((*colour, round(share, 9)) for colour, share in ranked)


def largest_extent(region: Region) -> float:
    """Largest extent of a region, pixels: over its outline, in steps of 15 degrees."""
    points = region.contour
    if len(points) < 2:
        return math.hypot(region.bbox[2], region.bbox[3])
    most = 0.0
    for degrees in range(0, 180, 15):
        along = points @ (math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))
        most = max(most, float(along.max() - along.min()))
    return most + 1.0  # outlines go through the centres of pixels


def _palettes(mind: Mind, observation: Observation) -> dict[int, Palette]:
    """The colours perceived in this step, by object."""
    regions = {b.region.id: i for i, b in mind.objects.items() if b.last_seen == mind.time}
    found = {}
    for value in observation.of("colour"):
        object_id = regions.get(int(value["region_id"]))
        if object_id is not None:
            found[object_id] = tuple(
                (float(x), float(a), float(b), float(share)) for x, a, b, share in value["palette"]
            )
    return found


def _moving(mind: Mind, relations: RelationSettings) -> dict[int, bool]:
    """Object -> whether it moves in the image, where known."""
    still = relations.still_speed * image_diagonal(mind.frame_size)
    measured = kinematics(mind)
    speeds = zip(measured.ids, measured.speed.tolist(), strict=True)
    return {i: v > still for i, v in speeds if v == v}  # NaN is not equal to itself
