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

MIN_SCORED_PX = 500
MIN_COVERING_IOU = 0.5

ObjectOverlaps = Mapping[int, Mapping[str, tuple[int, dict[int, float]]]]
"""Frame -> true object -> (visible pixels, believed object's id -> IoU with it)."""


def overlaps_of(
    mission: Path, labels: Mapping[str, int], recorder: MissionRecorder
) -> ObjectOverlaps:
    """The overlap of recorded objects with the true masks of a mission, frame by frame.

    Raises:
        SettingsError: A mask is missing or cannot be read.
    """
    return {
        index: _overlaps_by_name(mission / "masks" / f"{index:05d}.png", labels, objects)
        for index, objects in recorder.objects_by_frame.items()
    }


def _overlaps_by_name(
    path: Path, labels: Mapping[str, int], objects: Sequence[ObservedObject]
) -> dict[str, tuple[int, dict[int, float]]]:
    mask = cv2.imread(opencv_name(path), cv2.IMREAD_UNCHANGED)
    if mask is None:
        raise SettingsError("a mask is missing or cannot be read", where=str(path))
    return {name: _ious(mask == label, objects) for name, label in labels.items()}


def _ious(true_mask: np.ndarray, objects: Sequence[ObservedObject]) -> tuple[int, dict[int, float]]:
    visible = int(true_mask.sum())
    ious = {}
    for observed in objects:
        x, y, w, h = observed.region.bbox
        intersection = int((true_mask[y : y + h, x : x + w] & observed.region.mask).sum())
        if intersection:
            ious[observed.id] = intersection / (
                visible + int(observed.region.mask.sum()) - intersection
            )
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
    truths: MissionTruth, recorder: MissionRecorder, overlaps: ObjectOverlaps
) -> tuple[int, int]:
    """Number of scored object-frames with the correct first candidate, and of all scored ones."""
    entry_times = {
        name: min(
            (e.time for e in truths.events if e.kind == "entry" and name in e.objects), default=0.0
        )
        for name in truths.names
    }
    times = {
        index: sample.time
        for index, sample in zip(recorder.objects_by_frame, recorder.stages, strict=True)
    }
    correct = scored = 0
    for index, objects in overlaps.items():
        believed = {observed.id: observed.name for observed in recorder.objects_by_frame[index]}
        for name, (visible, ious) in objects.items():
            entry_is_past = (
                name in entry_times and times[index] >= entry_times[name] + UNSCORED_START_S
            )
            if visible < MIN_SCORED_PX or not entry_is_past:
                continue
            scored += 1
            number = max(ious, key=lambda i: ious[i], default=None)
            if number is not None and ious[number] >= MIN_COVERING_IOU:
                correct += believed[number] == truths.names[name]
    return correct, scored


def reported_poses(
    truths: MissionTruth, recorder: MissionRecorder, overlaps: ObjectOverlaps
) -> Poses:
    """Reported poses of visible, correctly identified objects, by frame and object."""
    poses: dict[tuple[int, str], Pose] = {}
    for index, objects in overlaps.items():
        for name, (visible, ious) in objects.items():
            number = max(ious, key=lambda i: ious[i], default=None)
            if visible < MIN_SCORED_PX or number is None:
                continue
            observed = next(o for o in recorder.objects_by_frame[index] if o.id == number)
            if (
                observed.pose is not None
                and observed.name == observed.pose.name == truths.names.get(name)
            ):
                poses[index, name] = observed.pose
    return poses
