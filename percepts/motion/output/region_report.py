"""The regions reported for tracks and foreground objects, with directives applied."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from visup.agent import Directive, Region
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.foreground.foreground_tracking import ForegroundState
from visup.percepts.motion.foreground.objects import MovingObject, object_share, object_velocity
from visup.percepts.motion.layers.dense_labelling import CLIP, PointEvidence
from visup.percepts.motion.outlines.outline_motion import part_motion
from visup.percepts.motion.outlines.outline_refinement import CONTEXT, refine_outline
from visup.percepts.motion.outlines.region_outline import RegionOutline, region_outline
from visup.percepts.motion.static_camera.track_fusion import MotionEvidence
from visup.percepts.motion.tracks.measurements import FrameMeasurements, min_region_area
from visup.percepts.motion.tracks.track import Indices, Track

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class OutlinedFrame:
    """What outlines are drawn from.

    Attributes:
        scene: The frame as measured.
        old: The image before it.
        size: (width, height) of the frame.
    """

    scene: FrameMeasurements
    old: WorkImage
    size: tuple[int, int]


def apply_ignore(
    directives: Sequence[Directive], scene: FrameMeasurements, evidence: PointEvidence
) -> PointEvidence:
    """Suppress motion evidence inside 'ignore' boxes.

    Args:
        directives: Their boxes are in frame pixels.
        scene: The frame.
        evidence: Evidence of the points.

    Returns:
        The evidence, entirely for the background inside the boxes.
    """
    out = evidence.likelihood
    for box in _boxes(directives, "ignore"):
        inside = _inside(scene.points.xy / scene.image.scale, box)
        out = out.copy()
        out[inside, 1:] = out[inside].min(initial=0) - 10
    return replace(evidence, likelihood=out)


def tracks_to_look_at(
    directives: Sequence[Directive], tracks: Sequence[Track], scene: FrameMeasurements
) -> tuple[bool, ...]:
    """Which tracks lie inside 'look_at' boxes.

    Args:
        directives: Those of kind 'look_at' count; their boxes are in frame pixels.
        tracks: All tracks.
        scene: The frame.

    Returns:
        For each track whether its centre lies in such a box.
    """
    boxes = _boxes(directives, "look_at")
    centres = np.array([t.centre for t in tracks]).reshape(-1, 2) / scene.image.scale
    inside = [_inside(centres, box) for box in boxes]
    return tuple(np.any(inside, axis=0).tolist()) if boxes else (False,) * len(tracks)


def motion_evidence(
    scene: FrameMeasurements, winner: Indices, evidence: PointEvidence
) -> MotionEvidence:
    """The points that are evidence for the motion of a track, with their weights.

    Args:
        scene: The frame.
        winner: (count,) label of each superpixel; label k is track k - 1.
        evidence: Evidence of the points.

    Returns:
        The points in tracks, in frame pixels.
    """
    at, likelihood = winner[scene.at], evidence.likelihood
    use = np.flatnonzero(evidence.informative & (at > 0) & (at < likelihood.shape[1] - 1))
    gain = likelihood[use, at[use]] - likelihood[use, 0]
    return MotionEvidence(scene.points.xy[use] / scene.image.scale, np.clip(gain, -CLIP, CLIP))


Box = tuple[float, float, float, float]


def _boxes(directives: Sequence[Directive], kind: str) -> list[Box]:
    boxes = [_box(d.data) for d in directives if d.kind == kind]
    return [box for box in boxes if box is not None]


def report_regions(
    tracks: Sequence[Track],
    frame: OutlinedFrame,
    settings: MotionSettings,
    executor: Executor,
) -> tuple[Region, ...]:
    """Regions of the confirmed tracks that are in view.

    Args:
        tracks: All tracks.
        frame: The frame.
        settings: Gives the least area.
        executor: Computes every other outline in parallel.

    Returns:
        Regions by id.
    """
    scene = frame.scene
    scale = scene.image.scale
    least = min_region_area(scene, settings) / scale**2
    reported = [t for t in tracks if t.id > 0]

    def drawn(t: Track) -> RegionOutline | None:
        return _share_outline(t.share, [o.share for o in reported if o is not t], frame, least)

    visible = [t for t in reported if t.last_seen == scene.time]
    out = [_region(t, shape, scale) for t, shape in _outlined(visible, drawn, executor)]
    return tuple(sorted(out, key=lambda r: r.id))


def report_objects(
    state: ForegroundState,
    tracks: Sequence[Track],
    frame: OutlinedFrame,
    settings: MotionSettings,
    executor: Executor,
) -> tuple[Region, ...]:
    """Regions of the objects of the foreground that are in view.

    Args:
        state: The foreground after the frame.
        tracks: All tracks: an object with a track takes its velocity.
        frame: The frame.
        settings: Gives the least area.
        executor: Computes every other outline in parallel.

    Returns:
        Regions by id.
    """
    scene = frame.scene
    least = min_region_area(scene, settings) / scene.image.scale**2
    by_id = {t.id: t for t in tracks if t.id > 0}
    reported = state.objects.reported(scene.time)

    def drawn(o: MovingObject) -> RegionOutline | None:
        share = object_share(state.objects, o.key)
        return _share_outline(share, [], frame, least)

    return tuple(
        _object_region(o, shape, by_id.get(o.track), state, scene)
        for o, shape in _outlined(reported, drawn, executor)
    )


def _outlined(
    items: Sequence[T], outline: Callable[[T], RegionOutline | None], executor: Executor
) -> list[tuple[T, RegionOutline]]:
    """Items with their outlines, every other one computed in parallel; those without one are dropped."""
    later = [executor.submit(outline, item) for item in items[1::2]]
    shapes: list[RegionOutline | None] = [None] * len(items)
    shapes[::2] = [outline(item) for item in items[::2]]
    shapes[1::2] = [shape.result() for shape in later]
    pairs = zip(items, shapes, strict=True)
    return [(item, shape) for item, shape in pairs if shape is not None]


def _object_region(
    o: MovingObject,
    shape: RegionOutline,
    t: Track | None,
    state: ForegroundState,
    scene: FrameMeasurements,
) -> Region:
    """The region of an object: with the velocity of its track, or else of its cells."""
    scale = scene.image.scale
    if t is not None:
        return replace(_region(t, shape, scale), id=o.id)
    vx, vy, sigma = object_velocity(state.objects, o.key, scene.flow, scene.cells, scene.seconds)
    sure = float(np.mean(state.belief.share[state.objects.owner == o.key]))
    return shape.region(o.id, (vx / scale, vy / scale), sigma / scale, sure)


def _share_outline(
    share_of_cells: Floats,
    others: Sequence[Floats],
    frame: OutlinedFrame,
    least: float,
) -> RegionOutline | None:
    scene = frame.scene
    x, y, w, h = scene.cells.box(share_of_cells > 0.5)
    if not w:
        return None
    left, top = max(x - CONTEXT, 0), max(y - CONTEXT, 0)
    part = np.s_[top : y + h + CONTEXT, left : x + w + CONTEXT]
    labels = scene.cells.labels[part]
    share = share_of_cells[labels]
    motion = part_motion(scene.image, frame.old, scene.flow, part)
    drawn = refine_outline(share, np.ascontiguousarray(scene.image.tone[part]), motion)
    if others:
        # Cells of another object are not taken from it.
        taken = (np.max(others, axis=0) > 0.5)[labels]
        drawn = np.where(taken, share, drawn)
    return region_outline(drawn, (left, top), scene.image.shape, frame.size, least)


def select_regions(
    regions: Sequence[Region], directives: Sequence[Directive]
) -> tuple[Region, ...]:
    """The regions that the directives allow.

    Args:
        regions: All detected regions.
        directives: 'expect_regions' keeps the most certain, 'ignore' drops those inside its box.

    Returns:
        Regions by id.
    """
    left = _best([r for r in regions if not _ignored(r, directives)], directives)
    return tuple(sorted(left, key=lambda r: r.id))


def _best(regions: list[Region], directives: Sequence[Directive]) -> list[Region]:
    counts = [d.data.get("count") for d in directives if d.kind == "expect_regions"]
    wanted = [int(c) for c in counts if isinstance(c, int) and c >= 0]
    if not wanted:
        return regions
    surest = sorted(regions, key=lambda r: (-round(r.confidence, 2), r.id))
    return surest[: max(wanted)]


def _ignored(region: Region, directives: Sequence[Directive]) -> bool:
    boxes = [_box(d.data) for d in directives if d.kind == "ignore"]
    centre = np.asarray([region.centroid])
    return any(bool(_inside(centre, box)[0]) for box in boxes if box is not None)


def _box(data: Mapping[str, Any]) -> tuple[float, float, float, float] | None:
    box = data.get("bbox")
    if box is None or len(box) != 4:
        return None
    x, y, w, h = (float(v) for v in box)
    return x, y, w, h


def _inside(xy: NDArray[Any], box: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    x, y, w, h = box
    return np.asarray((xy[:, 0] >= x) & (xy[:, 0] < x + w) & (xy[:, 1] >= y) & (xy[:, 1] < y + h))


def _region(t: Track, shape: RegionOutline, scale: float) -> Region:
    rate = t.best_rate()
    centre = (shape.centroid[0] * scale, shape.centroid[1] * scale)
    speed = t.velocity(centre) / scale
    sigma = rate.sigma / scale if rate is not None else float("inf")
    sure = float(1 - np.exp(-max(t.evidence, 0.0) / 100.0))
    return shape.region(t.id, (float(speed[0]), float(speed[1])), sigma, sure)
