"""`crane`: a crane lowers a container onto a truck and lets it go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.worlds.assets import clutter
from visup.render.worlds.assets.machines import BLACK, GLASS, STEEL
from visup.render.worlds.assets.scenery import (
    distinct_colour,
    floor,
    meadow,
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
    eased,
    frame_at,
    frame_times,
    make_poses,
    static_pose,
)
from visup.render.worlds.world import Contact, Motion, Poses, RigidBody, Surface, TaskTruth, World

OUTCOMES = ("ok", "miss", "drop", "carry_off", "in_progress")
SPREADER, CONTAINER, TRUCK, BYSTANDER = 2, 3, 4, 7
BED_HEIGHT = 0.8
"""Height of the truck's bed, metres."""

Doubles = NDArray[np.float64]

LOAD_TASK = """\
# load.task: the crane lowers the container onto the truck, lets it go and rises.
<load>    ::= <lower> <placed> <release> <rise>

<lower>   ::= moving_together(spreader, container) & converging(container, truck)
              fails when apart(spreader, container)
<placed>  ::= touching(container, truck) & coupled(spreader, container)
<release> ::= decoupled(spreader, container) & touching(container, truck)
<rise>    ::= diverging(spreader, container) for 1 s
"""

SET_DOWN_TASK = """\
# set_down.task: the container comes down onto the truck and stays there.
<set_down> ::= <lower> <loaded>

<lower>    ::= converging(container, truck)
<loaded>   ::= touching(container, truck) for 2 s
"""


@dataclass(frozen=True, slots=True)
class CraneTimes:
    """When the container starts, is above its goal, is set down, is released, and the crane rises."""

    begin: float
    above: float
    down: float
    release: float
    rise: float
    end: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a truck is loaded; `outcome` is one of `OUTCOMES`."""
    size = np.array([rng.uniform(1.8, 2.6), rng.uniform(1.0, 1.2), rng.uniform(0.9, 1.2)])
    colour = pick_colour(rng)
    times = _times(rng)
    frames = frames_until(times.end)
    load, hook, drop_s = _poses(rng, size, times, outcome, frames)
    surface = Surface("stripes", 0.35, float(rng.uniform(0.0, 0.25)), random_seed(rng))
    plain = Surface("grain", 0.4, 0.15, random_seed(rng))
    truck = _truck(rng, distinct_colour(rng, [colour]))
    aim = np.array([rng.uniform(-0.3, 0.3), 0.0, 1.5])
    place = random_camera_position(rng, aim, float(rng.uniform(8.0, 10)), (12, 40))
    view = random_view(rng, place, aim, frames)
    bodies = [
        RigidBody("container", box(size, (0, 0, size[2] / 2), colour), load, CONTAINER, surface),
        RigidBody("spreader", _spreader(rng, size), hook, SPREADER, plain),
        # The rope is no actor: more and more of it comes into view.
        RigidBody("rope", cone((0, 0, 0.6), (0, 0, 9), 0.035, None, BLACK), hook, 0, plain),
        RigidBody(
            "truck", truck, static_pose(0, 0, 0, float(rng.uniform(-0.25, 0.25))), TRUCK, plain
        ),
        *_surroundings(rng, frames),
    ]
    short = bool(rng.random() < 0.4) and outcome != "drop"
    truth = _truth(times, outcome, drop_s, short)
    if outcome == "in_progress":
        end = float(rng.uniform(times.above, times.down - 0.5))
        truth, frames = truncated(truth, end), frames_until(end)
    task = ("set_down", SET_DOWN_TASK) if short else ("load", LOAD_TASK)
    actors = ("container", "truck") if short else ("spreader", "container", "truck")
    return complete_world(rng, "crane", Script(bodies, view, task, actors, truth, frames))


def _times(rng: np.random.Generator) -> CraneTimes:
    begin = float(rng.uniform(0.4, 1.2))
    above = begin + float(rng.uniform(2.6, 3.6))
    down = above + float(rng.uniform(2.4, 3.2))
    release = down + float(rng.uniform(1.2, 1.6))
    rise = release + float(rng.uniform(0.2, 0.4))
    return CraneTimes(begin, above, down, release, rise, rise + float(rng.uniform(2.6, 3.6)))


def _poses(
    rng: np.random.Generator, size: Doubles, times: CraneTimes, outcome: str, frames: int
) -> tuple[Poses, Poses, float]:
    """Poses of container and spreader, and when the container is dropped (past the end if it is not)."""
    t, bed = frame_times(frames), np.array([-0.55, 0.0, BED_HEIGHT])
    side = float(rng.choice([-1, 1]))
    start = np.array([side * rng.uniform(2.8, 3.4), rng.uniform(-0.3, 0.6), rng.uniform(2.0, 2.5)])
    goal = bed.copy()
    if outcome == "miss":
        # In front of the truck: in the image they may touch.
        goal = np.array([rng.uniform(-1.0, 0.4), -rng.uniform(1.7, 2.3), 0.0])
    over = np.array([goal[0], goal[1], max(start[2], 2.0)])
    if outcome == "drop":
        # It moves in front of the truck, so that a dropped container falls to the ground.
        start[1] = over[1] = -rng.uniform(2.1, 2.6)
    keys = [(times.begin, start), (times.above, over), (times.down, goal)]
    path = eased(t, keys)
    hook = path + np.array([0, 0, size[2]])
    lift = eased(t, [(times.rise, 0.0), (times.rise + 2.4, 2.6)])
    if outcome == "carry_off":
        path = path + np.outer(lift, [0, 0, 1])
    hook = hook + np.outer(lift, [0, 0, 1])
    sway = _sway(rng, t, times)
    path, hook = path + np.outer(sway, [1, 0.3, 0]), hook + np.outer(sway, [1, 0.3, 0])
    yaw = float(rng.uniform(-0.1, 0.1))
    load, crane = make_poses(path, yaw), make_poses(hook, yaw)
    if outcome != "drop":
        return load, crane, times.end + 1
    since = times.begin + float(rng.uniform(0.3, 0.5)) * (times.above - times.begin)
    load, _ = dropped(load, frame_at(since), 0.0, rng.uniform(-0.15, 0.15, 3) * [0.2, 0.2, 1])
    return load, crane, since


def _sway(rng: np.random.Generator, t: Doubles, times: CraneTimes) -> Doubles:
    """(F,) displacement of the swinging load, metres."""
    hangs = np.clip((times.down - 0.3 - t) / 1.5, 0, 1) * np.clip((t - times.begin) / 1.0, 0, 1)
    return np.asarray(0.05 * hangs * np.sin(2 * np.pi * t / rng.uniform(1.8, 2.6)))


def _truck(rng: np.random.Generator, colour: Colour) -> Solid:
    """A truck along x, its cab ahead, its bed at `BED_HEIGHT`."""
    wheels = [
        cone((x, y - 0.12, 0.33), (x, y + 0.12, 0.33), 0.33, None, BLACK)
        for x in (-1.5, -0.8, 1.35)
        for y in (-0.6, 0.6)
    ]
    bed = box((3.0, 1.35, 0.2), (-0.55, 0, BED_HEIGHT - 0.1), pick_colour(rng, vivid=False))
    cab_height = float(rng.uniform(1.2, 1.6))
    cab = box((0.9, 1.35, cab_height), (1.5, 0, 0.35 + cab_height / 2), colour)
    glass = box((0.3, 1.2, 0.45), (1.82, 0, 0.1 + cab_height), GLASS)
    beam = box((3.6, 0.5, 0.25), (0, 0, 0.45), BLACK)
    return join(bed, cab, glass, beam, *wheels)


def _spreader(rng: np.random.Generator, size: Doubles) -> Solid:
    """A frame with its slings; origin on its lower side, which lies on the container."""
    colour = pick_colour(rng)
    frame = box((size[0] * 0.9, size[1] * 0.7, 0.12), (0, 0, 0.06), colour)
    block = box((0.5, 0.35, 0.3), (0, 0, 0.5), STEEL)
    slings = [
        cone((x * size[0] * 0.4, y * size[1] * 0.3, 0.12), (0, 0, 0.5), 0.025, None, BLACK)
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    return join(frame, block, *slings)


def _surroundings(rng: np.random.Generator, frames: int) -> list[RigidBody]:
    found = (
        list(meadow(rng))
        if rng.random() < 0.5
        else [floor(rng, 0.0, 80.0, ("speckles", "grain", "tiles"))]
    )
    if rng.random() < 0.5:
        found.append(wall(rng, -4.0, float(rng.uniform(4, 7)), 30.0))
    for _ in range(int(rng.integers(0, 5))):
        solid = box((2.4, 1.1, 1.1), (0, 0, 0.55), pick_colour(rng))
        at = static_pose(
            float(rng.uniform(-6, 6)),
            float(rng.uniform(2.6, 4.0)),
            0,
            float(rng.uniform(-0.2, 0.2)),
        )
        found.append(
            RigidBody("stock", solid, at, 0, Surface("stripes", 0.35, 0.15, random_seed(rng)))
        )
    if rng.random() < 0.25:
        found += clutter.passer_by(rng, frames, (-5.0, 2.0), (5.0, 2.2), BYSTANDER)
    return found


def _truth(times: CraneTimes, outcome: str, drop_s: float, short: bool) -> TaskTruth:
    """Ground truth."""
    t = times
    held = Contact("spreader", "container", 0.0, min(t.release, drop_s))
    touch = Contact("container", "truck", t.down, t.end)
    moves: tuple[Motion, ...] = (Motion("container", t.begin, min(t.down, drop_s + 0.5)),)
    lower = ("lower", t.begin, t.down)
    both = () if short else (held,)
    if outcome == "drop":
        return TaskTruth(
            outcome, "failed", stage_spans((*lower[:2], drop_s, "failing")), (), both, moves
        )
    if outcome == "miss":
        stages = stage_spans(lower, ("loaded" if short else "placed", t.down, t.release, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), both, moves)
    if outcome == "carry_off":
        touch = Contact("container", "truck", t.down, t.rise)
        both = () if short else (Contact("spreader", "container", 0.0, t.end),)
        moves += (Motion("container", t.rise, t.end),)
        last = (
            ("loaded", t.down, t.rise, "failing")
            if short
            else ("release", t.rise, t.end, "failing")
        )
        stages = (
            stage_spans(lower, last)
            if short
            else stage_spans(lower, ("placed", t.down, t.rise), last)
        )
        return TaskTruth(outcome, "failed", stages, (), (*both, touch), moves)
    if short:
        stages = stage_spans(lower, ("loaded", t.down, t.down + 2))
    else:
        stages = stage_spans(
            lower,
            ("placed", t.down, t.release),
            ("release", t.release, t.rise),
            ("rise", t.rise, t.end),
        )
    return TaskTruth(outcome, "succeeded", stages, (), (*both, touch), moves)
