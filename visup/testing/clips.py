"""Short synthetic clips whose truth is known: a disc that moves, two that cross, and hard cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame, Region

Size = tuple[int, int]
SIZE: Size = (160, 120)
FPS = 25.0


@dataclass(frozen=True, slots=True, eq=False)
class LabelledFrame:
    """A frame with what is true of it.

    Attributes:
        frame: The frame.
        regions: What moves in it, with ids that stay.
    """

    frame: Frame
    regions: tuple[Region, ...] = ()


def region_of(
    mask: NDArray[np.bool_],
    region_id: int = 1,
    velocity: tuple[float, float] = (0.0, 0.0),
    *,
    at: tuple[int, int] = (0, 0),
    size: Size | None = None,
) -> Region:
    """A region from its mask; its contour is that of the largest part.

    Args:
        mask: (height, width) bool with at least one pixel.
        region_id: Its number.
        velocity: (x, y) pixels per second.
        at: (x, y) of the mask's corner in the image, pixels.
        size: (width, height) of the image; the mask is the whole image when left out.
    """
    x, y, w, h = cv2.boundingRect(mask.astype(np.uint8))
    crop = np.ascontiguousarray(mask[y : y + h, x : x + w])
    outlines, _ = cv2.findContours(crop.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    ys, xs = np.nonzero(crop)
    width, height = size or (mask.shape[1], mask.shape[0])
    x, y = x + at[0], y + at[1]
    return Region(
        id=region_id,
        bbox=(x, y, w, h),
        mask=crop,
        contour=max(outlines, key=len).reshape(-1, 2).astype(np.float32)
        + np.array([x, y], np.float32),
        centroid=(float(xs.mean()) + x, float(ys.mean()) + y),
        area=float(len(xs)),
        velocity=velocity,
        cut=x == 0 or y == 0 or x + w == width or y + h == height,
    )


def disc(
    frames: int = 20, size: Size = SIZE, fps: float = FPS, seed: int = 0
) -> list[LabelledFrame]:
    """A bright disc that goes from left to right over a textured ground."""
    radius, speed = size[1] / 6, size[0] / 2 / max(frames, 1)
    paths = [lambda n: (size[0] / 4 + speed * n, size[1] / 2)]
    return _discs(paths, radius, frames, size, fps, seed)


def crossing(
    frames: int = 20, size: Size = SIZE, fps: float = FPS, seed: int = 0
) -> list[LabelledFrame]:
    """Two discs that meet; the second one hides the first."""
    radius, speed = size[1] / 6, size[0] / 2 / max(frames, 1)
    paths = [
        lambda n: (size[0] / 4 + speed * n, size[1] / 2),
        lambda n: (3 * size[0] / 4 - speed * n, size[1] / 2 + radius / 3),
    ]
    return _discs(paths, radius, frames, size, fps, seed)


def flat(level: int, frames: int = 5, size: Size = SIZE, fps: float = FPS) -> list[LabelledFrame]:
    """Nothing but one grey level: 0 is a black image, 255 a white one."""
    image = np.full((size[1], size[0], 3), level, np.uint8)
    return [LabelledFrame(Frame(n, n / fps, image.copy())) for n in range(frames)]


def noise(
    frames: int = 5, size: Size = SIZE, fps: float = FPS, seed: int = 0
) -> list[LabelledFrame]:
    """Nothing but noise."""
    rng = np.random.default_rng(seed)
    images = rng.integers(0, 256, (frames, size[1], size[0], 3), dtype=np.uint8)
    return [LabelledFrame(Frame(n, n / fps, image)) for n, image in enumerate(images)]


CLIPS: Mapping[str, Callable[[], list[LabelledFrame]]] = MappingProxyType(
    {
        "a disc that moves": disc,
        "two discs that cross": crossing,
        "noise": noise,
        "black": partial(flat, 0),
        "white": partial(flat, 255),
        "a single frame": partial(disc, 1),
        "an odd size (33 x 17)": partial(disc, 6, (33, 17)),
        "a tall image (24 x 200)": partial(crossing, 6, (24, 200)),
    }
)
"""What every behaviour should get through, by what it is."""


def _discs(
    paths: Sequence[Callable[[int], tuple[float, float]]],
    radius: float,
    frames: int,
    size: Size,
    fps: float,
    seed: int,
) -> list[LabelledFrame]:
    """Discs over a ground; later ones are in front."""
    rng = np.random.default_rng(seed)
    ground = cv2.GaussianBlur(
        rng.uniform(20, 120, (size[1], size[0])).astype(np.float32), (5, 5), 2
    )
    ys, xs = np.mgrid[: size[1], : size[0]]
    labelled_frames = []
    for n in range(frames):
        image = np.array(ground, dtype=np.float64)
        masks: list[NDArray[np.bool_]] = []
        for number, path in enumerate(paths):
            x, y = path(n)
            mask = np.hypot(xs - x, ys - y) <= radius
            image[mask] = 200 + 40 * number + 10 * np.sin(xs[mask] - x)
            masks = [m & ~mask for m in masks] + [mask]
        image += rng.normal(0, 1.0, image.shape)
        grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
        labelled_frames.append(
            LabelledFrame(
                Frame(n, n / fps, np.repeat(grey[..., None], 3, axis=2)),
                tuple(
                    region_of(mask, i + 1, _velocity(path, n, fps))
                    for i, (mask, path) in enumerate(zip(masks, paths, strict=True))
                    if mask.any()
                ),
            )
        )
    return labelled_frames


def _velocity(
    path: Callable[[int], tuple[float, float]], n: int, fps: float
) -> tuple[float, float]:
    (x0, y0), (x1, y1) = path(n - 1), path(n)
    return (x1 - x0) * fps, (y1 - y0) * fps
