"""Clips composed at random: things cut out of textures move over a background that a camera moves over.

They hold what footage seldom does and everyone's first clip may: small pictures, smooth discs, clean noise, a
camera at rest, near things that rest beside a moving camera and are no movers, nothing that moves at all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame

Image = NDArray[np.uint8]
Labels = NDArray[np.uint8]
FRAMES = 14
RATE = 25.0
SIZES = ((192, 144), (240, 160), (320, 240), (480, 360))
SEEDS_APART = 1000


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """What is laid over the background.

    Attributes:
        skin: (H, W, 3) uint8, larger than the picture.
        outline: (N, 2) float64, about its middle, pixels.
        start: (2,) where its middle is in the first frame.
        velocity: (2,) pixels a frame, beside that of the camera.
        depth: How far it goes along with the camera's way: 1 as the background, more when it is nearer.
        moves: Whether it is a mover; near things that rest are none.
    """

    skin: Image
    outline: NDArray[np.float64]
    start: NDArray[np.float64]
    velocity: NDArray[np.float64]
    depth: float
    moves: bool


def composed(seed: int) -> Iterator[tuple[Frame, Labels]]:
    """A clip drawn from a seed: frames and masks, 255 where something moves."""
    rng = np.random.default_rng(seed)
    size = SIZES[rng.integers(len(SIZES))]
    ground = _texture(rng, (4 * size[0], 4 * size[1]))
    camera = rng.normal(0, 1, 2) * rng.choice([0, 0, 1, 3, 6])
    sway = rng.normal(0, 1, 2) * rng.choice([0, 0, 1])
    things = [_thing(rng, size, float(np.hypot(*camera))) for _ in range(rng.integers(0, 5))]
    noise = rng.uniform(0, 3)
    for n in range(FRAMES):
        way = camera * n + sway * np.sin(n * 0.9)
        picture = _window(ground, np.asarray(size) * 1.5 + way, size).astype(np.float32)
        labels = np.zeros(size[::-1], np.uint8)
        for thing in things:
            at = thing.start + thing.velocity * n - way * thing.depth
            cover = _cover(thing.outline + at, size)
            skin = _window(thing.skin, np.asarray(size) / 2 - at + thing.start, size)
            picture += cover[..., None] * (skin - picture)
            labels[cover > 0.5] = 255 if thing.moves else 0
        picture += rng.normal(0, noise, picture.shape).astype(np.float32)
        yield Frame(n, n / RATE, np.clip(picture, 0, 255).astype(np.uint8)), labels


def _thing(rng: np.random.Generator, size: tuple[int, int], pan: float) -> Thing:
    moves = bool(rng.random() < 0.7)
    speed = rng.choice([0.3, 1.0, 2.5, 5.0]) * size[0] / 320 if moves else 0.0
    way = rng.uniform(0, 2 * np.pi)
    velocity = speed * np.array([np.cos(way), np.sin(way)])
    # A thing at rest that is as far away as the ground is a picture on it.
    depth = float(rng.uniform(1.1, 1.6)) if not moves and pan > 0 else 1.0
    start = np.asarray(size) * rng.uniform(0.15, 0.85, 2)
    skin = _texture(rng, (3 * size[0], 3 * size[1]))
    return Thing(skin, _outline(rng, size), start, velocity, depth, moves)


def _outline(rng: np.random.Generator, size: tuple[int, int]) -> NDArray[np.float64]:
    """A disc, or a smooth shape of random bulges, (N, 2)."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    bulge = sum(
        rng.normal(0, 0.35 / k) * np.cos(k * angle + rng.uniform(0, 6.3)) for k in range(1, 6)
    )
    radius = size[1] * rng.uniform(0.06, 0.25) * np.exp(bulge * rng.integers(0, 2))
    stretch = np.array([rng.uniform(0.6, 1.6), 1.0])
    disc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.asarray(disc * radius[:, None] * stretch)


def _cover(outline: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.float32]:
    """How much of each pixel an outline covers, (H, W)."""
    out = np.zeros(size[::-1], np.uint8)
    points = np.round(outline * 16).astype(np.int32)
    cv2.fillPoly(out, [points], 255, cv2.LINE_AA, 4)
    return out.astype(np.float32) / np.float32(255)


def _texture(rng: np.random.Generator, size: tuple[int, int]) -> Image:
    """(H, W, 3): clouds of one scale or two about a colour, or nearly nothing."""
    width, height = size
    out = np.zeros((height, width), np.float32)
    for scale in rng.choice([2, 4, 8, 16, 32], 2):
        coarse = rng.normal(0, 1, (height // scale + 2, width // scale + 2)).astype(np.float32)
        out += np.asarray(cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC))
    contrast = rng.choice([2, 12, 30, 45])
    colour = rng.uniform(10, 230, 3)
    tint = colour + contrast * out[..., None] * rng.uniform(0.7, 1.3, 3)
    return np.asarray(np.clip(tint, 0, 255), dtype=np.uint8)


def _window(image: Image, corner: NDArray[np.float64], size: tuple[int, int]) -> Image:
    """A part of a larger image, with its corner between pixels."""
    matrix = np.array([[1, 0, corner[0]], [0, 1, corner[1]]], dtype=np.float64)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    border = cv2.BORDER_REFLECT
    found = cv2.warpAffine(image, matrix, size, flags=flags, borderMode=border)
    return np.asarray(found, dtype=np.uint8)
