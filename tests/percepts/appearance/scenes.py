"""Small synthetic scenes of things on a table, with truth."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.taught.taught_view import TaughtView, taught_view_from_mask

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
WIDTH, HEIGHT = 240, 180
COLOURS = {
    "part": (40, 60, 200),
    "twin": (40, 60, 200),
    "tray": (70, 160, 60),
    "tool": (190, 90, 40),
}
SIZES = {"part": (30, 24), "twin": (30, 24), "tray": (64, 40), "tool": (26, 60)}


def table(seed: int = 1) -> Image:
    """A table with some texture."""
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(90, 170, (HEIGHT // 6, WIDTH // 6, 1)) + rng.uniform(-6, 6, (1, 1, 3))
    return np.asarray(cv2.resize(coarse, (WIDTH, HEIGHT)), dtype=np.uint8)


def thing(name: str) -> Image:
    """The pixels of a thing: its colour, with stripes and blots of its own."""
    w, h = SIZES[name]
    rng = np.random.default_rng(len(name))
    image = np.full((h, w, 3), COLOURS[name], dtype=np.float32)
    image += cv2.resize(rng.uniform(-45, 45, (h // 6, w // 6, 1)), (w, h))[..., None]
    image[:: h // 2 + 1] = 230
    return np.clip(image, 0, 255).astype(np.uint8)


def picture(
    places: Mapping[str, tuple[int, int]], noise: float = 1.5, seed: int = 0
) -> tuple[Image, dict[str, Mask]]:
    """A picture of things at places (their top left corners), the last in front; and their masks."""
    image = table().astype(np.float32)
    masks: dict[str, Mask] = {}
    for name, (x, y) in places.items():
        part = thing(name)
        x0, y0 = max(x, 0), max(y, 0)
        x1, y1 = min(x + part.shape[1], WIDTH), min(y + part.shape[0], HEIGHT)
        image[y0:y1, x0:x1] = part[y0 - y : y1 - y, x0 - x : x1 - x]
        here = np.zeros((HEIGHT, WIDTH), dtype=bool)
        here[y0:y1, x0:x1] = True
        masks = {n: m & ~here for n, m in masks.items()} | {name: here}
    image += np.random.default_rng(seed).normal(0, noise, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8), masks


def shown(places: Mapping[str, tuple[int, int]], *names: str) -> tuple[TaughtView, ...]:
    """Views of some of the things of a picture."""
    image, masks = picture(places, seed=99)
    return tuple(taught_view_from_mask(n, image, masks[n]) for n in names)
