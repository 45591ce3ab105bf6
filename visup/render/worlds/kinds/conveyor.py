"""`conveyor`: a parcel rides on a belt and falls into a bin at its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.worlds.kinds.kind import (
    Script,
    cut_short,
    finished,
    frames_until,
    from_around,
    random_view,
    spans,
)
from visup.render.worlds.motion import clock, cruised, dropped, frame_at, posed, still
from visup.render.worlds.things import clutter
from visup.render.worlds.things.machines import BLACK, STEEL
from visup.render.worlds.things.scenery import floor, pick_colour, seed_of, unlike, wall
from visup.render.worlds.world import Contact, Course, Motion, Poses, Surface, Thing, World

OUTCOMES = ("ok", "falls_off", "jams", "in_progress")
PARCEL, BIN, OTHER, BYSTANDER = 2, 3, 6, 7
HIGH, HALF_WIDE, RIDE = 0.75, 0.3, 1.25
"""Height of the belt, half its width, and half its length, metres."""

Doubles = NDArray[np.float64]

TASK = """\
# sort.task: the parcel rides to the bin, falls in and stays there.
<sort> ::= <ride> <binned>

<ride>   ::= converging(parcel, bin)
<binned> ::= touching(parcel, bin) for 1 s
"""


@dataclass(frozen=True, slots=True, eq=False)
class Ride:
    """The parcel's poses (F, 4, 4), and when it goes over the edge and lands, seconds."""

    poses: Poses
    over: float
    down: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world with a parcel on a belt; `outcome` is one of `OUTCOMES`."""
    way = float(rng.choice([-1, 1]))
    size = rng.uniform([0.2, 0.18, 0.12], [0.32, 0.28, 0.24])
    colour = pick_colour(rng, bool(rng.random() < 0.7))
    begin, duration = float(rng.uniform(0.3, 1.2)), float(rng.uniform(9.5, 12.0))
    frames = frames_until(duration)
    ride = _ride(rng, way, outcome, begin, frames)
    pattern = str(rng.choice(["grain", "stripes", "checker"]))
    surface = Surface(pattern, 0.12, float(rng.uniform(0.05, 0.3)), seed_of(rng))
    parcel = box(size, (0, 0, size[2] / 2), colour)
    plain = Surface("grain", 0.3, 0.12, seed_of(rng))
    tub = unlike(rng, [colour])
    aim = np.array([0.25 * way, 0.0, 0.55])
    place = from_around(rng, aim, float(rng.uniform(3.2, 4.0)), (18, 50))
    view = random_view(rng, place, aim, frames)
    things = [
        Thing("parcel", parcel, ride.poses, PARCEL, surface),
        Thing("bin", _tub(tub), still(way * (RIDE + 0.42), 0), BIN, plain),
        Thing("belt", _belt(rng), still(0, 0), 0, plain),
        *_surroundings(rng, frames),
    ]
    if rng.random() < 0.4:
        things.append(_follower(rng, parcel, ride, way, surface))
    truth = _course(outcome, ride, begin, duration)
    if outcome == "in_progress":
        end = float(rng.uniform(begin + 2.0, ride.over - 0.3))
        truth, frames = cut_short(truth, end), frames_until(end)
    return finished(
        rng, "conveyor", Script(things, view, ("sort", TASK), ("parcel", "bin"), truth, frames)
    )


def _ride(rng: np.random.Generator, way: float, outcome: str, begin: float, frames: int) -> Ride:
    """Along the belt and over its end, off its side, or to a stop halfway."""
    t = clock(frames)
    over = begin + float(rng.uniform(4.5, 6.0))
    start = -RIDE + rng.uniform(0.15, 0.5)
    x = start + (RIDE + 0.1 - start) * cruised(t, begin, over, 0.05)
    speed = (RIDE + 0.1 - start) / (over - begin) / 0.95
    x = np.where(t > over - 0.3, np.interp(over - 0.3, t, x) + speed * (t - over + 0.3), x)
    y = np.full(frames, rng.uniform(-0.08, 0.08))
    yaw = float(rng.uniform(-0.3, 0.3))
    if outcome == "jams":
        stop = begin + float(rng.uniform(0.4, 0.65)) * (over - begin)
        x = np.where(t < stop, x, np.interp(stop, t, x))
        poses = posed(np.column_stack([way * x, y, np.full(frames, HIGH)]), yaw)
        return Ride(poses, stop, stop)
    if outcome == "falls_off":
        leave = begin + float(rng.uniform(0.35, 0.6)) * (over - begin)
        y = y - np.clip(t - leave + 0.9, 0, 2.0) * 0.42
        since = int(np.argmax(y < -HALF_WIDE - 0.02))
        poses = posed(np.column_stack([way * x, y, np.full(frames, HIGH)]), yaw)
        poses, down = dropped(poses, since, 0.0, (0.3, 0.1, rng.uniform(-0.5, 0.5)))
        return Ride(poses, float(t[since]), down / 15)
    poses = posed(np.column_stack([way * x, y, np.full(frames, HIGH)]), yaw)
    since = frame_at(over)
    poses, down = dropped(poses, since, 0.06, (0.0, 0.25 * way, rng.uniform(-0.3, 0.3)))
    poses[down:] = poses[down]
    return Ride(poses, over, down / 15)


def _follower(
    rng: np.random.Generator, parcel: Solid, ride: Ride, way: float, surface: Surface
) -> Thing:
    """An identical parcel behind the first; the belt stops when the first has arrived."""
    frames = len(ride.poses)
    first = way * ride.poses[:, 0, 3]
    last = min(frame_at(ride.over) - 1, frames - 1)
    x = np.where(np.arange(frames) <= last, first, first[last]) - rng.uniform(0.7, 0.95)
    x = np.clip(x, -RIDE + 0.1, None)
    at = np.column_stack([way * x, np.full(frames, 0.02), np.full(frames, HIGH)])
    return Thing("other", parcel, posed(at, float(rng.uniform(-0.3, 0.3))), OTHER, surface)


def _belt(rng: np.random.Generator) -> Solid:
    rim = pick_colour(rng, vivid=False)
    top = box((2 * RIDE, 2 * HALF_WIDE, 0.06), (0, 0, HIGH - 0.03), BLACK)
    rails = [
        box((2 * RIDE, 0.04, 0.1), (0, y * (HALF_WIDE + 0.02), HIGH - 0.06), rim) for y in (-1, 1)
    ]
    feet = [
        cone((x, y, 0), (x, y, HIGH - 0.06), 0.03, None, STEEL)
        for x in (-0.85 * RIDE, 0.85 * RIDE)
        for y in (-HALF_WIDE, HALF_WIDE)
    ]
    return join(top, *rails, *feet)


def _tub(colour: Colour) -> Solid:
    """An open bin."""
    wide, high, t = 0.7, 0.42, 0.03
    return join(
        box((wide, wide, t), (0, 0, t / 2), colour),
        box((t, wide, high), (wide / 2, 0, high / 2), colour),
        box((t, wide, high), (-wide / 2, 0, high / 2), colour),
        box((wide, t, high), (0, wide / 2, high / 2), colour),
        box((wide, t, high), (0, -wide / 2, high / 2), colour),
    )


def _surroundings(rng: np.random.Generator, frames: int) -> list[Thing]:
    found = [
        floor(rng, 0.0, 30.0, ("speckles", "tiles", "grain")),
        wall(rng, 0.0, float(rng.uniform(1.6, 4.0)), 20.0),
    ]
    free = [
        *clutter.corridor((-2.2, 0), (2.4, 0), 1.2),
        *clutter.corridor((-2, -0.9), (2, -0.9), 0.8),
    ]
    found += clutter.scattered(rng, int(rng.integers(0, 5)), 0.14, (-2.2, 2.2, -1.2, 1.4), free)
    if rng.random() < 0.2:
        found += clutter.passer_by(rng, frames, (-3.5, 1.2), (3.5, 1.2), BYSTANDER)
    return found


def _course(outcome: str, ride: Ride, begin: float, end: float) -> Course:
    """Ground truth."""
    moves = (Motion("parcel", begin, ride.down),)
    if outcome == "jams":
        stages = spans(("ride", begin, end, "failing"))
        return Course(outcome, "failed", stages, ("failed", "in_progress"), (), moves)
    if outcome == "falls_off":
        stages = spans(("ride", begin, ride.over, "failing"))
        return Course(outcome, "failed", stages, ("failed", "in_progress"), (), moves)
    stages = spans(("ride", begin, ride.down), ("binned", ride.down, end))
    touch = (Contact("parcel", "bin", ride.down, end),)
    return Course(outcome, "succeeded", stages, (), touch, moves)
