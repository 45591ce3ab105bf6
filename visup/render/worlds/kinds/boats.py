"""`boats`: a boat comes alongside a pier or a moored ship and stays there, bobbing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.worlds.assets.machines import BLACK, GLASS, STEEL
from visup.render.worlds.assets.scenery import distinct_colour, pick_colour, random_seed
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
    eased,
    frame_times,
    make_poses,
    path_positions,
    quadratic_bezier,
    static_pose,
    trapezoidal_profile,
)
from visup.render.worlds.water import random_waves
from visup.render.worlds.world import (
    Contact,
    Motion,
    Poses,
    RigidBody,
    Surface,
    TaskTruth,
    Water,
    World,
)

OUTCOMES = ("ok", "miss", "leave", "short", "in_progress")
BOAT, BERTH, BYSTANDER = 2, 3, 7
HOLD_S = 3
Doubles = NDArray[np.float64]

TASK = """\
# berth.task: the boat comes alongside and stays there.
<berth>     ::= <approach> <alongside>

<approach>  ::= converging(boat, {berth})
<alongside> ::= touching(boat, {berth}) for {hold} s
"""


@dataclass(frozen=True, slots=True, eq=False)
class BoatPath:
    """The boat's path: (F, 2) positions, (F,) headings; when it is alongside and when it leaves, seconds."""

    at: Doubles
    heading: Doubles
    near: float
    off: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a boat berths; `outcome` is one of `OUTCOMES`."""
    colour = pick_colour(rng, bool(rng.random() < 0.7))
    length = float(rng.uniform(3.2, 4.6))
    width = length * float(rng.uniform(0.3, 0.38))
    boat = _boat(rng, length, width, colour)
    ship = bool(rng.random() < 0.45)
    name = "ship" if ship else "pier"
    berth, edge = _ship(rng, distinct_colour(rng, [colour])) if ship else _pier(rng)
    begin, duration = float(rng.uniform(0.3, 1.0)), float(rng.uniform(12.5, 14.8))
    frames = frames_until(duration)
    path = _boat_path(rng, width, outcome, begin, frames)
    surface = Surface("grain", 0.6, float(rng.uniform(0.05, 0.2)), random_seed(rng))
    t = frame_times(frames)
    where = _bobbing(rng, t, np.array([0.0, edge]), 0.4) if ship else static_pose(0, edge)
    aim = np.array([0.0, -0.8, 0.6])
    place = random_camera_position(rng, aim, float(rng.uniform(12, 15)), (16, 45))
    view = random_view(rng, place, aim, frames)
    bodies = [
        RigidBody("boat", boat, _bobbing(rng, t, path.at, 1.0, path.heading), BOAT, surface),
        RigidBody(name, berth, where, BERTH, surface),
        *_surroundings(rng),
    ]
    truth = _truth(outcome, name, path, begin, duration)
    if outcome == "in_progress":
        end = begin + float(rng.uniform(0.55, 0.85)) * (path.near - begin)
        truth, frames = truncated(truth, end), frames_until(end)
    task = ("berth", TASK.format(berth=name, hold=HOLD_S))
    script = Script(bodies, view, task, ("boat", name), truth, frames, _water(rng))
    return complete_world(rng, "boats", script)


def _boat_path(
    rng: np.random.Generator, width: float, outcome: str, begin: float, frames: int
) -> BoatPath:
    """The path; the edge of the berth lies along x at y = 0, the boat comes from -y."""
    t = frame_times(frames)
    side = float(rng.choice([-1, 1]))
    near = begin + float(rng.uniform(5.5, 7.0))
    never = t[-1] + 1
    start = np.array([-side * rng.uniform(4.0, 5.5), -rng.uniform(2.6, 4.2)])
    dock = np.array([side * rng.uniform(-0.6, 0.8), -width / 2 - 0.02])
    if outcome == "short":
        dock[1] -= rng.uniform(1.0, 1.6)
    if outcome == "miss":
        beside = np.array([side * 0.5, -width / 2 - rng.uniform(1.1, 1.8)])
        end = np.array([side * 7.0, beside[1] - rng.uniform(1.0, 2.0)])
        curve = np.concatenate(
            [
                quadratic_bezier(start, [0, beside[1]], beside),
                quadratic_bezier(beside, [side * 3, beside[1]], end),
            ]
        )
        at, heading = path_positions(
            curve, trapezoidal_profile(t, begin, begin + float(rng.uniform(9, 11)), 0.12)
        )
        nearest = float(t[int(np.abs(at[:, 0] - beside[0]).argmin())])
        return BoatPath(at, heading, nearest, never)
    # The hull turns parallel to the edge before it closes the last of the gap sideways.
    ahead = dock - [0.0, 0.5]
    at, heading = path_positions(
        quadratic_bezier(start, ahead - [side * 2.2, 0.0], ahead),
        trapezoidal_profile(t, begin, near - 1.2),
    )
    at = at + np.outer(eased(t, [(near - 2.0, 0.0), (near, 1.0)]), dock - ahead)
    off = never
    if outcome == "leave":
        off = near + float(rng.uniform(0.8, 1.3))
        away = np.array([side * 0.8, -rng.uniform(1.5, 2.2)])
        at = at + np.outer(eased(t, [(off, 0.0), (off + 3.5, 1.0)]), away)
    return BoatPath(at, heading, near, off)


def _bobbing(
    rng: np.random.Generator, t: Doubles, at: Doubles, amount: float, heading: Doubles | float = 0.0
) -> Poses:
    """(F, 4, 4) poses of a vessel floating at (2,) or (F, 2)."""
    a, b, c = rng.uniform(0, 6.3, 3)
    heave = 0.05 * amount * np.sin(2 * np.pi * t / 2.6 + a)
    roll = 0.05 * amount * np.sin(2 * np.pi * t / 2.1 + b)
    pitch = 0.02 * amount * np.sin(2 * np.pi * t / 3.1 + c)
    places = np.broadcast_to(at, (len(t), 2))
    return make_poses(np.column_stack([places, heave]), heading, pitch, roll)


def _hull(length: float, width: float, deck_height: float, colour: Colour) -> Solid:
    """A hull along x with a pointed bow, its deck at a height, its keel below the water."""
    body = box(
        (0.72 * length, width, deck_height + 0.3),
        (-0.14 * length, 0, (deck_height - 0.3) / 2),
        colour,
    )
    bow = Solid(
        np.array(
            [(0.22 * length, y * width / 2, z) for z in (-0.3, deck_height) for y in (-1, 1)]
            + [(0.42 * length, 0, -0.3), (0.5 * length, 0, deck_height + 0.12)]
        ),
        np.array([(0, 4, 5), (0, 5, 2), (1, 5, 4), (1, 3, 5), (2, 5, 3), (0, 1, 4)]),
        np.tile(colour, (6, 1)),
    )
    return join(body, bow)


def _boat(rng: np.random.Generator, length: float, width: float, colour: Colour) -> Solid:
    deck_height = 0.13 * length
    second = pick_colour(rng, bool(rng.random() < 0.6))
    cabin = box((0.3 * length, 0.7 * width, 0.5), (-0.05 * length, 0, deck_height + 0.25), second)
    glass = box((0.2 * length, 0.72 * width, 0.16), (0, 0, deck_height + 0.36), GLASS)
    parts = [_hull(length, width, deck_height, colour), cabin, glass]
    style = rng.integers(3)
    if style == 0:
        parts.append(
            cone(
                (-0.05 * length, 0, deck_height),
                (-0.05 * length, 0, deck_height + 1.5),
                0.03,
                None,
                STEEL,
            )
        )
    elif style == 1:
        parts.append(
            cone(
                (-0.25 * length, 0, deck_height),
                (-0.25 * length, 0, deck_height + 0.6),
                0.14,
                None,
                BLACK,
            )
        )
    else:
        parts.append(
            box(
                (0.25 * length, 0.6 * width, 0.3),
                (-0.33 * length, 0, deck_height + 0.15),
                pick_colour(rng),
            )
        )
    return join(*parts)


def _pier(rng: np.random.Generator) -> tuple[Solid, float]:
    """A pier on posts whose edge lies at y = 0 of its frame, and its pose."""
    half_length, depth = float(rng.uniform(2.6, 4.0)), float(rng.uniform(1.2, 2.2))
    colour = (0.42, 0.33, 0.24) if rng.random() < 0.5 else pick_colour(rng, vivid=False)
    deck = box((2 * half_length, depth, 0.2), (0, depth / 2, 0.6), colour)
    posts = [
        cone((x, y, -0.5), (x, y, 0.6 + 0.25 * (y < 0.3)), 0.1, None, (0.25, 0.2, 0.16))
        for x in np.linspace(-0.95, 0.95, 6) * half_length
        for y in (0.12, depth - 0.15)
    ]
    return join(deck, *posts), 0.0


def _ship(rng: np.random.Generator, colour: Colour) -> tuple[Solid, float]:
    """A larger boat that lies along x, its side at y = 0 of the world."""
    length, width = float(rng.uniform(6.0, 7.5)), float(rng.uniform(1.7, 2.2))
    house = box((1.4, 0.8 * width, 1.1), (-0.25 * length, 0, 1.35), (0.8, 0.8, 0.78))
    funnel = cone((-0.25 * length, 0, 1.9), (-0.25 * length, 0, 2.5), 0.25, None, pick_colour(rng))
    hold = box((2.2, 0.7 * width, 0.3), (0.05 * length, 0, 0.95), pick_colour(rng, vivid=False))
    return join(_hull(length, width, 0.85, colour), house, funnel, hold), width / 2


def _water(rng: np.random.Generator) -> Water:
    tones = ((0.05, 0.16, 0.2), (0.04, 0.1, 0.18), (0.1, 0.2, 0.17), (0.14, 0.17, 0.16))
    colour = tones[rng.integers(len(tones))]
    return Water(
        colour, random_waves(rng, float(rng.uniform(1.6, 3.5)), float(rng.uniform(0.03, 0.12)))
    )


def _surroundings(rng: np.random.Generator) -> list[RigidBody]:
    """A far shore, and buoys that do not move."""
    surface = Surface("speckles", 3.0, 0.35, random_seed(rng))
    shore = box(
        (160, 12, float(rng.uniform(2.0, 7.0))),
        (0, float(rng.uniform(35, 60)), 0),
        (0.25, 0.32, 0.2),
    )
    found = [RigidBody("shore", shore, static_pose(0, 0), 0, surface)]
    for _ in range(int(rng.integers(0, 4))):
        buoy = cone((0, 0, -0.2), (0, 0, 0.5), 0.2, 0.05, pick_colour(rng))
        x, y = float(rng.uniform(-7, 7)), float(rng.uniform(3.5, 9))
        found.append(RigidBody("buoy", buoy, static_pose(x, y), 0, surface))
    return found


def _truth(outcome: str, berth: str, path: BoatPath, begin: float, end: float) -> TaskTruth:
    """Ground truth."""
    stages = stage_spans(("approach", begin, path.near))
    moves = (Motion("boat", begin, path.near),)
    touch = (Contact("boat", berth, path.near, min(path.off, end)),)
    stay = ("alongside", path.near, min(path.near + HOLD_S, end))
    if outcome in ("ok", "in_progress"):
        return TaskTruth(outcome, "succeeded", (*stages, *stage_spans(stay)), (), touch, moves)
    if outcome == "short":
        stages = stage_spans(("approach", begin, end, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), (), moves)
    stages += stage_spans((*stay, "failing"))
    return TaskTruth(outcome, "failed", stages, (), touch if outcome == "leave" else (), moves)
