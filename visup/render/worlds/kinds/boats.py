"""`boats`: a boat comes alongside a pier or a moored ship and stays there, bobbing."""

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
from visup.render.worlds.motion import along, bend, clock, cruised, eased, posed, still
from visup.render.worlds.things.machines import BLACK, GLASS, STEEL
from visup.render.worlds.things.scenery import pick_colour, seed_of, unlike
from visup.render.worlds.water import random_waves
from visup.render.worlds.world import Contact, Course, Motion, Poses, Surface, Thing, Water, World

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
class Sailing:
    """The boat's path: (F, 2) positions, (F,) headings; when it is alongside and when it leaves, seconds."""

    at: Doubles
    heading: Doubles
    near: float
    off: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a boat berths; `outcome` is one of `OUTCOMES`."""
    colour = pick_colour(rng, bool(rng.random() < 0.7))
    length = float(rng.uniform(3.2, 4.6))
    wide = length * float(rng.uniform(0.3, 0.38))
    boat = _boat(rng, length, wide, colour)
    ship = bool(rng.random() < 0.45)
    name = "ship" if ship else "pier"
    berth, edge = _ship(rng, unlike(rng, [colour])) if ship else _pier(rng)
    begin, duration = float(rng.uniform(0.3, 1.0)), float(rng.uniform(12.5, 14.8))
    frames = frames_until(duration)
    sailing = _sail(rng, wide, outcome, begin, frames)
    surface = Surface("grain", 0.6, float(rng.uniform(0.05, 0.2)), seed_of(rng))
    t = clock(frames)
    where = _bobbing(rng, t, np.array([0.0, edge]), 0.4) if ship else still(0, edge)
    aim = np.array([0.0, -0.8, 0.6])
    place = from_around(rng, aim, float(rng.uniform(12, 15)), (16, 45))
    view = random_view(rng, place, aim, frames)
    things = [
        Thing("boat", boat, _bobbing(rng, t, sailing.at, 1.0, sailing.heading), BOAT, surface),
        Thing(name, berth, where, BERTH, surface),
        *_surroundings(rng),
    ]
    truth = _course(outcome, name, sailing, begin, duration)
    if outcome == "in_progress":
        end = begin + float(rng.uniform(0.55, 0.85)) * (sailing.near - begin)
        truth, frames = cut_short(truth, end), frames_until(end)
    task = ("berth", TASK.format(berth=name, hold=HOLD_S))
    script = Script(things, view, task, ("boat", name), truth, frames, _water(rng))
    return finished(rng, "boats", script)


def _sail(
    rng: np.random.Generator, wide: float, outcome: str, begin: float, frames: int
) -> Sailing:
    """The path; the edge of the berth lies along x at y = 0, the boat comes from -y."""
    t = clock(frames)
    side = float(rng.choice([-1, 1]))
    near = begin + float(rng.uniform(5.5, 7.0))
    none = t[-1] + 1
    start = np.array([-side * rng.uniform(4.0, 5.5), -rng.uniform(2.6, 4.2)])
    dock = np.array([side * rng.uniform(-0.6, 0.8), -wide / 2 - 0.02])
    if outcome == "short":
        dock[1] -= rng.uniform(1.0, 1.6)
    if outcome == "miss":
        beside = np.array([side * 0.5, -wide / 2 - rng.uniform(1.1, 1.8)])
        end = np.array([side * 7.0, beside[1] - rng.uniform(1.0, 2.0)])
        way = np.concatenate(
            [bend(start, [0, beside[1]], beside), bend(beside, [side * 3, beside[1]], end)]
        )
        at, heading = along(way, cruised(t, begin, begin + float(rng.uniform(9, 11)), 0.12))
        nearest = float(t[int(np.abs(at[:, 0] - beside[0]).argmin())])
        return Sailing(at, heading, nearest, none)
    # The hull turns parallel to the edge before it closes the last of the gap sideways.
    ahead = dock - [0.0, 0.5]
    at, heading = along(
        bend(start, ahead - [side * 2.2, 0.0], ahead), cruised(t, begin, near - 1.2)
    )
    at = at + np.outer(eased(t, [(near - 2.0, 0.0), (near, 1.0)]), dock - ahead)
    off = none
    if outcome == "leave":
        off = near + float(rng.uniform(0.8, 1.3))
        away = np.array([side * 0.8, -rng.uniform(1.5, 2.2)])
        at = at + np.outer(eased(t, [(off, 0.0), (off + 3.5, 1.0)]), away)
    return Sailing(at, heading, near, off)


def _bobbing(
    rng: np.random.Generator, t: Doubles, at: Doubles, amount: float, heading: Doubles | float = 0.0
) -> Poses:
    """(F, 4, 4) poses of a vessel floating at (2,) or (F, 2)."""
    a, b, c = rng.uniform(0, 6.3, 3)
    heave = 0.05 * amount * np.sin(2 * np.pi * t / 2.6 + a)
    roll = 0.05 * amount * np.sin(2 * np.pi * t / 2.1 + b)
    pitch = 0.02 * amount * np.sin(2 * np.pi * t / 3.1 + c)
    places = np.broadcast_to(at, (len(t), 2))
    return posed(np.column_stack([places, heave]), heading, pitch, roll)


def _hull(length: float, wide: float, high: float, colour: Colour) -> Solid:
    """A hull along x with a pointed bow, its deck at a height, its keel below the water."""
    body = box((0.72 * length, wide, high + 0.3), (-0.14 * length, 0, (high - 0.3) / 2), colour)
    bow = Solid(
        np.array(
            [(0.22 * length, y * wide / 2, z) for z in (-0.3, high) for y in (-1, 1)]
            + [(0.42 * length, 0, -0.3), (0.5 * length, 0, high + 0.12)]
        ),
        np.array([(0, 4, 5), (0, 5, 2), (1, 5, 4), (1, 3, 5), (2, 5, 3), (0, 1, 4)]),
        np.tile(colour, (6, 1)),
    )
    return join(body, bow)


def _boat(rng: np.random.Generator, length: float, wide: float, colour: Colour) -> Solid:
    high = 0.13 * length
    second = pick_colour(rng, bool(rng.random() < 0.6))
    cabin = box((0.3 * length, 0.7 * wide, 0.5), (-0.05 * length, 0, high + 0.25), second)
    glass = box((0.2 * length, 0.72 * wide, 0.16), (0, 0, high + 0.36), GLASS)
    parts = [_hull(length, wide, high, colour), cabin, glass]
    style = rng.integers(3)
    if style == 0:
        parts.append(
            cone((-0.05 * length, 0, high), (-0.05 * length, 0, high + 1.5), 0.03, None, STEEL)
        )
    elif style == 1:
        parts.append(
            cone((-0.25 * length, 0, high), (-0.25 * length, 0, high + 0.6), 0.14, None, BLACK)
        )
    else:
        parts.append(
            box(
                (0.25 * length, 0.6 * wide, 0.3), (-0.33 * length, 0, high + 0.15), pick_colour(rng)
            )
        )
    return join(*parts)


def _pier(rng: np.random.Generator) -> tuple[Solid, float]:
    """A pier on posts whose edge lies at y = 0 of its frame, and its pose."""
    half, deep = float(rng.uniform(2.6, 4.0)), float(rng.uniform(1.2, 2.2))
    colour = (0.42, 0.33, 0.24) if rng.random() < 0.5 else pick_colour(rng, vivid=False)
    deck = box((2 * half, deep, 0.2), (0, deep / 2, 0.6), colour)
    posts = [
        cone((x, y, -0.5), (x, y, 0.6 + 0.25 * (y < 0.3)), 0.1, None, (0.25, 0.2, 0.16))
        for x in np.linspace(-0.95, 0.95, 6) * half
        for y in (0.12, deep - 0.15)
    ]
    return join(deck, *posts), 0.0


def _ship(rng: np.random.Generator, colour: Colour) -> tuple[Solid, float]:
    """A larger boat that lies along x, its side at y = 0 of the world."""
    length, wide = float(rng.uniform(6.0, 7.5)), float(rng.uniform(1.7, 2.2))
    house = box((1.4, 0.8 * wide, 1.1), (-0.25 * length, 0, 1.35), (0.8, 0.8, 0.78))
    funnel = cone((-0.25 * length, 0, 1.9), (-0.25 * length, 0, 2.5), 0.25, None, pick_colour(rng))
    hold = box((2.2, 0.7 * wide, 0.3), (0.05 * length, 0, 0.95), pick_colour(rng, vivid=False))
    return join(_hull(length, wide, 0.85, colour), house, funnel, hold), wide / 2


def _water(rng: np.random.Generator) -> Water:
    tones = ((0.05, 0.16, 0.2), (0.04, 0.1, 0.18), (0.1, 0.2, 0.17), (0.14, 0.17, 0.16))
    colour = tones[rng.integers(len(tones))]
    return Water(
        colour, random_waves(rng, float(rng.uniform(1.6, 3.5)), float(rng.uniform(0.03, 0.12)))
    )


def _surroundings(rng: np.random.Generator) -> list[Thing]:
    """A far shore, and buoys that do not move."""
    surface = Surface("speckles", 3.0, 0.35, seed_of(rng))
    shore = box(
        (160, 12, float(rng.uniform(2.0, 7.0))),
        (0, float(rng.uniform(35, 60)), 0),
        (0.25, 0.32, 0.2),
    )
    found = [Thing("shore", shore, still(0, 0), 0, surface)]
    for _ in range(int(rng.integers(0, 4))):
        buoy = cone((0, 0, -0.2), (0, 0, 0.5), 0.2, 0.05, pick_colour(rng))
        x, y = float(rng.uniform(-7, 7)), float(rng.uniform(3.5, 9))
        found.append(Thing("buoy", buoy, still(x, y), 0, surface))
    return found


def _course(outcome: str, berth: str, sailing: Sailing, begin: float, end: float) -> Course:
    """Ground truth."""
    stages = spans(("approach", begin, sailing.near))
    moves = (Motion("boat", begin, sailing.near),)
    touch = (Contact("boat", berth, sailing.near, min(sailing.off, end)),)
    stay = ("alongside", sailing.near, min(sailing.near + HOLD_S, end))
    if outcome in ("ok", "in_progress"):
        return Course(outcome, "succeeded", (*stages, *spans(stay)), (), touch, moves)
    if outcome == "short":
        stages = spans(("approach", begin, end, "failing"))
        return Course(outcome, "failed", stages, ("failed", "in_progress"), (), moves)
    stages += spans((*stay, "failing"))
    return Course(outcome, "failed", stages, (), touch if outcome == "leave" else (), moves)
