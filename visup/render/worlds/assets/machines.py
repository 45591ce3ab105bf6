"""Random machines: vehicles, chargers, drones. x is forward, z up, the ground at z = 0; metres."""

from __future__ import annotations

import numpy as np

from visup.render.meshes.solids import Colour, Solid, ball, box, cone, join
from visup.render.worlds.assets.scenery import pick_colour

BLACK: Colour = (0.07, 0.07, 0.08)
STEEL: Colour = (0.6, 0.6, 0.62)
GLASS: Colour = (0.15, 0.2, 0.26)


def wheels(length: float, width: float, radius: float) -> Solid:
    """Four wheels under a body of a length and width."""
    found = []
    for x in (-0.32 * length, 0.32 * length):
        for side in (-1, 1):
            y = side * width / 2
            found.append(
                cone(
                    (x, y - 0.06 * width, radius),
                    (x, y + 0.06 * width, radius),
                    radius,
                    None,
                    BLACK,
                )
            )
    return join(*found)


def vehicle(rng: np.random.Generator, colour: Colour) -> tuple[Solid, float]:
    """A vehicle and its length; its nose is flat, at half its length."""
    length = float(rng.uniform(0.85, 1.25))
    width, height = length * float(rng.uniform(0.5, 0.65)), length * float(rng.uniform(0.28, 0.42))
    wheel_radius = 0.13 * length
    second = pick_colour(rng, bool(rng.random() < 0.5))
    style = rng.integers(4)
    body = box(
        (length, width, height - wheel_radius * 0.7),
        (0, 0, (height + wheel_radius * 0.7) / 2),
        colour,
    )
    if style == 0:
        extra = [
            box((0.45 * length, 0.8 * width, 0.22), (-0.12 * length, 0, height + 0.11), second),
            cone(
                (-0.35 * length, 0.2 * width, height),
                (-0.35 * length, 0.2 * width, height + 0.45),
                0.02,
                None,
                STEEL,
            ),
            box((0.12, 0.16, 0.1), (0.3 * length, 0, height + 0.05), BLACK),
        ]
    elif style == 1:
        extra = [
            box((0.9 * length, 1.04 * width, 0.05), (0, 0, height * 0.7), BLACK),
            cone((0.25 * length, 0, height), (0.25 * length, 0, height + 0.12), 0.09, None, BLACK),
            box((0.5 * length, 0.9 * width, 0.03), (-0.1 * length, 0, height + 0.015), second),
        ]
    elif style == 2:
        extra = [
            box((0.5 * length, 0.9 * width, 0.28), (-0.08 * length, 0, height + 0.12), GLASS),
            box((0.46 * length, 0.92 * width, 0.04), (-0.08 * length, 0, height + 0.28), colour),
        ]
    else:
        extra = [
            box((0.06, 0.1 * width, 0.7), (0.36 * length, 0.3 * width, height + 0.3), STEEL),
            box((0.06, 0.1 * width, 0.7), (0.36 * length, -0.3 * width, height + 0.3), STEEL),
            box((0.3 * length, 0.7 * width, 0.3), (-0.3 * length, 0, height + 0.15), second),
            cone(
                (-0.3 * length, 0, height + 0.3),
                (-0.3 * length, 0, height + 0.42),
                0.06,
                None,
                (0.9, 0.5, 0.1),
            ),
        ]
    return join(body, wheels(length, width, wheel_radius), *extra), length


def charger(rng: np.random.Generator, colour: Colour) -> tuple[Solid, float]:
    """A charging post, and the distance of its front from its origin, towards +x."""
    depth, width = float(rng.uniform(0.12, 0.22)), float(rng.uniform(0.3, 0.6))
    height = float(rng.uniform(0.7, 1.3))
    second = pick_colour(rng, bool(rng.random() < 0.5))
    foot = box((2 * depth, width * 1.1, 0.05), (0, 0, 0.025), second)
    style = rng.integers(4)
    if style == 0:
        top = box((0.6 * depth, width * 0.5, 0.25), (0, 0, height + 0.1), second)
        return join(
            foot, box((1.4 * depth, width * 0.7, height), (0, 0, height / 2), colour), top
        ), depth
    if style == 1:
        disc = cone((0, 0, height), (0, 0, height + 0.16), width * 0.45, None, second)
        return join(foot, cone((0, 0, 0), (0, 0, height), depth * 0.8, None, colour), disc), depth
    if style == 2:
        panel = box((0.02, width * 0.7, 0.3), (depth * 0.95, 0, height * 0.7), GLASS)
        return join(
            foot, box((1.9 * depth, width, height), (0, 0, height / 2), colour), panel
        ), depth
    low = box((2 * depth, width, 0.35), (0, 0, 0.175), colour)
    pole = cone((-0.5 * depth, 0, 0), (-0.5 * depth, 0, height + 0.4), 0.04, None, STEEL)
    return join(foot, low, pole, ball(0.1, (-0.5 * depth, 0, height + 0.4), second, 2)), depth


def drone(rng: np.random.Generator, colour: Colour, size: float) -> Solid:
    """A craft with four or six rotors, about its middle."""
    arms = int(rng.choice([4, 6]))
    parts = [ball((0.24 * size, 0.2 * size, 0.1 * size), (0, 0, 0), colour, 2)]
    second = pick_colour(rng, bool(rng.random() < 0.5))
    for k in range(arms):
        angle = 2 * np.pi * (k + 0.5) / arms
        x, y = 0.42 * size * np.cos(angle), 0.42 * size * np.sin(angle)
        parts += [
            cone((0, 0, 0), (x, y, 0.03 * size), 0.035 * size, None, second),
            cone((x, y, 0.03 * size), (x, y, 0.09 * size), 0.05 * size, None, BLACK),
            cone((x, y, 0.09 * size), (x, y, 0.1 * size), 0.19 * size, None, colour),
        ]
    parts.append(box((0.12 * size, 0.1 * size, 0.1 * size), (0.12 * size, 0, -0.12 * size), BLACK))
    return join(*parts)
