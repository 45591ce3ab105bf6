"""Overlap of believed objects with true masks: correspondence, identity, pose."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from visup.agent import Pose
from visup.agent.model.errors import SettingsError
from visup.evaluation.missions.pose_errors import Poses
from visup.evaluation.missions.recorder import MissionRecorder, ObservedObject
from visup.evaluation.missions.scores import UNSCORED_START_S, MissionTruth
from visup.percepts.opencv_names import opencv_name

SMALLEST_SCORED_PX = 500
COVERING_IOU = 0.5

ObjectOverlaps = Mapping[int, Mapping[str, tuple[int, dict[int, float]]]]
"""Frame -> true object -> (visible pixels, believed object's id -> IoU with it)."""


def overlaps_of(
    mission: Path, labels: Mapping[str, int], record: MissionRecorder
) -> ObjectOverlaps:
    """The overlap of recorded objects with the true masks of a mission, frame by frame.

    Raises:
        SettingsError: A mask is missing or cannot be read.
    """
    return {
        index: _overlaps_by_name(mission / "masks" / f"{index:05d}.png", labels, seen)
        for index, seen in record.seen.items()
    }


def _overlaps_by_name(
    path: Path, labels: Mapping[str, int], seen: Sequence[ObservedObject]
) -> dict[str, tuple[int, dict[int, float]]]:
    mask = cv2.imread(opencv_name(path), cv2.IMREAD_UNCHANGED)
    if mask is None:
        raise SettingsError("a mask is missing or cannot be read", where=str(path))
    return {name: _ious(mask == label, seen) for name, label in labels.items()}


def _ious(true: np.ndarray, seen: Sequence[ObservedObject]) -> tuple[int, dict[int, float]]:
    visible = int(true.sum())
    ious = {}
    for it in seen:
        x, y, w, h = it.region.bbox
        both = int((true[y : y + h, x : x + w] & it.region.mask).sum())
        if both:
            ious[it.id] = both / (visible + int(it.region.mask.sum()) - both)
    return visible, ious


def true_names(overlaps: ObjectOverlaps) -> dict[int, str]:
    """Believed object's id -> the true object that it overlaps most over the whole mission."""
    weight: Counter[tuple[int, str]] = Counter()
    for objects in overlaps.values():
        for name, (_, ious) in objects.items():
            for number, iou in ious.items():
                weight[number, name] += iou  # type: ignore[assignment]  # a counter of shares
    best: dict[int, tuple[float, str]] = {}
    for (number, name), total in sorted(weight.items()):
        if total > best.get(number, (0.0, ""))[0]:
            best[number] = (total, name)
    return {number: name for number, (_, name) in best.items()}


def identity_counts(
    truths: MissionTruth, record: MissionRecorder, overlaps: ObjectOverlaps
) -> tuple[int, int]:
    """Number of scored object-frames with the correct first candidate, and of all scored ones."""
    entered = {
        name: min(
            (e.time for e in truths.events if e.kind == "entry" and name in e.objects), default=0.0
        )
        for name in truths.names
    }
    times = {index: sample.time for index, sample in zip(record.seen, record.stages, strict=True)}
    right = scored = 0
    for index, objects in overlaps.items():
        believed = {it.id: it.name for it in record.seen[index]}
        for name, (visible, ious) in objects.items():
            late = name in entered and times[index] >= entered[name] + UNSCORED_START_S
            if visible < SMALLEST_SCORED_PX or not late:
                continue
            scored += 1
            number = max(ious, key=lambda i: ious[i], default=None)
            if number is not None and ious[number] >= COVERING_IOU:
                right += believed[number] == truths.names[name]
    return right, scored


def reported_poses(
    truths: MissionTruth, record: MissionRecorder, overlaps: ObjectOverlaps
) -> Poses:
    """Reported poses of visible, correctly identified objects, by frame and object."""
    found: dict[tuple[int, str], Pose] = {}
    for index, objects in overlaps.items():
        for name, (visible, ious) in objects.items():
            number = max(ious, key=lambda i: ious[i], default=None)
            if visible < SMALLEST_SCORED_PX or number is None:
                continue
            it = next(s for s in record.seen[index] if s.id == number)
            if it.pose is not None and it.name == it.pose.name == truths.names.get(name):
                found[index, name] = it.pose
    return found
