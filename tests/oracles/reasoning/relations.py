"""`visup eval relations`: how fast relations of boxes are judged, and how steady and right they are."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from tests.oracles import relation_oracles as by_definition
from visup.evaluation.figures import Progress, silent
from visup.evaluation.reasoning.boxes import Boxes, BoxSettings, watch_boxes
from visup.rules.geometry.regions import RCC8, Floats
from visup.rules.relations._thresholds_jit import components
from visup.rules.relations.qtc import SIGNS
from visup.rules.relations.rcc8 import rcc8

FPS = 25.0
OBJECTS = (2, 10, 50)


def evaluate_relations(
    *,
    seed: int = 0,
    draws: int = 10_000,
    minutes: float = 10.0,
    progress: Progress = silent,
) -> dict[str, Any]:
    """All figures.

    Args:
        seed: Of all that is drawn.
        draws: Random pairs of boxes, and of moving points, that are compared with the oracles.
        minutes: How long boxes at rest are watched.
        progress: Shows what is being done.

    Returns:
        `items`: for each number of objects `fps`, `fps_cpu` (by processor time, where others share the
        machine), `plain_fps` (RCC-8, QTC-B, distance and approach
        in plain NumPy, without noise thresholds, in the same run) and `ratio`; for each scene at
        rest `changes`; `drift` with `seen_s`. `total`: `rcc8_wrong`, `qtc_wrong` of `draws`,
        `changes` of all scenes, `seen_s`.
    """
    items: dict[str, dict[str, Any]] = {}
    for count in OBJECTS:
        progress(f"{count} objects")
        items[f"{count} objects"] = speed(count, seed)
    for name, (one, two) in SCENES.items():
        progress(f"at rest, {name}")
        items[f"at rest, {name}"] = {"changes": changes(one, two, minutes, seed)}
    progress("drift")
    items["drift"] = {"seen_s": drift_seen(seed)}
    progress("definitions")
    at_rest = [row["changes"] for row in items.values() if "changes" in row]
    total = {
        "rcc8_wrong": rcc8_wrong(draws, seed),
        "qtc_wrong": qtc_wrong(draws, seed),
        "draws": draws,
        "changes": sum(at_rest),
        "seen_s": items["drift"]["seen_s"],
    }
    return {"items": items, "total": total}


_A = (100.0, 200.0, 80.0, 60.0)
SCENES: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "apart": (_A, (300.0, 200.0, 80.0, 60.0)),
    "edges meet": (_A, (180.0, 200.0, 80.0, 60.0)),
    "about to touch": (_A, (182.0, 200.0, 80.0, 60.0)),
    "overlap begins": (_A, (178.0, 200.0, 80.0, 60.0)),
    "inside, at the edge": (_A, (102.0, 215.0, 40.0, 30.0)),
    "equal": (_A, (102.0, 202.0, 80.0, 60.0)),
    "between two directions": (_A, (300.0, 200.0 + 200.0 * np.tan(np.pi / 8), 80.0, 60.0)),
    "between two classes": (_A, (180.0 + float(np.sqrt(4800.0)), 200.0, 80.0, 60.0)),
    "almost at one place": (_A, (105.6, 200.0, 80.0, 60.0)),
}
"""Pairs of boxes at rest: one easy, the others where a relation is about to be another."""


def speed(count: int, seed: int, frames: int = 160, rounds: int = 20) -> dict[str, float]:
    """Frames per second with thresholds and without, the best of several rounds in turn."""
    boxes = moving_boxes(count, frames, seed)
    ids = tuple(range(count))
    ours, alone, plain = [], [], []
    for _ in range(rounds):
        kept = Boxes()
        for k in range(60):
            kept = watch_boxes(kept, ids, boxes[k], k / FPS)
        begin, busy = time.perf_counter(), time.process_time()
        for k in range(60, frames):
            kept = watch_boxes(kept, ids, boxes[k], k / FPS)
        ours.append(time.perf_counter() - begin)
        alone.append(time.process_time() - busy)
        begin = time.perf_counter()
        for k in range(60, frames):
            by_definition.plain_relations(boxes[k - 1], boxes[k], 1.0 / FPS)
        plain.append(time.perf_counter() - begin)
    fps, cpu, plain_fps = ((frames - 60) / min(t) for t in (ours, alone, plain))
    return {"fps": fps, "fps_cpu": cpu, "plain_fps": plain_fps, "ratio": fps / plain_fps}


def moving_boxes(count: int, frames: int, seed: int, noise: float = 0.5) -> Floats:
    """(frames, count, 4) pixels: boxes that go straight on in a 640 x 480 image, with noise."""
    rng = np.random.default_rng(seed)
    begin, velocity = rng.uniform(0, (600, 440), (count, 2)), rng.uniform(-25, 25, (count, 2))
    size = rng.uniform(20, 80, (count, 2))
    at = begin + velocity * (np.arange(frames) / FPS)[:, None, None]
    at = at + noise * rng.standard_normal(at.shape)
    return np.concatenate([at, np.broadcast_to(size, at.shape)], axis=2)


def changes(one: tuple[float, ...], two: tuple[float, ...], minutes: float, seed: int) -> int:
    """How often any relation of two boxes at rest changes; every edge has noise of 0.5 px."""
    rng = np.random.default_rng(seed)
    still = np.array([one, two])
    corners = np.concatenate([still[:, :2], still[:, :2] + still[:, 2:]], axis=1)
    kept, found = Boxes(), 0
    settled = None
    for k in range(round(minutes * 60 * FPS)):
        edges = corners + 0.5 * rng.standard_normal(corners.shape)
        boxes = np.concatenate([edges[:, :2], edges[:, 2:] - edges[:, :2]], axis=1)
        kept = watch_boxes(kept, (0, 1), boxes, k / FPS)
        states = np.append(kept.hysteresis.state[:, 0], kept.rcc8)
        # Trends are known once their window is filled.
        if k / FPS > 2.0:
            found += int((states != settled).sum()) if settled is not None else 0
            settled = states
    return found


def drift_seen(seed: int, trials: int = 20, speed_px: float = 0.1) -> float:
    """Seconds until a box that begins to drift is seen to move, the worst of some trials."""
    worst = 0.0
    for trial in range(trials):
        rng = np.random.default_rng((seed, trial))
        rest = int(4.0 * FPS)
        kept, seen = Boxes(), np.inf
        for k in range(rest + int(4.0 * FPS)):
            x = 300.0 - speed_px * max(0, k - rest)
            boxes = np.array([_A, (x, 200.0, 80.0, 60.0)])
            boxes[:, :2] += 0.5 * rng.standard_normal((2, 2))
            kept = watch_boxes(kept, (0, 1), boxes, k / FPS)
            moves = kept.qtc_of(0, 1) == "0-" and kept.approach_of(0, 1) == "converging"
            if moves and k >= rest:
                seen = min(seen, (k - rest) / FPS)
        worst = max(worst, seen)
    return float(worst)


def rcc8_wrong(draws: int, seed: int) -> int:
    """In how many of some random pairs of boxes RCC-8 is not what its definition says."""
    rng = np.random.default_rng(seed)
    wrong = 0
    for _ in range(draws):
        boxes = np.concatenate([rng.integers(0, 8, (2, 2)), rng.integers(1, 7, (2, 2))], axis=1)
        found = rcc8(boxes.astype(float))
        a, b = (tuple(int(v) for v in box) for box in boxes)
        wrong += RCC8[found[0, 1]] != by_definition.rcc8_by_definition(a, b)
        wrong += RCC8[found[1, 0]] != by_definition.rcc8_by_definition(b, a)
    return wrong


def qtc_wrong(draws: int, seed: int) -> int:
    """In how many of some random pairs of moving points QTC-C is not what its definition says."""
    rng = np.random.default_rng(seed)
    wrong = 0
    for _ in range(draws):
        places, velocities = rng.integers(-6, 7, (2, 2)), rng.integers(-3, 4, (2, 2))
        if (places[0] == places[1]).all():
            continue
        speeds = components(places.astype(float), velocities.astype(float), 0, 1)[:4]
        # Whole numbers: what is 0 is 0 but for rounding.
        signs = np.where(np.abs(speeds) < 1e-9, 0, np.sign(speeds)).astype(int)
        wrong += "".join(SIGNS[s + 1] for s in signs) != by_definition.qtc_by_definition(
            places, velocities
        )
    return wrong


def settings_of_record() -> dict[str, Any]:
    """What the figures were made with."""
    s = BoxSettings()
    return {
        "fps": FPS,
        "noise_px": s.thresholds.noise_px,
        "window_s": s.window_s,
        "objects": OBJECTS,
    }
