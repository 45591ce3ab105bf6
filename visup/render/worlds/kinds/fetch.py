"""`fetch`: a tug drives to a cart, couples to it and hauls it to another place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.worlds.assets import clutter, machines
from visup.render.worlds.assets.scenery import (
    distinct_colour,
    hall,
    meadow,
    pick_colour,
    random_seed,
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
    frame_at,
    frame_times,
    make_poses,
    path_positions,
    quadratic_bezier,
    trapezoidal_profile,
)
from visup.render.worlds.viewpoint import sees_all
from visup.render.worlds.world import (
    SIZE,
    Contact,
    Motion,
    Poses,
    RigidBody,
    Surface,
    TaskTruth,
    Viewpoint,
    World,
)

OUTCOMES = ("ok", "never", "loses", "in_progress")
TUG, CART, BYSTANDER, DECOY = 2, 3, 7, 6
Doubles = NDArray[np.float64]

TASK = """\
# fetch.task: the tug drives to the cart, couples to it and hauls it away.
<fetch>    ::= <approach> <coupling> <haul>

<approach> ::= converging(tug, cart)
<coupling> ::= touching(tug, cart)
<haul>     ::= moving_together(tug, cart) & moving(cart) for 2 s
               fails when apart(tug, cart)
"""


@dataclass(frozen=True, slots=True, eq=False)
class FetchLayout:
    """Positions of the cart and of the tug, metres.

    Attributes:
        cart: (x, y) of the cart's centre.
        ahead: (2,) unit, heading of the tug when it reaches the cart.
        start: (x, y) of the tug's centre at the start.
        meet: (x, y) of its centre when it touches the cart.
        goal: (2,) displacement of the cart, backwards.
    """

    cart: Doubles
    ahead: Doubles
    start: Doubles
    meet: Doubles
    goal: Doubles


@dataclass(frozen=True, slots=True)
class FetchTimes:
    """When the tug starts, reaches the cart, leaves with it, loses it, stops, and the clip ends, seconds."""

    begin: float
    meet: float
    haul: float
    loses: float
    stop: float
    end: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a cart is fetched; `outcome` is one of `OUTCOMES`."""
    colour = pick_colour(rng, bool(rng.random() < 0.7))
    tug, length = machines.vehicle(rng, colour)
    cart_length = float(rng.uniform(0.7, 1.0))
    cart = _cart(rng, cart_length, distinct_colour(rng, [colour]))
    times = _times(rng, outcome)
    frames = frames_until(times.end)
    layout, view = _layout(rng, (length + cart_length) / 2, frames)
    at, heading = _drive(layout, times, frames)
    cart_poses = _cart_poses(layout, times, at, outcome, frames)
    surface = Surface("grain", 0.3, float(rng.uniform(0.05, 0.2)), random_seed(rng))
    bodies = [
        RigidBody(
            "tug", tug, make_poses(np.column_stack([at, np.zeros(frames)]), heading), TUG, surface
        ),
        RigidBody("cart", cart, cart_poses, CART, surface),
        *_surroundings(rng, layout, cart, frames),
    ]
    truth = _truth(outcome, times)
    if outcome == "in_progress":
        end = float(rng.uniform(times.begin + 1.5, times.meet - 0.3))
        truth, frames = truncated(truth, end), frames_until(end)
    script = Script(bodies, view, ("fetch", TASK), ("tug", "cart"), truth, frames)
    return complete_world(rng, "fetch", script)


def _times(rng: np.random.Generator, outcome: str) -> FetchTimes:
    begin = float(rng.uniform(0.4, 1.2))
    meet = begin + float(rng.uniform(3.2, 4.4))
    haul = meet + float(rng.uniform(0.9, 1.4))
    stop = haul + float(rng.uniform(4.0, 5.0))
    loses = haul + float(rng.uniform(1.0, 1.5)) if outcome == "loses" else stop + 9
    return FetchTimes(begin, meet, haul, loses, stop, stop + float(rng.uniform(0.6, 1.5)))


def _layout(rng: np.random.Generator, reach: float, frames: int) -> tuple[FetchLayout, Viewpoint]:
    """Positions with the cart and its goal in view."""
    for _ in range(2000):
        side = float(rng.choice([-1, 1]))
        cart = np.array([side * rng.uniform(0.9, 1.8), rng.uniform(-0.7, 1.0)])
        angle = rng.uniform(-0.4, 0.4) + (0 if side > 0 else np.pi)
        ahead = np.array([np.cos(angle), np.sin(angle)])
        meet = cart - reach * ahead
        start = np.array([-side * rng.uniform(1.4, 2.6), rng.uniform(-1.2, 1.2)])
        goal = -ahead * rng.uniform(1.5, 2.1) + np.array([0, rng.uniform(-0.5, 0.5)])
        aim = np.array([0.0, 0.0, 0.3])
        place = random_camera_position(rng, aim, float(rng.uniform(4.8, 6.2)), (20, 50))
        view = random_view(rng, place, aim, frames)
        points = [
            [*cart, 0],
            [*(cart + ahead * 0.5), 0.6],
            [*meet, 0],
            [*(meet + goal), 0],
            [*start, 0.3],
        ]
        if sees_all(view, points, SIZE, 0.1):
            break
    return FetchLayout(cart, ahead, start, meet, goal), view


def _drive(layout: FetchLayout, times: FetchTimes, frames: int) -> tuple[Doubles, Doubles]:
    """(F, 2) positions and (F,) headings of the tug: forward to the cart, backward from it."""
    t = frame_times(frames)
    straight = layout.meet - 0.6 * layout.ahead
    curve = quadratic_bezier(layout.start, straight - 0.9 * layout.ahead, straight)
    at, heading = path_positions(
        np.concatenate([curve, [layout.meet]]), trapezoidal_profile(t, times.begin, times.meet)
    )
    back = trapezoidal_profile(t, times.haul, times.stop)
    return at + np.outer(back, layout.goal), heading


def _cart_poses(
    layout: FetchLayout, times: FetchTimes, at: Doubles, outcome: str, frames: int
) -> Poses:
    """(F, 4, 4) of the cart: at rest, then following, then at rest where it is lost."""
    yaw = float(np.arctan2(layout.ahead[1], layout.ahead[0]))
    first, last = frame_at(times.haul), min(frame_at(times.loses), frames)
    shift = np.zeros((frames, 2))
    if outcome != "never":
        shift[first:last] = at[first:last] - at[first]
        shift[last:] = shift[last - 1]
        if last < frames:
            # It rolls on for a moment.
            speed = shift[last - 1] - shift[last - 2]
            shift[last:] += np.outer(6 * (1 - np.exp(-np.arange(frames - last) / 6)), speed)
    return make_poses(np.column_stack([layout.cart + shift, np.zeros(frames)]), yaw)


def _cart(rng: np.random.Generator, length: float, colour: Colour) -> Solid:
    """A cart with a load."""
    width, wheel_radius = length * 0.62, 0.09
    bed = box((length, width, 0.1), (0, 0, 0.26), colour)
    load = pick_colour(rng, bool(rng.random() < 0.5))
    style = rng.integers(3)
    if style == 0:
        cargo = box((0.6 * length, 0.8 * width, 0.3), (0.05 * length, 0, 0.46), load)
    elif style == 1:
        cargo = cone((0, 0, 0.31), (0, 0, 0.75), 0.36 * width, None, load)
    else:
        low = box((0.8 * length, 0.85 * width, 0.2), (0, 0, 0.41), load)
        cargo = join(low, box((0.4 * length, 0.5 * width, 0.2), (-0.1 * length, 0, 0.6), colour))
    return join(bed, machines.wheels(length, width, wheel_radius), cargo)


def _surroundings(
    rng: np.random.Generator, layout: FetchLayout, cart: Solid, frames: int
) -> list[RigidBody]:
    found = list(hall(rng, float(rng.uniform(2.8, 5.0))) if rng.random() < 0.6 else meadow(rng))
    corridors = clutter.free_corridor(layout.start, layout.meet, 1.8)
    corridors += clutter.free_corridor(
        layout.cart + layout.ahead, layout.meet + 1.5 * layout.goal, 2.2
    )
    if rng.random() < 0.3:
        x, y = rng.uniform([-2.5, 0.8], [2.5, 2.0])
        if all(np.hypot(x - a, y - b) > r + 0.7 for a, b, r in corridors):
            found.append(
                RigidBody("decoy", cart, make_poses([x, y, 0.0], float(rng.uniform(0, 6.3))), DECOY)
            )
            corridors.append((float(x), float(y), 0.8))
    found += clutter.scattered(rng, int(rng.integers(0, 5)), 0.2, (-3.5, 3.5, -2.5, 2.2), corridors)
    if rng.random() < 0.2:
        found += clutter.passer_by(rng, frames, (-4.5, 2.1), (4.5, 2.1), BYSTANDER)
    return found


def _truth(outcome: str, times: FetchTimes) -> TaskTruth:
    """Ground truth."""
    t = times
    moves: tuple[Motion, ...] = (Motion("tug", t.begin, t.meet), Motion("tug", t.haul, t.stop))
    stages = stage_spans(("approach", t.begin, t.meet), ("coupling", t.meet, t.haul))
    if outcome == "never":
        touch = (Contact("tug", "cart", t.meet, t.haul),)
        stages += stage_spans(("haul", t.haul, t.stop, "failing"))
        return TaskTruth(outcome, "failed", stages, (), touch, moves)
    moves += (Motion("cart", t.haul, min(t.stop, t.loses + 0.4)),)
    touch = (Contact("tug", "cart", t.meet, min(t.end, t.loses)),)
    if outcome == "loses":
        stages += stage_spans(("haul", t.haul, t.loses, "failing"))
        return TaskTruth(outcome, "failed", stages, (), touch, moves)
    return TaskTruth(
        outcome, "succeeded", stages + stage_spans(("haul", t.haul, t.stop)), (), touch, moves
    )
