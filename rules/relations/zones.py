"""Zones: parts of the scene drawn by the user, and the objects inside them.

A zone is a polygon in the image, with or without a range of depth. There are three questions about each
object and zone: whether its centre is inside, whether any part of it is, and whether all of it is. For a zone
on the floor they concern where the object stands. The polygon has noise thresholds, hysteresis and a least
duration; with a range of depth, an object inside by the image but of unknown depth is not known to be inside,
while one outside by the image is outside whatever its depth.

How to query them:

- `inside(mind, object_id, zone_name) -> Truth`: the centre is inside;
- `reaching(mind, object_id, zone_name) -> Truth`: some part is;
- `wholly_inside(mind, object_id, zone_name) -> Truth`: all of it is;
- `distance_outside(mind, object_id, zone_name) -> float`: pixels from the centre to the edge of the
  polygon, negative inside it, NaN unknown.

The mind's relations hold the same as `inside NAME`, `reaching NAME` and `wholly_inside NAME`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief, Observation, Outcome, Region, Relation, Truth, Zone
from visup.agent.model.memory import MemoryKey
from visup.rules.geometry.ground import foot_points, standing_point
from visup.rules.geometry.regions import Floats, densified, image_diagonal, outline
from visup.rules.smoothing.ema import exponential_mean
from visup.rules.smoothing.hysteresis import (
    ABOVE,
    BELOW,
    UNKNOWN,
    Codes,
    HysteresisState,
    advance,
    unknown_states,
)

QUESTIONS = ("inside", "reaching", "wholly_inside")


@dataclass(frozen=True, slots=True)
class ZoneSettings:
    """Thresholds of zones.

    Attributes:
        enter: Half width of the hysteresis band about a zone's edge, image diagonals.
        depth_sigmas: The same for depth, in standard deviations of the object's depth.
        minimum_s: Least duration before a change is accepted.
        hold_s: Time for which the last sighting is held for a body that flickers out of view.
        points: Most points of an outline that are tested.
    """

    enter: float = 0.0025
    depth_sigmas: float = 2.0
    minimum_s: float = 0.2
    hold_s: float = 0.3
    points: int = 64


@dataclass(frozen=True, slots=True, eq=False)
class ZoneMemory:
    """The memory of zones.

    Attributes:
        ids: (M,) object ids.
        names: (Z,) zones.
        states: (4, Z * M) states, zone by zone: signs of how far the centre, the nearest and the farthest
            part are outside the polygon, and of how far the depth is outside its range.
        outside: (Z, M) distance of the centre, pixels, negative inside.
        smooth: (4, Z * M) smoothed distances outside, from which states are decided.
        time: Seconds of the last step.
    """

    ids: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    states: HysteresisState = field(default_factory=lambda: unknown_states((4, 0), 0.0))
    outside: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    smooth: Floats = field(default_factory=lambda: np.zeros((4, 0)))
    time: float = 0.0


ZONES = MemoryKey("rules.zones", ZoneMemory())


@dataclass(frozen=True, slots=True)
class ZoneReasoner:
    """Reasoner of the cogitate phase: which objects are inside which zones of the mind."""

    settings: ZoneSettings = field(default_factory=ZoneSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        if not mind.zones:
            return Outcome(mind)
        s, objects = self.settings, mind.present()
        old = mind.recall(ZONES)
        ids, names = tuple(b.id for b in objects), tuple(z.name for z in mind.zones)
        states, smooth = self._before(old, ids, names, mind.time)
        apart = np.array([[self._apart(z, b, mind) for b in objects] for z in mind.zones])
        apart = apart.reshape(len(names), len(ids), 4)
        smoothed = apart.reshape(-1, 4).T
        band = np.full(smoothed.shape, s.enter * image_diagonal(mind.frame_size))
        spread = [s.depth_sigmas * (b.depth_sigma or 0.0) for b in objects]
        band[3] = np.tile(spread, len(names))
        jump = 2.0 * s.enter * image_diagonal(mind.frame_size)
        # Depth is already smoothed, and -inf where a zone has no range.
        smoothed = np.append(
            exponential_mean(smooth[:3], smoothed[:3], mind.time - old.time, jump),
            smoothed[3:],
            axis=0,
        )
        candidates = edge_sign(smoothed, states.state, band)
        states = advance(states, candidates, mind.time, s.minimum_s)
        memory = ZoneMemory(ids, names, states, apart[:, :, 0], smoothed, mind.time)
        relations = tuple(
            _relation(memory, question, i, name)
            for name in names
            for i in ids
            for question in QUESTIONS
        )
        return Outcome(mind.remember(ZONES, memory, relations=mind.relations + relations))

    def _before(
        self, old: ZoneMemory, ids: tuple[int, ...], names: tuple[str, ...], now: float
    ) -> tuple[HysteresisState, Floats]:
        if old.ids == ids and old.names == names:
            return old.states, old.smooth
        known = ((z, i) for z in old.names for i in old.ids)
        place = {which: k for k, which in enumerate(known)}
        places = np.array([place.get((z, i), -1) for z in names for i in ids], dtype=np.intp)
        smooth = np.append(old.smooth, np.full((4, 1), np.nan), axis=1)[:, places]
        return old.states.select(places, now), smooth

    def _apart(self, zone: Zone, belief: ObjectBelief, mind: Mind) -> tuple[float, ...]:
        """Distances outside the zone: centre, nearest part, farthest part, depth; NaN unknown."""
        if mind.time - belief.last_seen > self.settings.hold_s:
            return (np.nan,) * 4
        region, polygon = belief.region, np.asarray(zone.polygon, dtype=float)
        if zone.on_floor:
            return *self._feet_apart(region, polygon, mind), _beyond(zone, belief)
        points = densified(outline(region), 8.0)
        points = points[:: -(-len(points) // self.settings.points)]
        distance = outside(np.vstack([[region.centroid], points]), polygon)
        least = float(distance[1:].min())
        if least > 0.0 and _covers(belief, polygon):
            least = -least
        return float(distance[0]), least, float(distance[1:].max()), _beyond(zone, belief)

    def _feet_apart(self, region: Region, polygon: Floats, mind: Mind) -> tuple[float, ...]:
        """Distances outside the zone: centre of a body's feet, nearest, farthest; NaN unknown."""
        feet = foot_points(region, mind.frame_size)
        if not len(feet):
            return (np.nan,) * 3
        feet = feet[:: -(-len(feet) // self.settings.points)]
        distance = outside(np.vstack([standing_point(feet), feet]), polygon)
        return float(distance[0]), float(distance[1:].min()), float(distance[1:].max())


def edge_sign(apart: Floats, before: Codes, band: Floats) -> Codes:
    """The side of an edge on which quantities are, with hysteresis about the edge.

    Args:
        apart: Any shape; how far outside; NaN unknown.
        before: Same shape, previous states: `BELOW` inside, `ABOVE` outside.
        band: Same shape; distance beyond which a change is detected.

    Returns:
        `BELOW`, `ABOVE` or `UNKNOWN`.
    """
    edge = np.where(before == BELOW, band, np.where(before == ABOVE, -band, 0.0))
    code = np.where(apart > edge, ABOVE, BELOW)
    return np.where(np.isnan(apart), UNKNOWN, code).astype(np.int8)


def outside(points: Floats, polygon: Floats) -> Floats:
    """Distance of points to the edge of a polygon, negative inside it (even-odd rule).

    Args:
        points: (N, 2) pixels.
        polygon: (K, 2) corners in order, pixels; it need not be convex.

    Returns:
        (N,) pixels.
    """
    start, side = polygon, np.roll(polygon, -1, axis=0) - polygon
    to = points[:, None] - start[None]
    along = (to * side).sum(axis=2) / np.maximum((side * side).sum(axis=1), 1e-12)
    foot = to - np.clip(along, 0.0, 1.0)[..., None] * side
    distance = np.sqrt((foot * foot).sum(axis=2)).min(axis=1)
    signed: Floats = np.where(contains(points, polygon), -distance, distance)
    return signed


def contains(points: Floats, polygon: Floats) -> NDArray[np.bool_]:
    """Whether points (N, 2) are inside a polygon (K, 2), by the even-odd rule."""
    x, y = points[:, 0, None], points[:, 1, None]
    (x0, y0), (x1, y1) = polygon.T, np.roll(polygon, -1, axis=0).T
    crosses = (y0 > y) != (y1 > y)
    rise = np.where(y1 == y0, 1.0, y1 - y0)
    left: NDArray[np.bool_] = crosses & (x < x0 + (y - y0) * (x1 - x0) / rise)
    return np.asarray(left.sum(axis=1) % 2 == 1)


def inside(mind: Mind, object_id: int, zone: str) -> Truth:
    """Whether an object's centre is inside a zone; unknown if not decided."""
    return zone_truth(mind, "inside", object_id, zone)


def reaching(mind: Mind, object_id: int, zone: str) -> Truth:
    """Whether some part of an object is inside a zone."""
    return zone_truth(mind, "reaching", object_id, zone)


def wholly_inside(mind: Mind, object_id: int, zone: str) -> Truth:
    """Whether all of an object is inside a zone."""
    return zone_truth(mind, "wholly_inside", object_id, zone)


def distance_outside(mind: Mind, object_id: int, zone: str) -> float:
    """Pixels from an object's centre to the edge of a zone's polygon, negative inside; NaN unknown."""
    kept = mind.recall(ZONES)
    if zone not in kept.names or object_id not in kept.ids:
        return float("nan")
    return float(kept.outside[kept.names.index(zone), kept.ids.index(object_id)])


def zone_truth(mind: Mind, question: str, object_id: int, zone: str) -> Truth:
    """One of `QUESTIONS` about an object and a zone; unknown if not decided."""
    kept = mind.recall(ZONES)
    if zone not in kept.names or object_id not in kept.ids:
        return Truth.UNKNOWN
    return _relation(kept, question, object_id, zone).truth


def _relation(memory: ZoneMemory, question: str, object_id: int, zone: str) -> Relation:
    """Combine image and depth: outside in either is outside, even if the other is unknown."""
    k = memory.names.index(zone) * len(memory.ids) + memory.ids.index(object_id)
    rows = [QUESTIONS.index(question), 3]
    codes = [int(c) for c in memory.states.state[rows, k]]
    since = float(memory.states.since[rows, k].max())
    if ABOVE in codes:
        # Outside since the earlier of the two.
        outside_since = [
            t for c, t in zip(codes, memory.states.since[rows, k], strict=True) if c == ABOVE
        ]
        return Relation(f"{question} {zone}", (object_id,), Truth.FALSE, float(min(outside_since)))
    if UNKNOWN in codes:
        return Relation(f"{question} {zone}", (object_id,), Truth.UNKNOWN, since, 0.0)
    return Relation(f"{question} {zone}", (object_id,), Truth.TRUE, since)


def _beyond(zone: Zone, belief: ObjectBelief) -> float:
    """Distance of the depth outside the zone's range; -inf if the zone has none."""
    if zone.depth is None:
        return -np.inf
    if belief.depth is None:
        return np.nan
    return max(zone.depth[0] - belief.depth, belief.depth - zone.depth[1])


def _covers(belief: ObjectBelief, polygon: Floats) -> bool:
    """Whether a corner of the polygon is inside the object, which then surrounds it."""
    x, y, w, h = belief.region.bbox
    at = np.rint(polygon).astype(int) - (x, y)
    at = at[(at >= 0).all(axis=1) & (at[:, 0] < w) & (at[:, 1] < h)]
    return bool(belief.region.mask[at[:, 1], at[:, 0]].any())
