"""Carriers: a body at rest that starts to move is carried by the only moving body that touches it.

An inert body does not start to move by itself. Its first clear motion therefore reveals what holds it, even
where relative rest cannot be measured: the outline of an arm that bends, slides along itself or leaves the
image says little about how its hand moves relative to the part. A body that touches it but rests (a table, a
tray) does not move it; if two moving bodies touch it, neither is believed to be the carrier. A body that was
merely knocked comes to rest, or loses touch, before it has moved far enough.

In this module, to *set out* is to start to move after a rest, and the *way* of a body is its displacement
since it set out.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from math import hypot
from types import MappingProxyType

from visup.agent import Mind
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.motion import CLEAR, MOVING_SIGMAS
from visup.rules.relations.reasoner import kinematics


@dataclass(frozen=True, slots=True)
class CarrierSettings:
    """When a body that sets out counts as carried.

    Attributes:
        rest_s: How long it must have rested before, seconds.
        moving_s: How long it must have moved since, seconds.
        path_share: Least length of its way, as a share of its size (square root of the area).
        speed: Least speed of a body that sets out, and least mean speed on its way, image diagonals per
            second; outlines next to a hand, or in front of a swaying camera, drift more slowly.
        rest_share: Greatest speed of a body at rest, as a share of `speed`.
        along_share: Least path of the carrier in the same time, as a share of the way.
        past_share: Greatest path of the carrier, as a share of the way; a body that moves much farther only
            passes by.
    """

    rest_s: float = 0.4
    moving_s: float = 0.3
    path_share: float = 0.25
    speed: float = 0.0125
    rest_share: float = 0.5
    along_share: float = 0.3
    past_share: float = 3.0


Course = tuple[float, tuple[float, float]]
"""The accumulated motion of a body: path length, and displacement (x, y); pixels."""


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """The memory of one body: when it rested and set out; seconds and pixels.

    Attributes:
        path: Length of its path since it was first seen.
        place: (x, y) displacement since it was first seen.
        rested_since: Time since when it is at rest; None while it moves.
        set_out: Time when it set out; None while it rests, or moves without having rested for long enough.
        way: (x, y) displacement since it set out.
        touching: The bodies that have touched it ever since it set out: id -> their `path` and `place` at
            that time.
        carrier: Id of the body that carries it; None if unknown.
    """

    path: float = 0.0
    place: tuple[float, float] = (0.0, 0.0)
    rested_since: float | None = None
    set_out: float | None = None
    way: tuple[float, float] = (0.0, 0.0)
    touching: Mapping[int, Course] = field(default_factory=lambda: MappingProxyType({}))
    carrier: int | None = None


AT_START = BodyMotion()


@dataclass(frozen=True, slots=True, eq=False)
class CarrierMemory:
    """The motions of all bodies.

    Attributes:
        time: Time of the last step, seconds; None before the first.
        of: Object id -> its motion.
    """

    time: float | None = None
    of: Mapping[int, BodyMotion] = field(default_factory=lambda: MappingProxyType({}))

    def carried(self) -> dict[tuple[int, int], float]:
        """(id, id), ascending, of a carrier and the body it carries -> time when that set out, seconds."""
        return {
            (min(number, body.carrier), max(number, body.carrier)): body.set_out
            for number, body in self.of.items()
            if body.carrier is not None and body.set_out is not None
        }


CARRIERS: MemoryKey[CarrierMemory] = MemoryKey("rules.carriers", CarrierMemory())


def updated_carriers(
    memory: CarrierMemory,
    touching: Mapping[int, Collection[int]],
    mind: Mind,
    settings: CarrierSettings,
) -> CarrierMemory:
    """The motions of all bodies, with their carriers, updated by one step.

    Args:
        memory: The motions of the last step.
        touching: Id of an object -> ids of the objects that touch it.
        mind: The mind, with the kinematics of this step.
        settings: Settings.
    """
    moved = _moved_bodies(memory, touching, mind, settings)
    of = {
        number: _with_carrier(body, number, moved, touching.get(number, ()), mind, settings)
        for number, body in moved.items()
    }
    return CarrierMemory(mind.time, MappingProxyType(of))


def _moved_bodies(
    memory: CarrierMemory,
    touching: Mapping[int, Collection[int]],
    mind: Mind,
    settings: CarrierSettings,
) -> dict[int, BodyMotion]:
    """The motions of all bodies updated by one step; carriers are not determined yet."""
    now, dt = kinematics(mind), 0.0 if memory.time is None else mind.time - memory.time
    diagonal = image_diagonal(mind.frame_size)
    least, unclear = settings.speed * diagonal, CLEAR * diagonal
    found: dict[int, BodyMotion] = {}
    rows = zip(now.ids, now.speed.tolist(), now.velocity_sigma.tolist(), now.velocity, strict=True)
    for number, speed, sigma, velocity in rows:
        body = memory.of.get(number, AT_START)
        if speed != speed or mind.objects[number].last_seen < mind.time:  # NaN is not itself
            found[number] = body
        elif speed <= settings.rest_share * least:
            since = mind.time if body.rested_since is None else body.rested_since
            found[number] = BodyMotion(body.path, body.place, since)
        else:
            step = float(velocity[0]) * dt, float(velocity[1]) * dt
            place = body.place[0] + step[0], body.place[1] + step[1]
            body = replace(body, path=body.path + speed * dt, place=place)
            if sigma <= unclear and speed > max(least, MOVING_SIGMAS * sigma):
                others = touching.get(number, ())
                body = _moved(body, step, _courses(others, memory), mind.time, settings)
            found[number] = body
    return found


def _courses(bodies: Iterable[int], memory: CarrierMemory) -> Mapping[int, Course]:
    found = ((i, memory.of.get(i, AT_START)) for i in bodies)
    return MappingProxyType({i: (body.path, body.place) for i, body in found})


def _moved(
    body: BodyMotion,
    step: tuple[float, float],
    touching: Mapping[int, Course],
    now: float,
    settings: CarrierSettings,
) -> BodyMotion:
    """A body after a step of clear motion: its way goes on, or begins if it has rested for long enough."""
    if body.set_out is not None:
        way = body.way[0] + step[0], body.way[1] + step[1]
        return replace(body, rested_since=None, way=way)
    if body.rested_since is None or now - body.rested_since < settings.rest_s:
        return replace(body, rested_since=None)
    return replace(body, rested_since=None, set_out=now, way=step, touching=touching)


def _with_carrier(
    body: BodyMotion,
    number: int,
    motions: Mapping[int, BodyMotion],
    touching: Collection[int],
    mind: Mind,
    settings: CarrierSettings,
) -> BodyMotion:
    """A body with its carrier: found once its way is long enough, dropped once they no longer touch."""
    if body.carrier is not None:
        return body if body.carrier in touching else replace(body, carrier=None)
    set_out = body.set_out
    if set_out is None:
        return body
    ever = {i: course for i, course in body.touching.items() if i in touching}
    if len(ever) < len(body.touching):
        body = replace(body, touching=MappingProxyType(ever))
    far = hypot(*body.way)
    if not ever or not _has_come_far(set_out, far, number, mind, settings):
        return body
    movers = [
        i
        for i in touching
        if i in motions and _goes_along(motions[i], ever.get(i), body.way, settings)
    ]
    if len(movers) != 1 or movers[0] not in ever:
        return body
    gone = motions[movers[0]].path - ever.pop(movers[0])[0]
    if gone > settings.past_share * far:
        return replace(body, touching=MappingProxyType(ever))
    return replace(body, carrier=movers[0])


def _has_come_far(
    set_out: float, far: float, number: int, mind: Mind, settings: CarrierSettings
) -> bool:
    """Whether the way of a body is long enough in time, in distance (`far`, pixels) and in mean speed."""
    lasted, size = mind.time - set_out, mind.objects[number].region.area ** 0.5
    least = settings.speed * image_diagonal(mind.frame_size) * lasted
    return lasted >= settings.moving_s - 1e-6 and far >= max(settings.path_share * size, least)


def _goes_along(
    other: BodyMotion, course: Course | None, way: tuple[float, float], settings: CarrierSettings
) -> bool:
    """Whether a body may have carried another one along its way: it moves, far enough, and not oppositely.

    Directions need not agree: an arm that bends moves differently from its hand, but not oppositely.

    Args:
        other: The possible carrier.
        course: Its accumulated motion when the other body set out; None if it touched that only later.
        way: (x, y) way of the other body, pixels.
        settings: Settings.
    """
    if other.rested_since is not None or course is None:
        return other.rested_since is None
    path, (x, y) = course
    least = settings.along_share * hypot(*way)
    along = (other.place[0] - x) * way[0] + (other.place[1] - y) * way[1]
    return other.path - path >= least and along > -least * hypot(*way)
