"""`conveyor`: a parcel rides on a belt and falls into a bin at its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.worlds.assets import clutter
from visup.render.worlds.assets.machines import BLACK, STEEL
from visup.render.worlds.assets.scenery import (
    distinct_colour,
    floor,
    pick_colour,
    random_seed,
    wall,
)
from visup.render.worlds.kinds.kind import (
    Script,
    complete_world,
    frames_until,
    random_camera_position,
    random_view,
    stage_spans,
    truncated,
)
from visup.render.worlds.motion import (
    dropped,
    frame_at,
    frame_times,
    make_poses,
    static_pose,
    trapezoidal_profile,
)
from visup.render.worlds.world import Contact, Motion, Poses, RigidBody, Surface, TaskTruth, World

OUTCOMES = ("ok", "falls_off", "jams", "in_progress")
PARCEL, BIN, OTHER, BYSTANDER = 2, 3, 6, 7
BELT_HEIGHT, BELT_HALF_WIDTH, BELT_HALF_LENGTH = 0.75, 0.3, 1.25
"""Height of the belt, half its width, and half its length, metres."""

Doubles = NDArray[np.float64]

TASK = """\
# sort.task: the parcel rides to the bin, falls in and stays there.
<sort> ::= <ride> <binned>

<ride>   ::= converging(parcel, bin)
<binned> ::= touching(parcel, bin) for 1 s
"""


@dataclass(frozen=True, slots=True, eq=False)
class ParcelPath:
    """The parcel's poses (F, 4, 4), and when it goes over the edge and lands, seconds."""

    poses: Poses
    over: float
    down: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world with a parcel on a belt; `outcome` is one of `OUTCOMES`."""
    direction = float(rng.choice([-1, 1]))
    size = rng.uniform([0.2, 0.18, 0.12], [0.32, 0.28, 0.24])
    colour = pick_colour(rng, bool(rng.random() < 0.7))
    begin, duration = float(rng.uniform(0.3, 1.2)), float(rng.uniform(9.5, 12.0))
    frames = frames_until(duration)
    ride = _ride(rng, direction, outcome, begin, frames)
    pattern = str(rng.choice(["grain", "stripes", "checker"]))
    surface = Surface(pattern, 0.12, float(rng.uniform(0.05, 0.3)), random_seed(rng))
    parcel = box(size, (0, 0, size[2] / 2), colour)
    plain = Surface("grain", 0.3, 0.12, random_seed(rng))
    bin_colour = distinct_colour(rng, [colour])
    aim = np.array([0.25 * direction, 0.0, 0.55])
    place = random_camera_position(rng, aim, float(rng.uniform(3.2, 4.0)), (18, 50))
    view = random_view(rng, place, aim, frames)
    bodies = [
        RigidBody("parcel", parcel, ride.poses, PARCEL, surface),
        RigidBody(
            "bin",
            _tub(bin_colour),
            static_pose(direction * (BELT_HALF_LENGTH + 0.42), 0),
            BIN,
            plain,
        ),
        RigidBody("belt", _belt(rng), static_pose(0, 0), 0, plain),
        *_surroundings(rng, frames),
    ]
    if rng.random() < 0.4:
        bodies.append(_follower(rng, parcel, ride, direction, surface))
    truth = _truth(outcome, ride, begin, duration)
    if outcome == "in_progress":
        end = float(rng.uniform(begin + 2.0, ride.over - 0.3))
        truth, frames = truncated(truth, end), frames_until(end)
    return complete_world(
        rng, "conveyor", Script(bodies, view, ("sort", TASK), ("parcel", "bin"), truth, frames)
    )


def _ride(
    rng: np.random.Generator, direction: float, outcome: str, begin: float, frames: int
) -> ParcelPath:
    """Along the belt and over its end, off its side, or to a stop halfway."""
    t = frame_times(frames)
    over = begin + float(rng.uniform(4.5, 6.0))
    start = -BELT_HALF_LENGTH + rng.uniform(0.15, 0.5)
    x = start + (BELT_HALF_LENGTH + 0.1 - start) * trapezoidal_profile(t, begin, over, 0.05)
    speed = (BELT_HALF_LENGTH + 0.1 - start) / (over - begin) / 0.95
    x = np.where(t > over - 0.3, np.interp(over - 0.3, t, x) + speed * (t - over + 0.3), x)
    y = np.full(frames, rng.uniform(-0.08, 0.08))
    yaw = float(rng.uniform(-0.3, 0.3))
    if outcome == "jams":
        stop = begin + float(rng.uniform(0.4, 0.65)) * (over - begin)
        x = np.where(t < stop, x, np.interp(stop, t, x))
        poses = make_poses(np.column_stack([direction * x, y, np.full(frames, BELT_HEIGHT)]), yaw)
        return ParcelPath(poses, stop, stop)
    if outcome == "falls_off":
        leave = begin + float(rng.uniform(0.35, 0.6)) * (over - begin)
        y = y - np.clip(t - leave + 0.9, 0, 2.0) * 0.42
        since = int(np.argmax(y < -BELT_HALF_WIDTH - 0.02))
        poses = make_poses(np.column_stack([direction * x, y, np.full(frames, BELT_HEIGHT)]), yaw)
        poses, down = dropped(poses, since, 0.0, (0.3, 0.1, rng.uniform(-0.5, 0.5)))
        return ParcelPath(poses, float(t[since]), down / 15)
    poses = make_poses(np.column_stack([direction * x, y, np.full(frames, BELT_HEIGHT)]), yaw)
    since = frame_at(over)
    poses, down = dropped(poses, since, 0.06, (0.0, 0.25 * direction, rng.uniform(-0.3, 0.3)))
    poses[down:] = poses[down]
    return ParcelPath(poses, over, down / 15)


def _follower(
    rng: np.random.Generator, parcel: Solid, ride: ParcelPath, direction: float, surface: Surface
) -> RigidBody:
    """An identical parcel behind the first; the belt stops when the first has arrived."""
    frames = len(ride.poses)
    first = direction * ride.poses[:, 0, 3]
    last = min(frame_at(ride.over) - 1, frames - 1)
    x = np.where(np.arange(frames) <= last, first, first[last]) - rng.uniform(0.7, 0.95)
    x = np.clip(x, -BELT_HALF_LENGTH + 0.1, None)
    at = np.column_stack([direction * x, np.full(frames, 0.02), np.full(frames, BELT_HEIGHT)])
    return RigidBody("other", parcel, make_poses(at, float(rng.uniform(-0.3, 0.3))), OTHER, surface)


def _belt(rng: np.random.Generator) -> Solid:
    rim = pick_colour(rng, vivid=False)
    top = box((2 * BELT_HALF_LENGTH, 2 * BELT_HALF_WIDTH, 0.06), (0, 0, BELT_HEIGHT - 0.03), BLACK)
    rails = [
        box(
            (2 * BELT_HALF_LENGTH, 0.04, 0.1),
            (0, y * (BELT_HALF_WIDTH + 0.02), BELT_HEIGHT - 0.06),
            rim,
        )
        for y in (-1, 1)
    ]
    feet = [
        cone((x, y, 0), (x, y, BELT_HEIGHT - 0.06), 0.03, None, STEEL)
        for x in (-0.85 * BELT_HALF_LENGTH, 0.85 * BELT_HALF_LENGTH)
        for y in (-BELT_HALF_WIDTH, BELT_HALF_WIDTH)
    ]
    return join(top, *rails, *feet)


def _tub(colour: Colour) -> Solid:
    """An open bin."""
    width, height, thickness = 0.7, 0.42, 0.03
    return join(
        box((width, width, thickness), (0, 0, thickness / 2), colour),
        box((thickness, width, height), (width / 2, 0, height / 2), colour),
        box((thickness, width, height), (-width / 2, 0, height / 2), colour),
        box((width, thickness, height), (0, width / 2, height / 2), colour),
        box((width, thickness, height), (0, -width / 2, height / 2), colour),
    )


def _surroundings(rng: np.random.Generator, frames: int) -> list[RigidBody]:
    found = [
        floor(rng, 0.0, 30.0, ("speckles", "tiles", "grain")),
        wall(rng, 0.0, float(rng.uniform(1.6, 4.0)), 20.0),
    ]
    corridors = [
        *clutter.free_corridor((-2.2, 0), (2.4, 0), 1.2),
        *clutter.free_corridor((-2, -0.9), (2, -0.9), 0.8),
    ]
    found += clutter.scattered(
        rng, int(rng.integers(0, 5)), 0.14, (-2.2, 2.2, -1.2, 1.4), corridors
    )
    if rng.random() < 0.2:
        found += clutter.passer_by(rng, frames, (-3.5, 1.2), (3.5, 1.2), BYSTANDER)
    return found


def _truth(outcome: str, ride: ParcelPath, begin: float, end: float) -> TaskTruth:
    """Ground truth."""
    moves = (Motion("parcel", begin, ride.down),)
    if outcome == "jams":
        stages = stage_spans(("ride", begin, end, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), (), moves)
    if outcome == "falls_off":
        stages = stage_spans(("ride", begin, ride.over, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), (), moves)
    stages = stage_spans(("ride", begin, ride.down), ("binned", ride.down, end))
    touch = (Contact("parcel", "bin", ride.down, end),)
    return TaskTruth(outcome, "succeeded", stages, (), touch, moves)
