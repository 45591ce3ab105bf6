"""The cost of taught objects at rest: the time of a step with five of them, and without.

The scene is a desk with five objects of random colours, sensor noise, and a passing disc. The same frames are
processed by an agent taught the five and by one taught none; the median of the ratios is reported, since
other load slows both alike. Times are processor time of the process.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import SettingsError
from visup.evaluation.figures import Progress, silent
from visup.percepts.taught.taught_view import TaughtView, taught_view_from_mask
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent
from visup.teaching.outline_teaching import store

Image = NDArray[np.uint8]

SIZE, FPS = (640, 480), 25.0
BOXES = (
    (60, 60, 60, 50),
    (200, 300, 70, 60),
    (380, 280, 120, 80),
    (300, 60, 60, 120),
    (500, 350, 50, 50),
)
"""Boxes of the objects: x, y, width, height, pixels."""
NOISE_SIGMA, NOISE_IMAGES = 2.0, 24
"""Standard deviation of sensor noise in grey levels, and number of noise images."""
WARM_UP_FRAMES = 60
"""Frames of warm-up that are not measured: compilation, and detection of the resting objects."""


def evaluate_teaching(
    frames: int = 400, seed: int = 0, progress: Progress = silent
) -> dict[str, Any]:
    """The time of a step with and without five taught objects at rest, and of teaching one.

    Args:
        frames: Number of frames, including `WARM_UP_FRAMES` frames of warm-up.
        seed: Random seed.
        progress: Shows what is being done.

    Returns:
        `total` with `ms` and `ms_taught` of a step (medians, processor time), `cost`, the median of
        the ratios of each pair minus one, and `teach_s`, the greatest time to teach one object.

    Raises:
        SettingsError: There are too few frames.
    """
    if frames < 2 * WARM_UP_FRAMES:
        raise SettingsError(
            f"{frames} frames are too few",
            expected=f"at least {2 * WARM_UP_FRAMES}, so that half are measured",
        )
    rng = np.random.default_rng(seed)
    desk = _desk(rng)
    with tempfile.TemporaryDirectory() as scratch:
        models = Path(scratch) / "taught.models"
        taught_s = [_teach_seconds(models, view) for view in _views(desk)]
        source = str(Path(scratch) / "none.mp4")
        agents = [build_agent(WatchSettings(source=source, models=m)) for m in (None, models)]
        progress("stepping")
        try:
            times = np.array(list(_paired_seconds(agents, _frames(desk, frames, rng))))[
                WARM_UP_FRAMES:
            ]
        finally:
            for agent in agents:
                agent.close()
    without, taught = np.median(times, axis=0)
    cost = float(np.median(times[:, 1] / times[:, 0]) - 1.0)
    total = {
        "ms": 1000 * float(without),
        "ms_taught": 1000 * float(taught),
        "cost": cost,
        "teach_s": max(taught_s),
    }
    return {"total": total, "items": {}}


def _paired_seconds(
    agents: Sequence[Agent], frames: Iterator[Frame]
) -> Iterator[tuple[float, ...]]:
    """Seconds of each agent for each frame, in alternating order."""
    for frame in frames:
        order = range(len(agents)) if frame.index % 2 else reversed(range(len(agents)))
        seconds = {k: _step_seconds(agents[k], frame) for k in order}
        yield tuple(seconds[k] for k in sorted(seconds))


def _step_seconds(agent: Agent, frame: Frame) -> float:
    start = time.process_time()
    agent.step(frame)
    return time.process_time() - start


def _teach_seconds(models: Path, view: TaughtView) -> float:
    start = time.perf_counter()
    store(models, [view])
    return time.perf_counter() - start


def _views(desk: Image) -> Iterator[TaughtView]:
    for number, (x, y, w, h) in enumerate(BOXES, start=1):
        mask = np.zeros(desk.shape[:2], dtype=bool)
        mask[y : y + h, x : x + w] = True
        yield taught_view_from_mask(f"thing_{number}", desk, mask)


def _desk(rng: np.random.Generator) -> Image:
    """(H, W, 3) uint8: a table with some grain, and the five objects."""
    grain = rng.integers(110, 150, (SIZE[1] // 8, SIZE[0] // 8, 3)).astype(np.uint8)
    desk = cv2.resize(grain, SIZE, interpolation=cv2.INTER_CUBIC)
    for x, y, w, h in BOXES:
        texture = rng.integers(0, 256, (6, 6, 3)).astype(np.uint8)
        desk[y : y + h, x : x + w] = cv2.resize(texture, (w, h), interpolation=cv2.INTER_CUBIC)
    return np.asarray(desk, dtype=np.uint8)


def _frames(desk: Image, count: int, rng: np.random.Generator) -> Iterator[Frame]:
    """The desk with noise, and a disc that repeatedly crosses it below the objects."""
    noises = [rng.normal(0.0, NOISE_SIGMA, desk.shape) for _ in range(NOISE_IMAGES)]
    for n in range(count):
        image = np.clip(desk + noises[n % NOISE_IMAGES], 0, 255).astype(np.uint8)
        cv2.circle(image, (20 + 4 * n % (SIZE[0] - 40), 440), 14, (30, 30, 220), -1)
        yield Frame(n, n / FPS, image)
