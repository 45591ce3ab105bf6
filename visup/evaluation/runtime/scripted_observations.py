"""Scripted observations without images, for runs of any length.

`drifting_boxes` drift, meet, flicker, cross the image border and return under other ids; `moving_ellipses`
oscillate, meet and separate, with hypotheses and depth.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import cv2
import numpy as np

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
from visup.testing import region_of

SIZE = (640, 480)
FPS = 25.0
BOX_NAMES = ("arm", "satellite", "guitar", "barrel", "drill", "engine")
ELLIPSES = 3
ELLIPSE_NAMES = ("arm", "spartan", "hubble")


def drifting_boxes(count: int, frames: int, seed: int, start: float = 0.0) -> Iterator[Observation]:
    """Observations of boxes that come and go.

    Args:
        count: Number of boxes; each in turn is out of the image for a while.
        frames: Number of observations.
        seed: Random seed.
        start: Time of the first one, seconds.
    """
    rng = np.random.default_rng(seed)
    masks = [np.ones((40 + 4 * k, 60 + 6 * k), dtype=bool) for k in range(count)]
    pace = 20.0 + 7.0 * np.arange(count)
    for index in range(frames):
        now = start + index / FPS
        regions = []
        for k, mask in enumerate(masks):
            span = SIZE[0] + 2 * mask.shape[1]
            lap, along = divmod(pace[k] * now, span)
            x = round(along - mask.shape[1] + rng.normal(0, 0.5))
            y = 20 + round((37 * k) % (SIZE[1] - 120) + 20 * np.sin(now / 3 + k))
            region = _box(1 + k + count * int(lap), mask, x, y)
            if region is not None and rng.random() > 0.1:
                regions.append(region)
        yield _box_observation(index, now, regions, rng)


def _box(number: int, mask: np.ndarray, x: int, y: int) -> Region | None:
    w = mask.shape[1]
    left, right = max(0, x), min(SIZE[0], x + w)
    if right - left < 4:
        return None
    return replace(
        region_of(mask[:, : right - left], number, at=(left, y), size=SIZE), confidence=0.9
    )


def _box_observation(
    index: int, now: float, regions: list[Region], rng: np.random.Generator
) -> Observation:
    percepts = [Percept("region", r, now, "script") for r in regions]
    percepts.append(Percept("health", Health(HealthStatus.OK), now, "script"))
    if index % 5 == 0:
        for r in regions:
            true_name = BOX_NAMES[(r.id - 1) % 3]
            wrong_name = BOX_NAMES[int(rng.integers(len(BOX_NAMES)))]
            for name, similarity in ((true_name, 0.7), (wrong_name, 0.65 + 0.1 * rng.random())):
                hypothesis = Hypothesis(r.id, name, 0, similarity)
                percepts.append(Percept("hypothesis", hypothesis, now, "script"))
    gives = ("region", "health", "hypothesis") if index % 5 == 0 else ("region", "health")
    report = Report("script", ReportState.RAN, gives, tuple(percepts))
    return Observation(index, now, SIZE, (report,))


def moving_ellipses(count: int, begin: int = 0, ahead_s: float = 0.0) -> Iterator[Observation]:
    """Observations of three ellipses that oscillate, meet and separate.

    Args:
        count: Number of frames.
        begin: Number of the first frame.
        ahead_s: Offset of the scene relative to its clock, seconds.
    """
    shapes = [_ellipse(20 + 6 * k, 14 + 4 * k) for k in range(ELLIPSES)]
    for index in range(begin, begin + count):
        yield _ellipse_observation(index, shapes, ahead_s)


def _ellipse_observation(index: int, shapes: list[tuple[Any, Any]], ahead_s: float) -> Observation:
    t = index / FPS
    regions = [_ellipse_region(k + 1, t + ahead_s, *shapes[k]) for k in range(ELLIPSES)]
    hypotheses = [
        Hypothesis(r.id, ELLIPSE_NAMES[(r.id + n) % 3], 4 * n + r.id, 0.9 - 0.2 * n, 0.1, 30.0)
        for r in regions
        for n in range(2)
    ]
    depths = [Depth(r.id, ELLIPSE_NAMES[r.id % 3], 10.0 + r.id, 0.5) for r in regions]
    health = [Health(HealthStatus.OK)]
    values: dict[str, list[Any]] = {
        "health": health,
        "region": regions,
        "hypothesis": hypotheses,
        "depth": depths,
    }
    return Observation(
        index, t, SIZE, tuple(_report(kind, of_kind, t) for kind, of_kind in values.items())
    )


def _report(kind: str, values: list[Any], t: float) -> Report:
    percepts = tuple(Percept(kind, v, t, kind) for v in values)
    return Report(kind, ReportState.RAN, (kind,), percepts)


def _ellipse(a: int, b: int) -> tuple[Any, Any]:
    y, x = np.mgrid[-b : b + 1, -a : a + 1]
    mask = (x / a) ** 2 + (y / b) ** 2 <= 1.0
    outlines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return mask, np.asarray(outlines[0][:, 0], np.float32)


def _ellipse_region(number: int, t: float, mask: Any, outline: Any) -> Region:
    period, reach = 16.0 + 5 * number, 200.0
    turn = 2 * math.pi * t / period
    cx, cy = 320 + reach * math.sin(turn), 120.0 * number + 30 * math.cos(turn)
    h, w = mask.shape
    x, y = round(cx - w / 2), round(cy - h / 2)
    speed = 2 * math.pi / period
    return Region(
        id=number,
        bbox=(x, y, w, h),
        mask=mask,
        contour=outline + np.array([x, y], np.float32),
        centroid=(x + (w - 1) / 2, y + (h - 1) / 2),
        area=float(mask.sum()),
        velocity=(reach * speed * math.cos(turn), -30 * speed * math.sin(turn)),
        velocity_sigma=0.5,
    )
