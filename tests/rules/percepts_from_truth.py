"""Percepts made from the truth of a mission, with noise: what a good segmenter would report."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Depth,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
    Region,
    Report,
    ReportState,
)

MISSIONS = Path(__file__).resolve().parents[2] / "../shared/data/missions"
OTHERS = ("guitar", "umbrella", "horse", "hubble")
GIVES = ("region", "hypothesis", "depth", "health")


@dataclass(frozen=True)
class Noise:
    """How the percepts differ from the truth."""

    seed: int = 0
    every: int = 1
    shift_px: float = 0.4
    breathe_px: int = 1
    missing: float = 0.0
    wrong_name: float = 0.1
    depth_sigma: float = 0.03
    least_px: int = 150
    shape_every_s: float = 0.2
    fresh_id_after_gap: bool = True
    merge_touching: bool = False


def available(name: str) -> bool:
    return (MISSIONS / name / "truth.json").exists()


def truth_of(name: str) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((MISSIONS / name / "truth.json").read_text())
    return loaded


def actors_of(name: str) -> dict[str, tuple[str, ...]]:
    told = json.loads((MISSIONS / name / "mission.json").read_text())
    return {actor: (model,) for actor, model in told["actors"].items()}


def region_from_mask(id_: int, mask: NDArray[np.bool_], confidence: float = 0.9) -> Region:
    """Region of a whole-image mask; its contour is that of the largest part."""
    ys, xs = np.nonzero(mask)
    x, y = int(xs.min()), int(ys.min())
    w, h = int(xs.max()) - x + 1, int(ys.max()) - y + 1
    crop = np.ascontiguousarray(mask[y : y + h, x : x + w])
    found, _ = cv2.findContours(crop.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = max(found, key=len).reshape(-1, 2).astype(np.float32) + np.array([x, y], np.float32)
    height, width = mask.shape
    return Region(
        id=id_,
        bbox=(x, y, w, h),
        mask=crop,
        contour=contour.astype(np.float32),
        centroid=(float(xs.mean()), float(ys.mean())),
        area=float(len(xs)),
        cut=x == 0 or y == 0 or x + w == width or y + h == height,
        confidence=confidence,
    )


def observations(name: str, noise: Noise = Noise()) -> Iterator[tuple[Observation, dict[int, str]]]:
    """Observations of a mission, each with the truth: region id -> object name."""
    truth = truth_of(name)
    rng = np.random.default_rng(noise.seed)
    names = {v: k for k, v in truth["labels"].items()}
    models: dict[str, str] = truth["meshes"]
    ids: dict[int, int] = {}
    unseen: dict[int, float] = {}
    next_shape = 0.0
    for row in truth["frames"][:: noise.every]:
        index, now = row["index"], row["index"] / truth["fps"]
        labels = cv2.imread(str(MISSIONS / name / f"masks/{index:05d}.png"), cv2.IMREAD_GRAYSCALE)
        assert labels is not None
        shape_runs = now >= next_shape - 1e-9
        next_shape = now + noise.shape_every_s if shape_runs else next_shape
        percepts: list[Percept] = [Percept("health", Health(HealthStatus.OK), now, "health")]
        who: dict[int, str] = {}
        masks = {label: _shaken(labels == label, rng, noise) for label in names}
        masks = {label: m for label, m in masks.items() if m.sum() >= noise.least_px}
        if noise.merge_touching:
            masks = _merged(masks)
        for label, mask in masks.items():
            if rng.random() < noise.missing:
                continue
            if label not in ids or (noise.fresh_id_after_gap and now - unseen[label] > 0.8):
                ids[label] = len(ids) + 1 if label not in ids else max(ids.values()) + 1
            unseen[label] = now
            region = region_from_mask(ids[label], mask)
            who[region.id] = names[label]
            percepts.append(Percept("region", region, now, "truth"))
            if not shape_runs:
                continue
            model = models.get(names[label], "tdrs")
            wrong = rng.random() < noise.wrong_name
            other = OTHERS[rng.integers(len(OTHERS))]
            first, second = (other, model) if wrong else (model, other)
            for guess, similarity in ((first, 0.75), (second, 0.6)):
                said = Hypothesis(region.id, guess, 0, similarity + 0.05 * rng.standard_normal())
                percepts.append(Percept("hypothesis", said, now, "truth"))
            range_m = row[names[label]].get("range_m", 0.0) if names[label] in row else 0.0
            if range_m and not region.cut:
                depth = range_m * (1 + noise.depth_sigma * rng.standard_normal())
                told = Depth(region.id, model, depth, noise.depth_sigma * range_m)
                percepts.append(Percept("depth", told, now, "truth"))
        gives = GIVES if shape_runs else ("region", "health")
        report = Report("truth", ReportState.RAN, gives, tuple(percepts))
        size = (labels.shape[1], labels.shape[0])
        yield Observation(index, now, size, (report,)), who


def _shaken(mask: NDArray[np.bool_], rng: np.random.Generator, noise: Noise) -> NDArray[np.bool_]:
    dx, dy = np.round(noise.shift_px * rng.standard_normal(2)).astype(int)
    grow = int(rng.integers(-noise.breathe_px, noise.breathe_px + 1)) if noise.breathe_px else 0
    if not mask.any():
        return mask
    out: NDArray[Any] = mask.astype(np.uint8)
    if dx or dy:
        matrix = np.array([[1, 0, dx], [0, 1, dy]], dtype=np.float32)
        out = cv2.warpAffine(
            out, matrix, (mask.shape[1], mask.shape[0]), borderMode=cv2.BORDER_REPLICATE
        )
    kernel = np.ones((3, 3), np.uint8)
    if grow > 0:
        out = cv2.dilate(out, kernel, iterations=grow)
    elif grow < 0:
        out = cv2.erode(out, kernel, iterations=-grow, borderType=cv2.BORDER_REPLICATE)
    return out.astype(bool)


def _merged(masks: dict[int, NDArray[np.bool_]]) -> dict[int, NDArray[np.bool_]]:
    """Masks that touch become one, under the smaller label."""
    labels = sorted(masks)
    for i, a in enumerate(labels):
        for b in labels[i + 1 :]:
            if a in masks and b in masks:
                near = cv2.dilate(masks[a].astype(np.uint8), np.ones((3, 3), np.uint8))
                if (near.astype(bool) & masks[b]).any():
                    masks[a] = masks[a] | masks.pop(b)
    return masks
