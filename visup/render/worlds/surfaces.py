"""Procedural textures of reflectance.

Each takes points in the body's own frame, in units of the pattern's size, and returns a value from -1 to 1
that mixes the body's two colours.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from visup.render.imaging.texture import pattern
from visup.render.worlds.world import Floats, Surface

Points = NDArray[np.floating]


def textured_albedo(points: Points, albedo: Floats, surface: Surface) -> Floats:
    """Reflectance at points of a body.

    Args:
        points: (N, 3) metres, in the body's frame.
        albedo: (N, 3) reflectance of their faces, red, green, blue.
        surface: The pattern.

    Returns:
        (N, 3) float32.
    """
    if surface.pattern == "plain" or surface.contrast == 0:
        return albedo
    coords = np.asarray(points, np.float32) / np.float32(surface.size)
    amount = PATTERNS[surface.pattern](coords, surface.seed)[:, None]
    if surface.second is None:
        return np.asarray(albedo * (1 + np.float32(surface.contrast) * amount), np.float32)
    share = np.float32(surface.contrast) * (0.5 + 0.5 * amount)
    return np.asarray(albedo * (1 - share) + share * np.asarray(surface.second, np.float32))


def _grain(coords: Points, seed: int) -> Floats:
    return pattern(coords, seed)


def _wood(coords: Points, seed: int) -> Floats:
    """Fibres along x, in boards of unequal tone."""
    fibres = pattern(coords * np.array([0.25, 3.0, 3.0], np.float32), seed)
    board = np.floor(coords[:, 1] * 0.5)
    return np.asarray(0.7 * fibres + 0.5 * _hashed(board, np.zeros_like(board), seed), np.float32)


def _tiles(coords: Points, seed: int) -> Floats:
    """Squares of unequal tone with dark joints, on all sides of a body."""
    cell, joint = _cells(coords, 0.03)
    tone = _hashed(cell[:, 0] + 31 * cell[:, 2], cell[:, 1], seed)
    return np.asarray(np.where(joint, -1, 0.3 * tone + 0.15 * pattern(coords, seed)), np.float32)


def _checker(coords: Points, seed: int) -> Floats:
    cell, _ = _cells(coords, 0.0)
    odd = cell[:, :2].sum(axis=1) % 2
    return np.asarray(np.where(odd == 1, 0.8, -0.8) + 0.2 * pattern(coords, seed), np.float32)


def _bricks(coords: Points, seed: int) -> Floats:
    """Courses along z; every other one is shifted by half a brick."""
    course = np.floor(coords[:, 2] * 3)
    along = coords[:, 0] + coords[:, 1] + 0.5 * (course % 2)
    joint = (along % 1 < 0.06) | ((coords[:, 2] * 3) % 1 < 0.14)
    tone = 0.5 * _hashed(np.floor(along), course, seed)
    return np.asarray(np.where(joint, 1, tone - 0.3), np.float32)


def _stripes(coords: Points, seed: int) -> Floats:
    bands = np.sign(np.sin(2 * np.pi * (coords[:, 0] + coords[:, 2])))
    return np.asarray(0.9 * bands + 0.1 * pattern(coords, seed), np.float32)


def _speckles(coords: Points, seed: int) -> Floats:
    """Grass, gravel, asphalt: fine grain over broad blotches."""
    return np.asarray(0.4 * pattern(coords, seed) + 0.6 * pattern(coords * 9, seed + 1), np.float32)


def _marble(coords: Points, seed: int) -> Floats:
    veins = np.sin(4 * (coords[:, 0] + coords[:, 1]) + 4 * pattern(coords * 0.7, seed))
    return np.asarray(veins**3, np.float32)


def _cells(coords: Points, joint: float) -> tuple[Points, NDArray[np.bool_]]:
    # Shifted off the faces of boxes, which would alternate between two cells.
    shifted = coords + np.float32(0.013)
    cell = np.floor(shifted)
    part = shifted - cell
    near = (part < joint) | (part > 1 - joint)
    return cell, near[:, :2].any(axis=1)


def _hashed(a: Points, b: Points, seed: int) -> Floats:
    """A number from -1 to 1 for each pair of whole numbers."""
    mix = np.sin(a * 12.9898 + b * 78.233 + (seed % 997) * 0.731) * 43758.5453
    return np.asarray(2 * (mix - np.floor(mix)) - 1, np.float32)


PATTERNS: dict[str, Callable[[Points, int], Floats]] = {
    "grain": _grain,
    "wood": _wood,
    "tiles": _tiles,
    "checker": _checker,
    "bricks": _bricks,
    "stripes": _stripes,
    "speckles": _speckles,
    "marble": _marble,
}
