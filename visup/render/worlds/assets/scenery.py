"""Surroundings: rooms, tables, halls, meadows, with light and sky."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, box
from visup.render.worlds.motion import static_pose
from visup.render.worlds.world import CameraSensor, Daylight, RigidBody, Sky, Surface


def pick_colour(rng: np.random.Generator, vivid: bool = True) -> Colour:
    """A random reflectance, of a painted object or of a wall."""
    hue = rng.uniform(0, 6)
    wheel = np.clip(np.abs((hue + np.array([0, 4, 2])) % 6 - 3) - 1, 0, 1)
    saturation = rng.uniform(0.55, 0.95) if vivid else rng.uniform(0.0, 0.25)
    value = rng.uniform(0.35, 0.85) if vivid else rng.uniform(0.35, 0.75)
    r, g, b = value * (1 - saturation * (1 - wheel))
    return float(r), float(g), float(b)


def distinct_colour(
    rng: np.random.Generator, others: Sequence[Colour], min_distance: float = 0.35
) -> Colour:
    """A vivid colour that clearly differs from given ones."""
    for _ in range(50):
        colour = pick_colour(rng)
        if all(np.linalg.norm(np.subtract(colour, o)) > min_distance for o in others):
            break
    return colour


def random_seed(rng: np.random.Generator) -> int:
    """A seed for a pattern."""
    return int(rng.integers(1 << 30))


def random_light(rng: np.random.Generator, towards: NDArray[np.float64]) -> Daylight:
    """A sun on the viewer's side of the scene.

    Args:
        rng: Draws height, side, colours, strength and softness.
        towards: (3,) from the scene to the camera.
    """
    heading = np.arctan2(towards[1], towards[0]) + rng.uniform(-1.7, 1.7)
    elevation = np.radians(rng.uniform(32, 78))
    sun = np.array(
        [
            np.cos(heading) * np.cos(elevation),
            np.sin(heading) * np.cos(elevation),
            np.sin(elevation),
        ]
    )
    warmth = rng.uniform(-0.12, 0.15)
    strength, ambient_strength = rng.uniform(0.45, 1.0), rng.uniform(0.24, 0.5)
    sun_colour = strength * np.array([1 + warmth, 1.0, 1 - warmth])
    ambient = ambient_strength * np.array([1 - 0.5 * warmth, 1.0, 1 + 0.5 * warmth])
    return Daylight(
        (float(sun[0]), float(sun[1]), float(sun[2])),
        (float(sun_colour[0]), float(sun_colour[1]), float(sun_colour[2])),
        (float(ambient[0]), float(ambient[1]), float(ambient[2])),
        float(rng.choice([0.6, 1.2, 2.5])),
    )


def random_sky(rng: np.random.Generator) -> Sky:
    """A blue, cloudy or grey sky."""
    grey = rng.uniform(0, 0.8)
    zenith = (1 - grey) * np.array([0.2, 0.38, 0.72]) + grey * np.array([0.55, 0.58, 0.62])
    return Sky(
        (float(zenith[0]), float(zenith[1]), float(zenith[2])),
        clouds=float(rng.uniform(0, 0.9)),
        seed=random_seed(rng),
    )


def random_sensor(rng: np.random.Generator, light: Daylight) -> CameraSensor:
    """A camera whose exposure roughly suits the light."""
    brightness = float(np.mean(light.sun_colour)) * light.sun[2] + float(np.mean(light.ambient))
    return CameraSensor(
        float(rng.uniform(0.75, 1.05) / brightness),
        float(rng.uniform(0.5, 4.5)),
        float(rng.uniform(0.3, 0.9)),
        int(rng.integers(55, 96)),
    )


FLOORS = ("speckles", "grain", "tiles", "wood", "checker", "marble")
WALLS = ("grain", "bricks", "tiles", "plain", "stripes")


def box_body(
    name: str, size: Sequence[float], at: Sequence[float], colour: Colour, surface: Surface
) -> RigidBody:
    """A box of (x, y, z) extents; the origin of its frame and of its pattern is its centre."""
    return RigidBody(name, box(size, (0, 0, 0), colour), static_pose(*at), 0, surface)


def floor(
    rng: np.random.Generator, level: float, side: float, patterns: Sequence[str]
) -> RigidBody:
    """A floor with a random pattern, its upper face at a height."""
    pattern = str(rng.choice(list(patterns)))
    colour = pick_colour(rng, vivid=False)
    size = rng.uniform(0.3, 1.2) if pattern != "wood" else rng.uniform(0.15, 0.4)
    surface = Surface(pattern, float(size), float(rng.uniform(0.1, 0.3)), random_seed(rng))
    return box_body("floor", (side, side, 0.1), (0, 0, level - 0.05), colour, surface)


def wall(rng: np.random.Generator, level: float, distance: float, side: float) -> RigidBody:
    """A wall perpendicular to y at a distance, from a height upwards."""
    pattern = str(rng.choice(WALLS))
    surface = Surface(
        pattern, float(rng.uniform(0.3, 0.9)), float(rng.uniform(0.05, 0.25)), random_seed(rng)
    )
    colour = pick_colour(rng, vivid=False)
    return box_body(
        "wall", (side, 0.1, side), (0, distance + 0.05, level + side / 2), colour, surface
    )


TABLES: tuple[tuple[Colour, str, float, float], ...] = (
    ((0.55, 0.38, 0.2), "wood", 0.12, 0.35),
    ((0.7, 0.55, 0.36), "wood", 0.1, 0.25),
    ((0.3, 0.2, 0.13), "wood", 0.1, 0.3),
    ((0.75, 0.75, 0.73), "grain", 0.3, 0.08),
    ((0.25, 0.27, 0.3), "speckles", 0.2, 0.2),
    ((0.5, 0.52, 0.52), "marble", 0.35, 0.15),
    ((0.35, 0.45, 0.38), "grain", 0.2, 0.12),
    ((0.62, 0.6, 0.55), "tiles", 0.12, 0.2),
)
"""Colour, pattern, size of its features in metres and contrast of table tops."""


def tabletop(rng: np.random.Generator, width: float, depth: float) -> tuple[RigidBody, ...]:
    """A table with its upper face at z = 0, on a floor, in front of a wall.

    Args:
        rng: Draws materials and the position of the wall.
        width: Metres along x.
        depth: Metres along y.
    """
    colour, pattern, size, contrast = TABLES[rng.integers(len(TABLES))]
    tint = np.clip(np.asarray(colour) * rng.uniform(0.85, 1.15, 3), 0, 1)
    surface = Surface(pattern, size * float(rng.uniform(0.8, 1.4)), contrast, random_seed(rng))
    shade = (float(tint[0]), float(tint[1]), float(tint[2]))
    top = box_body("table", (width, depth, 0.05), (0, 0, -0.025), shade, surface)
    back = wall(rng, -0.75, depth / 2 + float(rng.uniform(0.05, 0.8)), 8.0)
    return top, floor(rng, -0.75, 12.0, FLOORS), back


def hall(rng: np.random.Generator, depth: float) -> tuple[RigidBody, ...]:
    """An indoor floor at z = 0 with a wall behind and boxes along it, metres."""
    bodies = [floor(rng, 0.0, 60.0, FLOORS), wall(rng, 0.0, depth, 40.0)]
    x = -depth * 1.2
    while x < depth * 1.2:
        size = rng.uniform(0.6, 1.6, 3) * [1, 0.7, 1]
        if rng.random() < 0.65:
            solid: Solid = box(
                size, (0, 0, size[2] / 2), pick_colour(rng, bool(rng.random() < 0.6))
            )
            surface = Surface("grain", 0.4, 0.2, random_seed(rng))
            at = static_pose(
                x, depth - size[1] / 2 - rng.uniform(0.05, 0.4), 0, rng.uniform(-0.15, 0.15)
            )
            bodies.append(RigidBody("stock", solid, at, 0, surface))
        x += size[0] + rng.uniform(0.1, 1.2)
    return tuple(bodies)


def meadow(rng: np.random.Generator) -> tuple[RigidBody, ...]:
    """Open ground at z = 0: grass, gravel, sand or asphalt."""
    grounds: tuple[Colour, ...] = (
        (0.25, 0.42, 0.15),
        (0.4, 0.45, 0.22),
        (0.5, 0.42, 0.32),
        (0.6, 0.55, 0.42),
        (0.3, 0.3, 0.32),
    )
    surface = Surface(
        "speckles", float(rng.uniform(0.6, 2.5)), float(rng.uniform(0.25, 0.5)), random_seed(rng)
    )
    ground = box_body("ground", (400, 400, 0.1), (0, 0, -0.05), grounds[rng.integers(5)], surface)
    if rng.random() < 0.5:
        return (ground,)
    path = Surface("speckles", 0.5, 0.2, random_seed(rng))
    strip = box_body(
        "path",
        (400, float(rng.uniform(1, 3)), 0.02),
        (0, float(rng.uniform(-6, -3)), 0.0),
        (0.5, 0.47, 0.42),
        path,
    )
    return ground, strip
