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
UNSCORED = 128
TOLERANCE = 0.008
SMALLEST_SCORED_PX = 500
GHOST_OVERLAP = 0.1
MATCH_IOU = 0.5
START_S = 2.0


def iou(a: Mask, b: Mask) -> float:
    """Intersection over union of two (H, W) masks; 1 when both are empty."""
    union = int(np.count_nonzero(a | b))
    return int(np.count_nonzero(a & b)) / union if union else 1.0


def region_similarity(seen: Mask, true: Mask, scored: Mask) -> float | None:
    """J of one frame.

    Args:
        seen: (H, W) bool, union of all regions.
        true: (H, W) bool, union of all objects.
        scored: (H, W) bool, where pixels are scored.

    Returns:
        0 to 1, or None when no pixel is scored.
    """
    if not scored.any():
        return None
    return iou(seen & scored, true & scored)


def boundary_measure(seen: Mask, true: Mask, tolerance: float = TOLERANCE) -> float:
    """F of one frame: how well two outlines agree, as DAVIS defines it.

    Args:
        seen: (H, W) bool.
        true: (H, W) bool.
        tolerance: How far a boundary pixel may lie off, share of the image diagonal.

    Returns:
        0 to 1; 1 when both are empty.
    """
    reach = math.ceil(tolerance * math.hypot(*seen.shape))
    a, b = boundary(seen), boundary(true)
    near_a, near_b = _grown(a, reach), _grown(b, reach)
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


def _grown(mask: Mask, radius: int) -> Mask:
    ys, xs = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    disk = (xs * xs + ys * ys <= radius * radius).astype(np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), disk) > 0)


@dataclass(frozen=True, slots=True)
class PixelCounts:
    """Pixels over all frames of a sequence, as CDnet counts them (Goyette et al. 2012).

    Attributes:
        right: True positives.
        false: False positives.
        missed: False negatives.
    """

    right: int = 0
    false: int = 0
    missed: int = 0

    def with_frame(self, seen: Mask, true: Mask, scored: Mask) -> PixelCounts:
        """Add the scored pixels of a frame."""
        right = int(np.count_nonzero(seen & true & scored))
        return PixelCounts(
            self.right + right,
            self.false + int(np.count_nonzero(seen & scored)) - right,
            self.missed + int(np.count_nonzero(true & scored)) - right,
        )

    @property
    def f_measure(self) -> float:
        """Harmonic mean of precision and recall, 0 to 1; 1 without truth and detections."""
        pixels = 2 * self.right + self.false + self.missed
        return 2 * self.right / pixels if pixels else 1.0


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
        both = sum(v for (i, n), v in self.common.items() if i in ids and n in names)
        seen = sum(v for i, v in self.regions.items() if i in ids)
        true = sum(v for n, v in self.objects.items() if n in names)
        return both / (seen + true - both) if seen + true - both else 0.0

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
    apart, joined = _periods(frames, names, coupled)
    best = {n: best_region([f.iou_by_region(n) for f in apart[n]]) for n in names}
    out = {}
    for name in names:
        own = [i for i in (best[name],) if i is not None]
        values = [f.iou(own, (name,)) for f in apart[name]]
        switches = id_switches(f.covering((name,)) for f in apart[name])
        for group, together in joined[name].items():
            values += _together(together, group, {best[n] for n in group} - {None})
            switches += id_switches(f.covering(group) for f in together)
        if values:
            out[name] = ObjectScore(sum(values) / len(values), switches)
    return out


def _periods(
    frames: Sequence[MaskOverlaps],
    names: Sequence[str],
    coupled: Sequence[tuple[int, frozenset[str]]],
) -> tuple[dict[str, list[MaskOverlaps]], dict[str, dict[frozenset[str], list[MaskOverlaps]]]]:
    """Scored frames of each object: by itself, and coupled."""
    apart: dict[str, list[MaskOverlaps]] = {n: [] for n in names}
    joined: dict[str, dict[frozenset[str], list[MaskOverlaps]]] = {n: {} for n in names}
    entered: dict[str, float] = {}
    for frame in frames:
        for name in names:
            if frame.objects.get(name, 0) < SMALLEST_SCORED_PX:
                continue
            if frame.time < entered.setdefault(name, frame.time) + START_S:
                continue
            groups = [g for at, g in coupled if name in g and frame.index >= at]
            if groups:
                joined[name].setdefault(groups[-1], []).append(frame)
            else:
                apart[name].append(frame)
    return apart, joined


def _together(
    frames: Sequence[MaskOverlaps], group: frozenset[str], own: set[int | None]
) -> list[float]:
    ids = [i for i in own if i is not None]
    theirs = [f.iou(ids, group) for f in frames]
    single = best_region([{i: f.iou((i,), group) for i in f.regions} for f in frames])
    one = [f.iou((single,), group) if single else 0.0 for f in frames]
    return max(theirs, one, key=sum)


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
    known = [i for i in ids if i is not None]
    return sum(a != b for a, b in itertools.pairwise(known))
