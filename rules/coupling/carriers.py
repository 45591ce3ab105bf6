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
from visup.rules.predicates.motion import CLEAR_MOTION_SIGMA, MOVING_SIGMAS
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
        least_carrier_share: Least path of the carrier in the same time, as a share of the way.
        most_carrier_share: Greatest path of the carrier, as a share of the way; a body that moves much
            farther only passes by.
    """

    rest_s: float = 0.4
    moving_s: float = 0.3
    path_share: float = 0.25
    speed: float = 0.0125
    rest_share: float = 0.5
    least_carrier_share: float = 0.3
    most_carrier_share: float = 3.0


MotionAtStart = tuple[float, tuple[float, float]]
"""The accumulated motion of a body: path length, and displacement (x, y); pixels."""


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """The memory of one body: when it rested and set out; seconds and pixels.

    Attributes:
        path: Length of its path since it was first seen.
        displacement: (x, y) displacement since it was first seen.
        rested_since: Time since when it is at rest; None while it moves.
        moving_since: Time when it set out; None while it rests, or moves without having rested for long
            enough.
        displacement_since: (x, y) displacement since it set out.
        touching: The bodies that have touched it ever since it set out: id -> their `path` and `displacement`
            at that time.
        carrier: Id of the body that carries it; None if unknown.
    """

    path: float = 0.0
    displacement: tuple[float, float] = (0.0, 0.0)
    rested_since: float | None = None
    moving_since: float | None = None
    displacement_since: tuple[float, float] = (0.0, 0.0)
    touching: Mapping[int, MotionAtStart] = field(default_factory=lambda: MappingProxyType({}))
    carrier: int | None = None


NO_MOTION = BodyMotion()


@dataclass(frozen=True, slots=True, eq=False)
class CarrierMemory:
    """The motions of all bodies.

    Attributes:
        time: Time of the last step, seconds; None before the first.
        motions: Object id -> its motion.
    """

    time: float | None = None
    motions: Mapping[int, BodyMotion] = field(default_factory=lambda: MappingProxyType({}))

    def carried_since(self) -> dict[tuple[int, int], float]:
        """(id, id), ascending, of a carrier and the body it carries -> time when that set out, seconds."""
        return {
            (min(number, body.carrier), max(number, body.carrier)): body.moving_since
            for number, body in self.motions.items()
            if body.carrier is not None and body.moving_since is not None
        }


CARRIERS: MemoryKey[CarrierMemory] = MemoryKey("rules.carriers", CarrierMemory())


def update_carriers(
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
    motions = {
        number: _with_carrier(body, number, moved, touching.get(number, ()), mind, settings)
        for number, body in moved.items()
    }
    return CarrierMemory(mind.time, MappingProxyType(motions))


def _moved_bodies(
    memory: CarrierMemory,
    touching: Mapping[int, Collection[int]],
    mind: Mind,
    settings: CarrierSettings,
) -> dict[int, BodyMotion]:
    """The motions of all bodies updated by one step; carriers are not determined yet."""
    now, dt = kinematics(mind), 0.0 if memory.time is None else mind.time - memory.time
    diagonal = image_diagonal(mind.frame_size)
    least, unclear = settings.speed * diagonal, CLEAR_MOTION_SIGMA * diagonal
    found: dict[int, BodyMotion] = {}
    rows = zip(now.ids, now.speed.tolist(), now.velocity_sigma.tolist(), now.velocity, strict=True)
    for number, speed, sigma, velocity in rows:
        body = memory.motions.get(number, NO_MOTION)
        if speed != speed or mind.objects[number].last_seen < mind.time:  # NaN is not itself
            found[number] = body
        elif speed <= settings.rest_share * least:
            since = mind.time if body.rested_since is None else body.rested_since
            found[number] = BodyMotion(body.path, body.displacement, since)
        else:
            step = float(velocity[0]) * dt, float(velocity[1]) * dt
            displacement = body.displacement[0] + step[0], body.displacement[1] + step[1]
            body = replace(body, path=body.path + speed * dt, displacement=displacement)
            if sigma <= unclear and speed > max(least, MOVING_SIGMAS * sigma):
                others = touching.get(number, ())
                body = _after_clear_motion(
                    body, step, _motions_at_start(others, memory), mind.time, settings
                )
            found[number] = body
    return found


def _motions_at_start(bodies: Iterable[int], memory: CarrierMemory) -> Mapping[int, MotionAtStart]:
    found = ((i, memory.motions.get(i, NO_MOTION)) for i in bodies)
    return MappingProxyType({i: (body.path, body.displacement) for i, body in found})


def _after_clear_motion(
    body: BodyMotion,
    step: tuple[float, float],
    touching: Mapping[int, MotionAtStart],
    now: float,
    settings: CarrierSettings,
) -> BodyMotion:
    """A body after a step of clear motion: its way goes on, or begins if it has rested for long enough."""
    if body.moving_since is not None:
        displacement_since = (
            body.displacement_since[0] + step[0],
            body.displacement_since[1] + step[1],
        )
        return replace(body, rested_since=None, displacement_since=displacement_since)
    if body.rested_since is None or now - body.rested_since < settings.rest_s:
        return replace(body, rested_since=None)
    return replace(
        body, rested_since=None, moving_since=now, displacement_since=step, touching=touching
    )


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
    moving_since = body.moving_since
    if moving_since is None:
        return body
    touching_all_along = {i: course for i, course in body.touching.items() if i in touching}
    if len(touching_all_along) < len(body.touching):
        body = replace(body, touching=MappingProxyType(touching_all_along))
    distance = hypot(*body.displacement_since)
    if not touching_all_along or not _has_come_far(moving_since, distance, number, mind, settings):
        return body
    movers = [
        i
        for i in touching
        if i in motions
        and _may_carry(motions[i], touching_all_along.get(i), body.displacement_since, settings)
    ]
    if len(movers) != 1 or movers[0] not in touching_all_along:
        return body
    carrier_path = motions[movers[0]].path - touching_all_along.pop(movers[0])[0]
    if carrier_path > settings.most_carrier_share * distance:
        return replace(body, touching=MappingProxyType(touching_all_along))
    return replace(body, carrier=movers[0])


def _has_come_far(
    moving_since: float, distance: float, number: int, mind: Mind, settings: CarrierSettings
) -> bool:
    """Whether the way of a body is long enough in time, in `distance` (pixels) and in mean speed."""
    duration, size = mind.time - moving_since, mind.objects[number].region.area ** 0.5
    least = settings.speed * image_diagonal(mind.frame_size) * duration
    return duration >= settings.moving_s - 1e-6 and distance >= max(
        settings.path_share * size, least
    )


def _may_carry(
    other: BodyMotion,
    course: MotionAtStart | None,
    displacement: tuple[float, float],
    settings: CarrierSettings,
) -> bool:
    """Whether a body may have carried another one along its way: it moves, far enough, and not oppositely.

    Directions need not agree: an arm that bends moves differently from its hand, but not oppositely.

    Args:
        other: The possible carrier.
        course: Its accumulated motion when the other body set out; None if it touched that only later.
        displacement: (x, y) way of the other body, pixels.
        settings: Settings.
    """
    if other.rested_since is not None or course is None:
        return other.rested_since is None
    path, (x, y) = course
    least = settings.least_carrier_share * hypot(*displacement)
    projection = (other.displacement[0] - x) * displacement[0] + (
        other.displacement[1] - y
    ) * displacement[1]
    return other.path - path >= least and projection > -least * hypot(*displacement)
