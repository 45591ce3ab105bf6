"""Carriers: what rested and sets out while one moving body alone touches it is carried by that body.

A body at rest does not set out by itself. So its first clear motion tells who holds it, where relative rest
does not: the outline of an arm that bends, slides along itself or leaves the image says little about how its
hand moves relative to the part. Who touches it but rests (a table, a tray) does not move it; where two
movers touch it, nothing is believed. Who is knocked is not carried: it comes to rest, or is thrown off,
before it has gone far.
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
        rest_s: How long it must have rested before.
        moving_s: How long it must have moved.
        path_share: How far it must have come, in its own sizes (root of the area).
        speed: Least speed of a body that sets out, and least mean speed on its way, image diagonals per
            second: outlines next to a hand, or before a camera that sways, drift more slowly.
        rest_share: Greatest speed of rest, as a share of that.
        along_share: Least path of the carrier in the same time, as a share of that way; and
        past_share: the greatest: who goes much farther passes by.
    """

    rest_s: float = 0.4
    moving_s: float = 0.3
    path_share: float = 0.25
    speed: float = 0.0125
    rest_share: float = 0.5
    along_share: float = 0.3
    past_share: float = 3.0


Course = tuple[float, tuple[float, float]]
"""How far a body has moved, as the length of its path and as a vector, pixels."""


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """The memory of one body: when it rested and set out; seconds and pixels.

    Attributes:
        path: How far it has moved in all.
        place: (x, y) of that as a vector.
        rested_since: Since when it rests; None while it moves.
        set_out: When it set out after a rest; None while it rests, or moves without having rested.
        way: (x, y) from where it set out.
        touching: Who has touched it ever since, with their `path` and `place` at that time.
        carrier: Who carries it, as far as is known.
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
        time: Of the last step, seconds.
        of: By id.
    """

    time: float | None = None
    of: Mapping[int, BodyMotion] = field(default_factory=lambda: MappingProxyType({}))

    def carried(self) -> dict[tuple[int, int], float]:
        """The pairs of which one carries the other: when that one set out, seconds."""
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
    """The motions of all bodies after another step.

    Args:
        memory: Those of the last step.
        touching: Who touches whom, by id.
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
    """Who rests, who moves and who sets out, without new carriers."""
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
    """A body after a step of clear motion: on its way, or setting out if it has rested for long enough."""
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
    """A body with its carrier, once it has come far enough, as long as that touches it."""
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
    """Whether a body that set out has moved for long enough, far enough and fast enough."""
    lasted, size = mind.time - set_out, mind.objects[number].region.area ** 0.5
    least = settings.speed * image_diagonal(mind.frame_size) * lasted
    return lasted >= settings.moving_s - 1e-6 and far >= max(settings.path_share * size, least)


def _goes_along(
    other: BodyMotion, course: Course | None, way: tuple[float, float], settings: CarrierSettings
) -> bool:
    """Whether a body moves, and since that course far enough for the way of another, and not against it.

    The course is None if it came later. An arm that bends goes elsewhere than its hand, but not the other
    way.
    """
    if other.rested_since is not None or course is None:
        return other.rested_since is None
    path, (x, y) = course
    least = settings.along_share * hypot(*way)
    along = (other.place[0] - x) * way[0] + (other.place[1] - y) * way[1]
    return other.path - path >= least and along > -least * hypot(*way)
