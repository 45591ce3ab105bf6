"""Small objects, decoys that look like a part, people who walk past."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from visup.render.meshes.solids import Colour, Solid, ball, box, cone, join, lathe
from visup.render.worlds.assets.scenery import pick_colour, random_seed
from visup.render.worlds.motion import make_poses, path_positions, static_pose
from visup.render.worlds.world import FPS, RigidBody, Surface

Doubles = NDArray[np.float64]


def cup(r: float, colour: Colour) -> Solid:
    """An open cup standing at z = 0."""
    h = 2.2 * r
    return lathe(
        [(0, 0), (0.75 * r, 0), (r, h), (0.9 * r, h), (0.68 * r, 0.08 * h), (0, 0.08 * h)],
        colour,
        24,
    )


def bottle(r: float, colour: Colour) -> Solid:
    """A bottle standing at z = 0."""
    profile = [(0, 0), (r, 0), (r, 3.2 * r), (0.35 * r, 4.4 * r), (0.35 * r, 5.4 * r), (0, 5.4 * r)]
    return lathe(profile, colour, 24)


def can(r: float, colour: Colour) -> Solid:
    """A cylinder standing at z = 0."""
    return cone((0, 0, 0), (0, 0, 2.3 * r), r, None, colour)


def crate(r: float, colour: Colour) -> Solid:
    """A block standing at z = 0."""
    return box((2 * r, 1.6 * r, 1.4 * r), (0, 0, 0.7 * r), colour)


def sphere(r: float, colour: Colour) -> Solid:
    """A ball lying at z = 0."""
    return ball(r, (0, 0, r), colour, 3)


def book(r: float, colour: Colour) -> Solid:
    """A flat block."""
    return box((3.2 * r, 2.2 * r, 0.5 * r), (0, 0, 0.25 * r), colour)


def pen(r: float, colour: Colour) -> Solid:
    """A thin rod that lies."""
    return cone((-2 * r, 0, 0.16 * r), (2 * r, 0, 0.16 * r), 0.16 * r, None, colour)


SHAPES: tuple[Callable[[float, Colour], Solid], ...] = (cup, bottle, can, crate, sphere, book, pen)


def scattered(
    rng: np.random.Generator,
    count: int,
    size: float,
    area: tuple[float, float, float, float],
    keep_free: Sequence[tuple[float, float, float]],
) -> list[RigidBody]:
    """Small objects at random places.

    Args:
        rng: Draws kinds, sizes, colours and places.
        count: Largest number of objects.
        size: Half the size of an average object, metres.
        area: x from, x to, y from, y to.
        keep_free: Discs (x, y, radius) to keep free.
    """
    occupied = list(keep_free)
    found: list[RigidBody] = []
    for _ in range(count * 6):
        r = size * float(rng.uniform(0.6, 1.3))
        x, y = float(rng.uniform(*area[:2])), float(rng.uniform(*area[2:]))
        solid = SHAPES[rng.integers(len(SHAPES))](r, pick_colour(rng, bool(rng.random() < 0.6)))
        if len(found) < count and all(np.hypot(x - a, y - b) > c + 1.5 * r for a, b, c in occupied):
            surface = Surface("grain", 3 * r, float(rng.uniform(0.05, 0.25)), random_seed(rng))
            found.append(
                RigidBody("clutter", solid, static_pose(x, y, 0, rng.uniform(0, 6.3)), 0, surface)
            )
            occupied.append((x, y, 1.5 * r))
    return found


def free_corridor(
    start: ArrayLike, end: ArrayLike, width: float
) -> list[tuple[float, float, float]]:
    """Discs (x, y, radius) that keep a straight path free."""
    a, b = np.asarray(start, float)[:2], np.asarray(end, float)[:2]
    steps = max(int(np.linalg.norm(b - a) / (width / 2)), 1)
    points = a + np.linspace(0, 1, steps + 1)[:, None] * (b - a)
    return [(float(x), float(y), width / 2) for x, y in points]


def random_part(rng: np.random.Generator, half: float, colour: Colour) -> tuple[Solid, float]:
    """A part for a gripper, standing at z = 0, and its height, metres; `half` is half its width."""
    style = rng.integers(5)
    height = half * float(rng.uniform(1.4, 2.4))
    if style == 0:
        return box((2 * half, 2 * half, height), (0, 0, height / 2), colour), height
    if style == 1:
        return cone((0, 0, 0), (0, 0, height), half, None, colour), height
    if style == 2:
        low = box((2 * half, 2 * half, height * 0.6), (0, 0, height * 0.3), colour)
        knob = cone((0, 0, height * 0.6), (0, 0, height), half * 0.6, None, colour)
        return join(low, knob), height
    if style == 3:
        height = 1.8 * half
        profile = [
            (0, 0),
            (0.75 * half, 0),
            (half, height),
            (0.85 * half, height),
            (0.7 * half, 0.1 * height),
            (0, 0.1 * height),
        ]
        return lathe(profile, colour, 24), height
    sides = lathe([(0, 0), (half, 0), (half, height), (0, height)], colour, 6)
    return sides, height


def walker_solids(rng: np.random.Generator) -> tuple[Solid, Solid, Solid]:
    """Trunk with head and arms, and two legs that hang from the hip at their origins; metres, x forward."""
    coat, trousers = pick_colour(rng), pick_colour(rng, vivid=False)
    skin: Colour = (0.6, 0.42, 0.32)
    trunk = join(
        cone((0, 0, 0.85), (0, 0, 1.45), 0.19, 0.23, coat),
        cone((0.02, 0.27, 1.42), (0.08, 0.3, 0.85), 0.06, 0.05, coat),
        cone((0.02, -0.27, 1.42), (-0.04, -0.3, 0.85), 0.06, 0.05, coat),
        ball((0.11, 0.1, 0.14), (0.02, 0, 1.66), skin, 2),
    )
    leg = join(
        cone((0, 0, 0), (0, 0, -0.8), 0.1, 0.07, trousers),
        box((0.24, 0.1, 0.08), (0.06, 0, -0.84), (0.1, 0.1, 0.1)),
    )
    return trunk, leg, leg


def walking_person(
    rng: np.random.Generator, positions: Doubles, heading: Doubles, name: str, label: int
) -> list[RigidBody]:
    """A person who walks: trunk and swinging legs.

    Args:
        rng: Draws clothes.
        positions: (F, 2) path, metres.
        heading: (F,) radians.
        name: Name of the person.
        label: Label in masks.
    """
    trunk, left, right = walker_solids(rng)
    steps = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    speed = np.gradient(steps) * FPS
    swing = 0.5 * np.clip(speed / 1.2, 0, 1) * np.sin(2 * np.pi * steps / 1.3)
    ground = np.column_stack([positions, 0.02 * np.abs(np.sin(2 * np.pi * steps / 1.3))])
    side = np.column_stack([-np.sin(heading), np.cos(heading), np.zeros(len(heading))])
    hip = ground + np.array([0, 0, 0.88])
    surface = Surface("grain", 0.3, 0.15, random_seed(rng))
    return [
        RigidBody(name, trunk, make_poses(ground, heading), label, surface),
        RigidBody(name, left, make_poses(hip + 0.1 * side, heading, swing), label, surface),
        RigidBody(name, right, make_poses(hip - 0.1 * side, heading, -swing), label, surface),
    ]


def passer_by(
    rng: np.random.Generator, frames: int, start: Sequence[float], end: Sequence[float], label: int
) -> list[RigidBody]:
    """A person who walks from one point (x, y) to another, without a role in the task."""
    begin, last = sorted(rng.uniform(-0.2, 1.2, 2))
    share = (np.linspace(0, 1, frames) - begin) / max(last - begin, 0.35)
    line = np.array([start, end], float)
    at, heading = path_positions(line, np.clip(share, 0, 1))
    return walking_person(rng, at, np.broadcast_to(heading, len(at)), "bystander", label)
