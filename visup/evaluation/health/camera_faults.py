"""Injects random camera faults of many kinds and strengths into good frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame, HealthStatus

Image = NDArray[np.uint8]
Random = np.random.Generator
Injection = Callable[[Sequence[Frame], Random], list[Frame]]

EXPECTED_STATUS = {
    "black": HealthStatus.DARK,
    "white": HealthStatus.SATURATED,
    "frozen": HealthStatus.FROZEN,
    "blocked": HealthStatus.BLOCKED,
    "noise": HealthStatus.NOISY,
    "scrambled": HealthStatus.SCRAMBLED,
    "dropped": HealthStatus.DROPPED,
}
"""Kind of fault -> expected status."""


def inject(frames: Sequence[Frame], start: int, kind: str, seed: int) -> list[Frame]:
    """Inject a fault into a clip.

    Strength, colour, position etc. are drawn at random.

    Args:
        frames: A good clip.
        start: Index in `frames` of the first frame with the fault.
        kind: A key of `EXPECTED_STATUS`.
        seed: Random seed.

    Returns:
        The clip with the fault from `start` to its end; fewer frames when some were dropped.
    """
    rng = np.random.default_rng([seed, sorted(EXPECTED_STATUS).index(kind)])
    return [*frames[:start], *_INJECTIONS[kind](frames[start:], rng)]


def _map_images(
    change: Callable[[Image], NDArray[np.generic]], frames: Sequence[Frame]
) -> list[Frame]:
    return [Frame(f.index, f.time, _to_uint8(change(f.image))) for f in frames]


def _to_uint8(values: NDArray[np.generic]) -> Image:
    return np.asarray(np.clip(np.rint(values), 0, 255), dtype=np.uint8)


def _uniform(frames: Sequence[Frame], rng: Random, level: float) -> list[Frame]:
    """A uniform image, half of the time with sensor noise."""
    sigma = rng.uniform(0.5, 6.0) if rng.random() < 0.5 else 0.0
    return _map_images(lambda image: level + _sensor_noise(image.shape, sigma, rng), frames)


def _sensor_noise(shape: tuple[int, ...], sigma: float, rng: Random) -> NDArray[np.float64]:
    # Drawing numbers takes longer than all the rest; without noise none are needed afterwards either.
    return rng.normal(0.0, sigma, shape) if sigma else np.zeros(shape)


def black(frames: Sequence[Frame], rng: Random) -> list[Frame]:
    """Black or almost black, with or without noise."""
    return _uniform(frames, rng, float(rng.choice([0.0, rng.uniform(0, 12)])))


def white(frames: Sequence[Frame], rng: Random) -> list[Frame]:
    """White or almost white, with or without noise."""
    return _uniform(frames, rng, float(rng.choice([255.0, rng.uniform(238, 255)])))


def frozen(frames: Sequence[Frame], rng: Random) -> list[Frame]:
    """The same image repeated, sometimes with noise added afterwards."""
    image_ = frames[0].image.astype(np.float32)
    sigma = rng.uniform(0.2, 0.8) if rng.random() < 0.3 else 0.0
    return _map_images(lambda image: image_ + _sensor_noise(image_.shape, sigma, rng), frames)


def noise(frames: Sequence[Frame], rng: Random) -> list[Frame]:
    """Gaussian noise or salt and pepper, coloured or grey."""
    sigma, density = rng.uniform(25.0, 80.0), rng.uniform(0.05, 0.4)
    salt_and_pepper, grey = rng.random() < 0.4, rng.random() < 0.5

    def change(image: Image) -> NDArray[np.generic]:
        shape = (*image.shape[:2], 1) if grey else image.shape
        if not salt_and_pepper:
            return image + rng.normal(0.0, sigma, shape)
        replaced = rng.random((*image.shape[:2], 1)) < density
        return np.where(replaced, 255.0 * (rng.random(shape) < 0.5), image)

    return _map_images(change, frames)


def blocked(frames: Sequence[Frame], rng: Random) -> list[Frame]:
    """Half of the view covered by a flat, noisy or textured surface."""
    height, width = frames[0].image.shape[:2]
    covered = _half_mask(height, width, rng)[..., None]
    cover = _cover_image(height, width, rng)
    sigma = rng.uniform(0.5, 2.0) if rng.random() < 0.3 else 0.0

    def change(image: Image) -> NDArray[np.generic]:
        return np.where(covered, cover + _sensor_noise(image.shape, sigma, rng), image)

    return _map_images(change, frames)


def _half_mask(height: int, width: int, rng: Random) -> NDArray[np.bool_]:
    """Left, right, top, bottom or a slanting half; about half of the area."""
    y, x = np.mgrid[:height, :width]
    across, down = (x + 0.5) / width - 0.5, (y + 0.5) / height - 0.5
    angle = rng.integers(4) * np.pi / 2
    if rng.random() < 0.4:
        angle += rng.uniform(0.3, 1.2)
    side = across * np.cos(angle) + down * np.sin(angle)
    return np.asarray(side < rng.uniform(-0.03, 0.1), dtype=bool)


def _cover_image(height: int, width: int, rng: Random) -> NDArray[np.float32]:
    """(H, W, 3): black, grey, coloured, or textured as a cloth or a cap."""
    variant = rng.integers(4)
    if variant == 0:
        return np.zeros((height, width, 3), np.float32)
    if variant == 1:
        return np.full((height, width, 3), rng.uniform(30, 220), np.float32)
    colour = rng.uniform(10, 240, 3).astype(np.float32)
    flat = np.broadcast_to(colour, (height, width, 3)).astype(np.float32)
    if variant == 2:
        return flat
    grain = rng.normal(0.0, 1.0, (height, width)).astype(np.float32)
    texture = cv2.GaussianBlur(grain, (0, 0), float(rng.uniform(1.0, 6.0)))
    strength = rng.uniform(5.0, 25.0) / max(float(texture.std()), 1e-6)
    return flat * 0.5 + np.asarray(texture * strength, np.float32)[..., None]


def scrambled(frames: Sequence[Frame], rng: Random) -> list[Frame]:
    """All or half of the blocks exchanged or shifted, differently in each frame or always the same."""
    size = int(rng.integers(8, 65))
    share = float(rng.choice([0.5, 1.0]))
    shifted, redrawn = rng.random() < 0.4, rng.random() < 0.5
    offset = rng.integers(0, size, 2)
    fixed = int(rng.integers(2**31))

    def change(image: Image) -> NDArray[np.generic]:
        draw = rng if redrawn else np.random.default_rng(fixed)
        y0, x0 = offset
        out = image.copy()
        rows = np.arange(y0, image.shape[0] - size + 1, size)
        columns = np.arange(x0, image.shape[1] - size + 1, size)
        blocks = [(int(y), int(x)) for y in rows for x in columns]
        chosen = draw.permutation(len(blocks))[: max(2, round(share * len(blocks)))]
        sources = np.roll(chosen, 1)
        for to, source in zip(chosen, sources, strict=True):
            y, x = blocks[to]
            v, u = blocks[source]
            if shifted:
                v = int(
                    np.clip(y + draw.integers(-2 * size, 2 * size + 1), 0, image.shape[0] - size)
                )
                u = int(
                    np.clip(x + draw.integers(-2 * size, 2 * size + 1), 0, image.shape[1] - size)
                )
            out[y : y + size, x : x + size] = image[v : v + size, u : u + size]
        return out

    return _map_images(change, frames)


def dropped(frames: Sequence[Frame], rng: Random) -> list[Frame]:
    """Missing frames: a gap, many gaps, or repeated frames in their place."""
    seconds = frames[1].time - frames[0].time
    variant = rng.integers(3)
    if variant == 0:
        missing = max(3, round(rng.uniform(0.2, 0.6) / seconds))
        return list(frames[missing:])
    keep = rng.random(len(frames)) > rng.uniform(0.4, 0.7)
    if variant == 1:
        return [f for f, keep_frame in zip(frames, keep, strict=True) if keep_frame]
    frames_out, last = [], frames[0]
    for frame, keep_frame in zip(frames, keep, strict=True):
        last = frame if keep_frame else last
        frames_out.append(Frame(frame.index, frame.time, last.image))
    return frames_out


_INJECTIONS: dict[str, Injection] = {
    "black": black,
    "white": white,
    "frozen": frozen,
    "blocked": blocked,
    "noise": noise,
    "scrambled": scrambled,
    "dropped": dropped,
}
