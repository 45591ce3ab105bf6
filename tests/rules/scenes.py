"""Scripted percepts: boxes that move, vanish, merge; no images needed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

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
from visup.rules.geometry.outlines import write_support

SIZE = (640, 480)
Rect = tuple[float, float, float, float]


def box_region(id_: int, rect: Rect, size: tuple[int, int] = SIZE) -> Region | None:
    """An upright box (x, y, width, height) as a region, clipped to the image; None when outside.

    The contour has the box's own subpixel corners, the mask is rounded."""
    x0, y0 = max(rect[0], 0.0), max(rect[1], 0.0)
    x1, y1 = min(rect[0] + rect[2], size[0]), min(rect[1] + rect[3], size[1])
    if x1 - x0 < 1 or y1 - y0 < 1:
        return None
    left, top, right, bottom = (round(v) for v in (x0, y0, x1, y1))
    if right <= left or bottom <= top:
        return None
    along_x, along_y = np.linspace(x0, x1 - 1, 40), np.linspace(y0, y1 - 1, 40)
    contour = np.empty((4, 40, 2), np.float32)
    contour[0, :, 0], contour[0, :, 1] = along_x, y0
    contour[1, :, 0], contour[1, :, 1] = x1 - 1, along_y
    contour[2, :, 0], contour[2, :, 1] = along_x[::-1], y1 - 1
    contour[3, :, 0], contour[3, :, 1] = x0, along_y[::-1]
    return Region(
        id=id_,
        bbox=(left, top, right - left, bottom - top),
        mask=np.ones((bottom - top, right - left), dtype=bool),
        contour=contour.reshape(-1, 2),
        centroid=((x0 + x1 - 1) / 2, (y0 + y1 - 1) / 2),
        area=float((right - left) * (bottom - top)),
        cut=left == 0 or top == 0 or right == size[0] or bottom == size[1],
        confidence=0.9,
    )


def seen(
    index: int,
    regions: Iterable[Region | None],
    fps: float = 25.0,
    names: Mapping[int, Iterable[tuple[str, float]]] | None = None,
    depths: Mapping[int, tuple[str, float]] | None = None,
    state: ReportState = ReportState.RAN,
    health: HealthStatus = HealthStatus.OK,
) -> Observation:
    """One observation; `names` gives (name, similarity) by region id, `depths` (name, depth)."""
    now = index / fps
    values: list[tuple[str, object]] = [("region", r) for r in regions if r is not None]
    for id_, said in (names or {}).items():
        values += [("hypothesis", Hypothesis(id_, n, 0, s)) for n, s in said]
    for id_, (name, depth) in (depths or {}).items():
        values.append(("depth", Depth(id_, name, depth, 0.02 * depth)))
    ran = state is ReportState.RAN
    percepts = tuple(Percept(k, v, now, "script") for k, v in values) if ran else ()
    seeing = Report("script", state, ("region", "hypothesis", "depth"), percepts)
    fit = Report(
        "health",
        ReportState.RAN,
        ("health",),
        (Percept("health", Health(health), now, "health"),),
    )
    return Observation(index, now, SIZE, (seeing, fit))


def reach_of(region: Region) -> tuple[np.ndarray, np.ndarray]:
    """How far a region's outline reaches in each direction, and whether it is clear of the border there."""
    support, free = np.empty(16), np.empty(16, dtype=bool)
    write_support(region, SIZE, support, free)
    return support, free
