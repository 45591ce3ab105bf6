"""Synthetic clips with known truth, made from seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Path = Callable[[int], tuple[float, float]]
FPS = 25.0
SIZE = (160, 240)


@dataclass(frozen=True)
class Shot:
    frame: Frame
    masks: tuple[Mask, ...]


def texture(seed: int, shape: tuple[int, int], low: int = 40, high: int = 200) -> Image:
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(0, 1, shape).astype(np.float32)
    smooth = cv2.GaussianBlur(coarse, (0, 0), 2.0)
    smooth = (smooth - smooth.min()) / (smooth.max() - smooth.min())
    return np.asarray(low + smooth * (high - low), dtype=np.float32).astype(np.uint8)


def window(image: Image, x: float, y: float, shape: tuple[int, int]) -> Image:
    matrix = np.array([[1, 0, x], [0, 1, y]], dtype=np.float64)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, matrix, shape[::-1], flags=flags), dtype=np.uint8)


def clip(
    background: Image,
    camera: Path,
    discs: list[tuple[Path, float, Image]],
    frames: int,
    noise: float = 1.0,
    colour: bool = False,
) -> Iterator[Shot]:
    """Discs (later ones in front) over a background seen through a moving window, four times
    oversampled at the edge, with noise."""
    rng = np.random.default_rng(7)
    ys, xs = np.mgrid[: SIZE[0], : SIZE[1]]
    for n in range(frames):
        image = window(background, *camera(n), SIZE).astype(np.float32)
        masks: list[Mask] = []
        for path, radius, skin in discs:
            x, y = path(n)
            cover = np.clip(radius + 0.5 - np.hypot(xs - x, ys - y), 0, 1)
            own = window(skin, skin.shape[1] / 2 - x, skin.shape[0] / 2 - y, SIZE)
            image = image * (1 - cover) + own * cover
            mask = cover > 0.5
            masks = [m & ~mask for m in masks] + [mask]
        image += rng.normal(0, noise, SIZE)
        grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
        bgr = np.repeat(grey[..., None], 3, axis=2)
        if colour:
            bgr[..., 0] = 255 - bgr[..., 0]
        yield Shot(Frame(n, n / FPS, bgr), tuple(masks))
