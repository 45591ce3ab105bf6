"""`visup eval motion`: segments sequences with known truth, and scores the regions.

The segmenter sees frames only; masks, boxes and `truth.json` are used only for scoring.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame, Region
from visup.agent.model.errors import SettingsError, SourceError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.motion.mask_pairs import mask_pairs
from visup.evaluation.motion.mask_scores import (
    UNSCORED_LABEL,
    MaskOverlaps,
    PixelCounts,
    boundary_measure,
    has_ghost,
    object_scores,
    overlaps_of,
    region_similarity,
)
from visup.evaluation.motion.mot_scores import Box, mot_scores, read_truth, truth_of_images
from visup.evaluation.motion.variants import UNCHANGED, Variant
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.percepts.opencv_names import opencv_name
from visup.percepts.video import open_source
from visup.percepts.video.image_folder import images_in

TOTAL_KEYS = (
    "J",
    "F",
    "f_measure",
    "J_object",
    "ghost",
    "id_switches",
    "mota",
    "idf1",
    "ms",
    "ratio",
)


@dataclass(frozen=True, slots=True)
class LabelledSequence:
    """One sequence to score.

    Attributes:
        name: Path below the given folder.
        source: Video source.
        masks: Index of a frame -> its mask, for frames with truth; empty for MOT folders.
        truth: `truth.json` of a mission, or None.
        boxes: MOT ground truth, or None.
    """

    name: str
    source: Path
    masks: Mapping[int, Path] = field(default_factory=dict)
    truth: Path | None = None
    boxes: Path | None = None


@dataclass(slots=True)
class SequenceMeasurements:
    """Measurements over the frames of one sequence."""

    j: list[float] = field(default_factory=list)
    f: list[float] = field(default_factory=list)
    pixels: PixelCounts = field(default_factory=PixelCounts)
    ghosts: list[bool] = field(default_factory=list)
    overlaps: list[MaskOverlaps] = field(default_factory=list)
    boxes: dict[int, dict[int, Box]] = field(default_factory=dict)
    ms: list[float] = field(default_factory=list)
    dis_ms: list[float] = field(default_factory=list)


def evaluate_motion(
    folder: Path,
    *,
    every: int = 1,
    limit: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Score the segmenter on every sequence below a folder.

    Args:
        folder: Holds sequences (`<seq>/frames` with `<seq>/masks`), missions (`video.mp4`, `masks`,
            `truth.json`), MOT folders (`img1`, `gt`), or is one of these.
        every: Use every n-th frame only.
        limit: Maximum frames of each sequence, or None for all.
        progress: Shows what is being done.

    Returns:
        `total` and `items` by name, with the keys J, F, f_measure (of pixels, as in CDnet), J_object,
        ghost, id_switches, mota, idf1, ms and ratio; a key is absent without such truth. A
        mission's item also has `objects`: J and id switches of each.

    Raises:
        SettingsError: There is nothing to score below the folder.
        SourceError: A sequence cannot be read.
        ExtraMissingError: There are MOT folders and `motmetrics` is not installed.
    """
    items: dict[str, dict[str, Any]] = {}
    for sequence in find_sequences(folder):
        progress(sequence.name)
        items[sequence.name] = score_sequence(sequence, every=every, limit=limit)
    return {"total": _total(list(items.values())), "items": items}


def score_sequence(
    sequence: LabelledSequence,
    *,
    every: int = 1,
    limit: int | None = None,
    settings: MotionSettings | None = None,
    variant: Variant = UNCHANGED,
) -> dict[str, Any]:
    """The figures of one sequence.

    Args:
        sequence: The sequence.
        every: Use every n-th frame only.
        limit: Maximum frames before a variant leaves out some, or None for all.
        settings: Settings of the segmenter; None for the defaults.
        variant: The variant.

    Returns:
        As an item of `evaluate_motion`.
    """
    if limit is not None:
        limit = max(1, limit // variant.every)
    frames = _frames(sequence, every * variant.every, limit)
    return _scores(sequence, _segment(sequence, frames, MotionSegmenter(settings), variant))


def find_sequences(folder: Path) -> list[LabelledSequence]:
    """Everything below a folder that can be scored, by name.

    Raises:
        SettingsError: There is nothing.
    """
    if not folder.is_dir():
        raise SettingsError("there is no such folder", where=str(folder))
    folders = [folder, *sorted(p for p in folder.rglob("*") if p.is_dir())]
    sequences = []
    for subfolder in folders:
        name = subfolder.name if subfolder == folder else str(subfolder.relative_to(folder))
        masks = tuple(sorted((subfolder / "masks").glob("*.png")))
        if (subfolder / "frames").is_dir() and masks:
            source = subfolder / "frames"
            sequences.append(LabelledSequence(name, source, mask_pairs(source, masks)))
        elif (subfolder / "video.mp4").is_file() and masks and (subfolder / "truth.json").is_file():
            truth, source = subfolder / "truth.json", subfolder / "video.mp4"
            sequences.append(LabelledSequence(name, source, mask_pairs(source, masks), truth))
        elif (subfolder / "img1").is_dir() and (subfolder / "gt" / "gt.txt").is_file():
            sequences.append(LabelledSequence(name, subfolder, boxes=subfolder / "gt" / "gt.txt"))
    if not sequences:
        raise SettingsError(
            "nothing to score was found",
            where=str(folder),
            expected="folders with frames and masks, missions, or MOT folders",
        )
    return sequences


def labelled_frames(
    sequence: LabelledSequence, variant: Variant, limit: int | None = None
) -> Iterator[tuple[Frame, NDArray[np.uint8] | None]]:
    """The frames of a sequence under a variant, each with its mask or None.

    Args:
        sequence: Frames and masks.
        variant: The variant.
        limit: Maximum frames before the variant leaves out some, or None for all.
    """
    limit = None if limit is None else max(1, limit // variant.every)
    for frame, _ in _frames(sequence, variant.every, limit):
        mask = sequence.masks.get(frame.index)
        yield (
            variant.apply(frame),
            None if mask is None else variant.labels(_labels(mask, frame.size)),
        )


def _segment(
    sequence: LabelledSequence,
    frames: Iterable[tuple[Frame, bool]],
    segmenter: MotionSegmenter,
    variant: Variant,
) -> SequenceMeasurements:
    """Segment one sequence and collect the measurements."""
    measurements = SequenceMeasurements()
    names = _read_mission_truth(sequence).get("labels", {})
    optical_flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
    previous: NDArray[np.uint8] | None = None
    for number, (original, last) in enumerate(frames):
        frame = variant.apply(original)
        start = time.perf_counter()
        regions = segmenter.step(frame)
        measurements.ms.append(1e3 * (time.perf_counter() - start))
        grey = np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
        if previous is not None:
            start = time.perf_counter()
            optical_flow.calc(previous, grey, None)  # type: ignore[call-overload]
            measurements.dis_ms.append(1e3 * (time.perf_counter() - start))
        previous = grey
        measurements.boxes[frame.index] = {r.id: _box(r) for r in regions}
        if frame.index in sequence.masks:
            labels = variant.labels(_labels(sequence.masks[frame.index], original.size))
            masks = {r.id: r.full_mask(frame.size) for r in regions}
            _measure_masks(measurements, labels, masks, inner=number > 0 and not last)
            if names:
                overlaps = overlaps_of(frame.index, frame.time, labels, names, masks)
                measurements.overlaps.append(overlaps)
    return measurements


def _frames(
    sequence: LabelledSequence, every: int, limit: int | None
) -> Iterator[tuple[Frame, bool]]:
    """Frames with a flag for the last."""
    with open_source(str(sequence.source), every=every) as source:
        pending: Frame | None = None
        for count, frame in enumerate(source):
            if limit is not None and count >= limit:
                break
            if pending is not None:
                yield pending, False
            pending = frame
        if pending is not None:
            yield pending, True


def _labels(path: Path, size: tuple[int, int]) -> NDArray[np.uint8]:
    labels = cv2.imread(opencv_name(path), cv2.IMREAD_UNCHANGED)
    if labels is None:
        raise SourceError("this mask cannot be read", where=str(path), expected="an 8-bit PNG")
    if labels.ndim == 3:
        labels = labels[..., 0]
    if labels.shape != size[::-1]:
        raise SourceError(
            f"this mask has {labels.shape[1]} x {labels.shape[0]} pixels",
            where=str(path),
            expected=f"{size[0]} x {size[1]} as its frame",
        )
    return np.asarray(labels, dtype=np.uint8)


def _box(region: Region) -> Box:
    x, y, w, h = region.bbox
    return float(x), float(y), float(w), float(h)


def _measure_masks(
    measurements: SequenceMeasurements,
    labels: NDArray[np.uint8],
    masks: Mapping[int, NDArray[np.bool_]],
    *,
    inner: bool,
) -> None:
    """Add pixel counts and ghosts of a frame, and J and F unless it is the first or last."""
    scored = labels != UNSCORED_LABEL
    ground_truth = (labels > 0) & scored
    predicted = np.zeros(labels.shape, dtype=bool)
    for mask in masks.values():
        predicted |= mask
    j = region_similarity(predicted, ground_truth, scored)
    if j is None:
        return
    measurements.pixels = measurements.pixels.with_frame(predicted, ground_truth, scored)
    if inner:
        measurements.j.append(j)
        measurements.f.append(boundary_measure(predicted & scored, ground_truth))
    values = [v for v in np.unique(labels).tolist() if v != 0]
    # Unscored pixels may be objects: a region there is no ghost.
    measurements.ghosts.append(has_ghost(masks.values(), [labels == v for v in values]))


def _read_mission_truth(sequence: LabelledSequence) -> dict[str, Any]:
    return dict(json.loads(sequence.truth.read_text())) if sequence.truth else {}


def _scores(sequence: LabelledSequence, measurements: SequenceMeasurements) -> dict[str, Any]:
    """The figures of one sequence."""
    scores: dict[str, Any] = {}
    if measurements.j:
        scores |= {"J": statistics.fmean(measurements.j), "F": statistics.fmean(measurements.f)}
        scores["f_measure"] = measurements.pixels.f_measure
    if measurements.ghosts:
        scores["ghost"] = statistics.fmean(measurements.ghosts)
    if sequence.truth is not None:
        events = _read_mission_truth(sequence).get("events", ())
        coupled = [
            (int(e["frame"]), frozenset(e["objects"])) for e in events if e["kind"] == "coupled"
        ]
        objects = object_scores(measurements.overlaps, coupled)
        if objects:
            scores["J_object"] = statistics.fmean(s.j for s in objects.values())
            scores["id_switches"] = sum(s.switches for s in objects.values())
            scores["objects"] = {
                n: {"J": s.j, "id_switches": s.switches} for n, s in objects.items()
            }
    if sequence.boxes is not None:
        truth = truth_of_images(read_truth(sequence.boxes), images_in(sequence.source / "img1"))
        scores |= mot_scores(truth, measurements.boxes)
    scores["ms"] = statistics.median(measurements.ms)
    if measurements.dis_ms:
        scores["ratio"] = scores["ms"] / statistics.median(measurements.dis_ms)
    return scores


def _total(items: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means over the sequences with a figure; id switches are summed."""
    total: dict[str, Any] = {}
    for key in TOTAL_KEYS:
        values = [item[key] for item in items if key in item]
        if values:
            total[key] = sum(values) if key == "id_switches" else statistics.fmean(values)
    return total
