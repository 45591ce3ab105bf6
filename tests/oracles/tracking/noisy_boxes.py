"""Boxes as a detector would find them, made from the truth: missed, off, uncertain, and some of nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from visup.percepts.detections.boxes import Box, Detection

Truth = Mapping[int, Mapping[int, Box]]
Random = np.random.Generator
HIDDEN = 0.35  # share of a box that shows below which it is seldom found
STAYS = 0.7  # chance that a box of nothing is found again in the next frame


@dataclass(frozen=True, slots=True)
class DetectorNoise:
    """How bad a detector is.

    Attributes:
        found: Chance that a thing that shows whole is found.
        off: Standard deviation of each side, as a share of the size of its box.
        clutter: Boxes of nothing that begin in a frame, on average.
        unsure: Standard deviation of a score.
    """

    found: float
    off: float
    clutter: float
    unsure: float


LEVELS: Mapping[str, DetectorNoise] = {
    "mild": DetectorNoise(0.97, 0.02, 0.05, 0.08),
    "usual": DetectorNoise(0.90, 0.05, 0.2, 0.12),
    "strong": DetectorNoise(0.80, 0.08, 0.5, 0.18),
}


def noisy_boxes(
    truth: Truth, frames: int, size: tuple[int, int], noise: DetectorNoise, seed: int
) -> dict[int, tuple[Detection, ...]]:
    """What a detector finds in each frame.

    Args:
        truth: Frame -> id -> box.
        frames: How many frames.
        size: (width, height) of a frame.
        noise: How bad the detector is.
        seed: Of all that is drawn.
    """
    rng = np.random.default_rng(seed)
    out, clutter = {}, list[Detection]()
    for frame in range(frames):
        boxes = list(truth.get(frame, {}).values())
        seen = [_found(b, shows(b, boxes), noise, rng) for b in boxes]
        clutter = [_moved(d, noise, rng) for d in clutter if rng.random() < STAYS]
        clutter += [_of_nothing(size, boxes, noise, rng) for _ in range(rng.poisson(noise.clutter))]
        all_ = [*(d for d in seen if d is not None), *clutter]
        out[frame] = tuple(all_[i] for i in rng.permutation(len(all_)))
    return out


def shows(box: Box, boxes: list[Box]) -> float:
    """Share of a box that none in front of it hides: those in front stand lower in the image."""
    hidden = 0.0
    for other in boxes:
        if other[1] + other[3] > box[1] + box[3]:
            width = min(box[0] + box[2], other[0] + other[2]) - max(box[0], other[0])
            height = min(box[1] + box[3], other[1] + other[3]) - max(box[1], other[1])
            hidden = max(hidden, max(width, 0.0) * max(height, 0.0) / (box[2] * box[3]))
    return 1.0 - hidden


def _found(box: Box, share: float, noise: DetectorNoise, rng: Random) -> Detection | None:
    chance = noise.found / (1.0 + np.exp(-(share - HIDDEN) / 0.08))
    if rng.random() > chance:
        return None
    score = float(np.clip(rng.normal(0.2 + 0.65 * share, noise.unsure), 0.05, 0.99))
    return Detection(0, _jittered(box, noise, rng), score)


def _jittered(box: Box, noise: DetectorNoise, rng: Random) -> Box:
    x, y, w, h = box
    dx, dy, dw, dh = rng.normal(0.0, noise.off, 4)
    wide, high = w * float(np.exp(dw)), h * float(np.exp(dh))
    return x + w / 2 + dx * w - wide / 2, y + h / 2 + dy * h - high / 2, wide, high


def _moved(d: Detection, noise: DetectorNoise, rng: Random) -> Detection:
    return Detection(0, _jittered(d.box, noise, rng), _clutter_score(noise, rng))


def _of_nothing(
    size: tuple[int, int], boxes: list[Box], noise: DetectorNoise, rng: Random
) -> Detection:
    like = boxes[int(rng.integers(len(boxes)))] if boxes else (0.0, 0.0, 40.0, 90.0)
    x, y = rng.uniform(0, size[0] - like[2]), rng.uniform(0, size[1] - like[3])
    box = (float(x), float(y), like[2], like[3])
    return Detection(0, box, _clutter_score(noise, rng))


def _clutter_score(noise: DetectorNoise, rng: Random) -> float:
    return float(np.clip(rng.normal(0.25, noise.unsure), 0.05, 0.99))
