"""`visup eval crowds`: the cost of a frame with one to forty moving objects.

Textured discs move over a textured background under a panning camera. The scene depends only on the seed;
times are processor time, which depends less on the load of the machine.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.evaluation.figures import Progress, silent
from visup.percepts.motion.segmenter import MotionSegmenter

MOVER_COUNTS = (1, 5, 10, 20, 40)
SIZE = (480, 854)  # height, width
FPS = 25.0
WARM_UP_FRAMES = 10  # initial frames, in which movers are detected
MAX_GROWTH = 1.5  # the bar: time of a frame with any number of movers relative to one
RADIUS = (16.0, 40.0)
SPEED = 4.0  # standard deviation of a mover's velocity along x and y, pixels per frame
PAN = (2.0, 0.6)  # of the camera, pixels per frame

Image = NDArray[np.uint8]
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Mover:
    """A textured disc: (2,) initial position, (2,) velocity in pixels per frame; radius."""

    position: Floats
    velocity: Floats
    radius: float
    texture: Image


def evaluate_crowds(
    frames: int = 200, seed: int = 0, *, progress: Progress = silent
) -> dict[str, Any]:
    """The time of a frame by the number of moving objects.

    Args:
        frames: Frames for each number of movers, including `WARM_UP_FRAMES` unmeasured ones.
        seed: Random seed.
        progress: Shows what is being done.

    Returns:
        `items` by number of movers: `ms`, median processor time of a frame; `ratio` to that of DIS FAST;
        `regions`, mean number of reported regions; `growth`, `ms` relative to one mover.
        `total`: the greatest `growth` and `ratio`, and the `bar` of the former.
    """
    items: dict[str, dict[str, Any]] = {}
    for number in MOVER_COUNTS:
        progress(f"{number} movers")
        items[str(number)] = _frame_costs(crowd(number, frames, seed))
    first = items[str(MOVER_COUNTS[0])]["ms"]
    for item in items.values():
        item["growth"] = item["ms"] / first
    worst = {key: max(item[key] for item in items.values()) for key in ("growth", "ratio")}
    return {"total": {**worst, "bar": MAX_GROWTH}, "items": items}


def crowd(movers: int, frames: int, seed: int) -> Iterator[Frame]:
    """Frames with a number of moving discs, later ones in front, (480, 854, 3)."""
    rng = np.random.default_rng((seed, movers))
    height, width = SIZE
    background = _texture(rng, (height + 80, width + 80))
    discs = [_mover(rng) for _ in range(movers)]
    for n in range(frames):
        image = _window(background, _reflected(np.array(PAN) * n, np.array([80.0, 80.0])), SIZE)
        for disc in discs:
            _draw(image, disc, n)
        noisy = image + rng.normal(0, 1.5, image.shape)
        yield Frame(n, n / FPS, np.clip(np.rint(noisy), 0, 255).astype(np.uint8))


def _frame_costs(frames: Iterator[Frame]) -> dict[str, Any]:
    """The cost of frames, and the number of reported regions."""
    segmenter = MotionSegmenter()
    optical_flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    ms: list[float] = []
    flow_ms: list[float] = []
    regions: list[int] = []
    previous: Image | None = None
    for frame in frames:
        start = time.process_time()
        reported = segmenter.step(frame)
        ms.append(1e3 * (time.process_time() - start))
        grey = np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        if previous is not None:
            start = time.process_time()
            optical_flow.calc(previous, grey, None)  # type: ignore[call-overload]
            flow_ms.append(1e3 * (time.process_time() - start))
        previous = grey
        regions.append(len(reported))
    cost = median(_after_warm_up(ms))
    mean_regions = sum(_after_warm_up(regions)) / len(_after_warm_up(regions))
    return {"ms": cost, "ratio": cost / median(_after_warm_up(flow_ms)), "regions": mean_regions}


def _after_warm_up(values: Sequence[float]) -> Sequence[float]:
    return values[WARM_UP_FRAMES:] or values


def _mover(rng: np.random.Generator) -> Mover:
    position = rng.uniform((0, 0), SIZE[::-1])
    radius = float(rng.uniform(*RADIUS))
    side = int(2 * radius) + 4
    return Mover(position, rng.normal(0, SPEED, 2), radius, _texture(rng, (side, side)))


def _texture(rng: np.random.Generator, shape: tuple[int, int]) -> Image:
    """Smooth noise of random contrast in random colours, (h, w, 3)."""
    noise = rng.uniform(-1, 1, (*shape, 3)).astype(np.float32)
    smooth = np.asarray(cv2.GaussianBlur(noise, (0, 0), 2.0), dtype=np.float32)
    strength = float(rng.uniform(30, 70)) / max(float(smooth.std()), 1e-6)
    return np.asarray(np.clip(rng.uniform(60, 195, 3) + strength * smooth, 0, 255), dtype=np.uint8)


def _window(image: Image, position: Floats, shape: tuple[int, int]) -> NDArray[np.float32]:
    """The window of an image at subpixel position (x, y), (h, w, 3)."""
    matrix = np.array([[1, 0, position[0]], [0, 1, position[1]]], dtype=np.float64)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, matrix, shape[::-1], flags=flags), dtype=np.float32)


def _reflected(distance: Floats, extent: Floats) -> Floats:
    """A position reflected into 0 to (2,) room."""
    return extent - np.abs(distance % (2 * extent) - extent)


def _draw(image: NDArray[np.float32], mover: Mover, n: int) -> None:
    """Draw a mover at its position in a frame, in place; it is reflected at the image border."""
    centre = _reflected(mover.position + mover.velocity * n, np.array(SIZE[::-1], dtype=np.float64))
    side = len(mover.texture)
    left, top = (np.floor(centre).astype(int) - side // 2).tolist()
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + side, SIZE[1]), min(top + side, SIZE[0])
    if x1 <= x0 or y1 <= y0:
        return
    patch = _window(mover.texture, side // 2 + np.array([left, top]) - centre, (side, side))
    ys, xs = np.mgrid[y0:y1, x0:x1]
    alpha = np.clip(mover.radius + 0.5 - np.hypot(xs - centre[0], ys - centre[1]), 0, 1)[..., None]
    target = image[y0:y1, x0:x1]
    target += alpha * (patch[y0 - top : y1 - top, x0 - left : x1 - left] - target)
