"""The figures of `visup eval motion` from masks, as pure functions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
UNSCORED_LABEL = 128
"""Value of pixels in a mask that are not scored."""
BOUNDARY_TOLERANCE = 0.008
"""Tolerance of F, share of the image diagonal, as in DAVIS."""
MIN_SCORED_PX = 500
"""Objects with fewer visible pixels are not scored in a frame."""
GHOST_OVERLAP = 0.1
MATCH_IOU = 0.5
UNSCORED_START_S = 2.0
"""Time after an object's first scored frame in which it is not scored yet, seconds."""


def iou(a: Mask, b: Mask) -> float:
    """Intersection over union of two (H, W) masks; 1 when both are empty."""
    union = int(np.count_nonzero(a | b))
    return int(np.count_nonzero(a & b)) / union if union else 1.0


def region_similarity(predicted: Mask, ground_truth: Mask, scored: Mask) -> float | None:
    """J of one frame.

    Args:
        predicted: (H, W) bool, union of all regions.
        ground_truth: (H, W) bool, union of all objects.
        scored: (H, W) bool, where pixels are scored.

    Returns:
        0 to 1, or None when no pixel is scored.
    """
    if not scored.any():
        return None
    return iou(predicted & scored, ground_truth & scored)


def boundary_measure(
    predicted: Mask, ground_truth: Mask, tolerance: float = BOUNDARY_TOLERANCE
) -> float:
    """F of one frame: how well two outlines agree, as DAVIS defines it.

    Args:
        predicted: (H, W) bool.
        ground_truth: (H, W) bool.
        tolerance: How far a boundary pixel may lie off, share of the image diagonal.

    Returns:
        0 to 1; 1 when both are empty.
    """
    tolerance_px = math.ceil(tolerance * math.hypot(*predicted.shape))
    a, b = boundary(predicted), boundary(ground_truth)
    near_a, near_b = _dilated(a, tolerance_px), _dilated(b, tolerance_px)
    count_a, count_b = int(a.sum()), int(b.sum())
    if count_a == 0 or count_b == 0:
        return float(count_a == count_b)
    precision = int((a & near_b).sum()) / count_a
    recall = int((b & near_a).sum()) / count_b
    return 2 * precision * recall / (precision + recall) if precision + recall else 0.0


def boundary(mask: Mask) -> Mask:
    """Pixels that differ from their right, lower or lower right neighbour, (H, W) bool."""
    inner = np.pad(mask, ((0, 1), (0, 1)), mode="edge")
    here = inner[:-1, :-1]
    return np.asarray((here != inner[:-1, 1:]) | (here != inner[1:, :-1]) | (here != inner[1:, 1:]))


def _dilated(mask: Mask, radius: int) -> Mask:
    ys, xs = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    disk = (xs * xs + ys * ys <= radius * radius).astype(np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), disk) > 0)


@dataclass(frozen=True, slots=True)
class PixelCounts:
    """Pixels over all frames of a sequence, as CDnet counts them (Goyette et al. 2012).

    Attributes:
        true_positives: True positives.
        false_positives: False positives.
        false_negatives: False negatives.
    """

    true_positives: int = 0
    false_positives: int = 0
    false_negatives: int = 0

    def with_frame(self, predicted: Mask, ground_truth: Mask, scored: Mask) -> PixelCounts:
        """Add the scored pixels of a frame."""
        true_positives = int(np.count_nonzero(predicted & ground_truth & scored))
        return PixelCounts(
            self.true_positives + true_positives,
            self.false_positives + int(np.count_nonzero(predicted & scored)) - true_positives,
            self.false_negatives + int(np.count_nonzero(ground_truth & scored)) - true_positives,
        )

    @property
    def f_measure(self) -> float:
        """Harmonic mean of precision and recall, 0 to 1; 1 without truth and detections."""
        pixels = 2 * self.true_positives + self.false_positives + self.false_negatives
        return 2 * self.true_positives / pixels if pixels else 1.0


def has_ghost(regions: Iterable[Mask], objects: Sequence[Mask]) -> bool:
    """Whether any region overlaps all objects by less than a tenth of its area."""
    for region in regions:
        area = int(region.sum())
        best = max((int((region & o).sum()) for o in objects), default=0)
        if area and best < GHOST_OVERLAP * area:
            return True
    return False


@dataclass(frozen=True, slots=True)
class MaskOverlaps:
    """How regions and objects overlap in one frame, in pixels; regions are taken as disjoint.

    Attributes:
        index: Number of the frame.
        time: Seconds.
        objects: Visible pixels of each object.
        regions: Pixels of each region.
        common: Pixels common to (region, object).
    """

    index: int
    time: float
    objects: Mapping[str, int]
    regions: Mapping[int, int]
    common: Mapping[tuple[int, str], int]

    def iou(self, ids: Iterable[int], names: Iterable[str]) -> float:
        """IoU of the union of some regions with the union of some objects."""
        ids, names = set(ids), set(names)
        intersection = sum(v for (i, n), v in self.common.items() if i in ids and n in names)
        region_px = sum(v for i, v in self.regions.items() if i in ids)
        object_px = sum(v for n, v in self.objects.items() if n in names)
        return (
            intersection / (region_px + object_px - intersection)
            if region_px + object_px - intersection
            else 0.0
        )

    def iou_by_region(self, name: str) -> dict[int, float]:
        """IoU of one object with each region."""
        return {i: self.iou((i,), (name,)) for i in self.regions}

    def covering(self, names: Iterable[str]) -> int | None:
        """The region that best covers some objects, with IoU of at least 0.5."""
        names = set(names)
        best = max(((self.iou((i,), names), -i) for i in self.regions), default=(0.0, 0))
        return -best[1] if best[0] >= MATCH_IOU else None


def overlaps_of(
    index: int,
    time: float,
    labels: NDArray[np.uint8],
    names: Mapping[str, int],
    regions: Mapping[int, Mask],
) -> MaskOverlaps:
    """Count the overlaps of one frame.

    Args:
        index: Number of the frame.
        time: Seconds.
        labels: (H, W) uint8 mask values.
        names: Object -> mask value.
        regions: Region id -> (H, W) bool.

    Returns:
        The overlaps.
    """
    objects = {n: int(np.count_nonzero(labels == v)) for n, v in names.items()}
    common: dict[tuple[int, str], int] = {}
    for i, mask in regions.items():
        counts = np.bincount(labels[mask], minlength=256)
        common |= {(i, n): int(counts[v]) for n, v in names.items()}
    return MaskOverlaps(index, time, objects, {i: int(m.sum()) for i, m in regions.items()}, common)


@dataclass(frozen=True, slots=True)
class ObjectScore:
    """The score of one object: mean IoU with its region, and how often its region's id changed."""

    j: float
    switches: int


def object_scores(
    frames: Sequence[MaskOverlaps], coupled: Sequence[tuple[int, frozenset[str]]] = ()
) -> dict[str, ObjectScore]:
    """J_object and id switches of each object of a mission.

    An object is scored in frames with at least 500 visible pixels, from 2 s after the first of these. Its
    region is the one that fits best over the sequence. Coupled objects count as one: their union is compared
    with their former regions, or with the single region that fits it best.

    Args:
        frames: Overlaps of all frames.
        coupled: (frame, objects) of coupled events.

    Returns:
        Scores by object, without those that are never scored.
    """
    names = sorted({n for f in frames for n in f.objects})
    single, coupled_frames = _periods(frames, names, coupled)
    best = {n: best_region([f.iou_by_region(n) for f in single[n]]) for n in names}
    scores = {}
    for name in names:
        own = [i for i in (best[name],) if i is not None]
        values = [f.iou(own, (name,)) for f in single[name]]
        switches = id_switches(f.covering((name,)) for f in single[name])
        for group, group_frames in coupled_frames[name].items():
            values += _group_ious(group_frames, group, {best[n] for n in group} - {None})
            switches += id_switches(f.covering(group) for f in group_frames)
        if values:
            scores[name] = ObjectScore(sum(values) / len(values), switches)
    return scores


def _periods(
    frames: Sequence[MaskOverlaps],
    names: Sequence[str],
    coupled: Sequence[tuple[int, frozenset[str]]],
) -> tuple[dict[str, list[MaskOverlaps]], dict[str, dict[frozenset[str], list[MaskOverlaps]]]]:
    """Scored frames of each object: by itself, and coupled."""
    single: dict[str, list[MaskOverlaps]] = {n: [] for n in names}
    coupled_frames: dict[str, dict[frozenset[str], list[MaskOverlaps]]] = {n: {} for n in names}
    entered: dict[str, float] = {}
    for frame in frames:
        for name in names:
            if frame.objects.get(name, 0) < MIN_SCORED_PX:
                continue
            if frame.time < entered.setdefault(name, frame.time) + UNSCORED_START_S:
                continue
            groups = [g for start, g in coupled if name in g and frame.index >= start]
            if groups:
                coupled_frames[name].setdefault(groups[-1], []).append(frame)
            else:
                single[name].append(frame)
    return single, coupled_frames


def _group_ious(
    frames: Sequence[MaskOverlaps], group: frozenset[str], own: set[int | None]
) -> list[float]:
    ids = [i for i in own if i is not None]
    former = [f.iou(ids, group) for f in frames]
    single = best_region([{i: f.iou((i,), group) for i in f.regions} for f in frames])
    best_single = [f.iou((single,), group) if single else 0.0 for f in frames]
    return max(former, best_single, key=sum)


def best_region(overlaps: Sequence[Mapping[int, float]]) -> int | None:
    """The region id that fits an object best over a sequence.

    Args:
        overlaps: For each scored frame, IoU of the object with each reported region.

    Returns:
        The id with the highest sum, the smaller one among equals; or None.
    """
    total: dict[int, float] = {}
    for frame in overlaps:
        for number, value in frame.items():
            total[number] = total.get(number, 0.0) + value
    best = max(total.values(), default=0.0)
    return min(n for n, v in total.items() if v == best) if best > 0 else None


def id_switches(ids: Iterable[int | None]) -> int:
    """Number of changes of the region that covers an object.

    Args:
        ids: For each frame the region id, or None if no region covers the object.

    Returns:
        The number of changes between frames with a region, ignoring gaps.
    """
    present = [i for i in ids if i is not None]
    return sum(a != b for a, b in itertools.pairwise(present))
