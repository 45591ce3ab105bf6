"""Training examples: the cues of every frame of labelled sequences, with ground truth if available."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.evaluation.motion.code_digest import code_digest, files_digest
from visup.evaluation.motion.mask_scores import UNSCORED_LABEL
from visup.evaluation.motion.runner import LabelledSequence, labelled_frames
from visup.evaluation.motion.variants import UNCHANGED
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.foreground.belief import CUES_IN_CONTEXT
from visup.percepts.motion.foreground.cues import NAMES, FrameCues
from visup.percepts.motion.foreground.perceptron import blank_model
from visup.percepts.motion.segmenter import MotionSegmenter

CUE_CODE = ("features", "layers", "tracks", "foreground/cues.py", "foreground/_cues_jit.py")
CODE_FILES = tuple(f"percepts/motion/{part}" for part in CUE_CODE)
MIN_LABELLED_SHARE = 0.1  # share of a frame that must have ground truth


@dataclass(frozen=True, slots=True, eq=False)
class Example:
    """One training frame.

    Attributes:
        cues: Its cues.
        truth: (count,) float32, moving share of each superpixel; None without ground truth.
        scored: (count,) float32, share of each superpixel with ground truth.
    """

    cues: FrameCues
    truth: Floats | None
    scored: Floats


def load_examples(sequence: LabelledSequence, limit: int | None, cache: Path) -> list[Example]:
    """The examples of one sequence, from the cache if available.

    Args:
        sequence: Frames and masks.
        limit: Maximum frames, or None.
        cache: Folder, created if missing.
    """
    digest = hashlib.sha256(code_digest(CODE_FILES))
    digest.update(json.dumps((sequence.name, limit)).encode())
    digest.update(files_digest(sequence))
    file = cache / f"{digest.hexdigest()}.npz"
    return _from_cache(file, lambda: labelled_frames(sequence, UNCHANGED, limit))


Footage = Iterable[tuple[Frame, NDArray[np.uint8] | None]]


def _from_cache(file: Path, footage: Callable[[], Footage]) -> list[Example]:
    if not file.is_file():
        file.parent.mkdir(parents=True, exist_ok=True)
        _write(file, list(_extract_examples(footage())))
    return _read(file)


def _extract_examples(footage: Footage) -> Iterator[Example]:
    """The examples of a video during segmentation."""
    # Cues do not depend on the model.
    segmenter = MotionSegmenter(model=blank_model(len(NAMES), CUES_IN_CONTEXT))
    for frame, labels in footage:
        segmenter.step(frame)
        if segmenter.trace is not None and segmenter.trace.cues is not None:
            cells = segmenter.trace.scene.cells
            truth, scored = _cell_truth(labels, cells.labels, cells.count)
            yield Example(segmenter.trace.cues, truth, scored)


def _cell_truth(
    labels: NDArray[np.uint8] | None, cells: NDArray[np.int32], count: int
) -> tuple[Floats | None, Floats]:
    """Moving share and scored share of each cell, (count,) each; the former is None without ground truth."""
    unlabelled = np.zeros(count, np.float32)
    if labels is None or np.mean(labels != UNSCORED_LABEL) < MIN_LABELLED_SHARE:
        return None, unlabelled
    height, width = cells.shape
    rows = (np.arange(height) + 0.5) * labels.shape[0] / height
    columns = (np.arange(width) + 0.5) * labels.shape[1] / width
    cell_labels = labels[rows.astype(np.int64)[:, None], columns.astype(np.int64)]
    cell_of_pixel = cells.ravel()
    pixels = np.maximum(np.bincount(cell_of_pixel, minlength=count), 1)
    scored = np.bincount(cell_of_pixel, (cell_labels != UNSCORED_LABEL).ravel(), count)
    moving = np.bincount(
        cell_of_pixel, ((cell_labels > 0) & (cell_labels != UNSCORED_LABEL)).ravel(), count
    )
    return (moving / np.maximum(scored, 1)).astype(np.float32), (scored / pixels).astype(np.float32)


_CUE_FIELDS = tuple(f.name for f in fields(FrameCues))
_INDEX_FIELDS = ("here", "there", "neighbours", "part")


def _write(file: Path, examples: Sequence[Example]) -> None:
    arrays: dict[str, NDArray[np.generic]] = {}
    for number, example in enumerate(examples):
        for part in _CUE_FIELDS:
            value = getattr(example.cues, part)
            arrays[f"{number} {part}"] = value.astype(np.uint16) if part in _INDEX_FIELDS else value
        arrays[f"{number} scored"] = example.scored
        if example.truth is not None:
            arrays[f"{number} truth"] = example.truth
    unfinished = file.with_suffix(".part.npz")
    np.savez(unfinished, allow_pickle=False, **arrays)
    unfinished.replace(file)


def _read(file: Path) -> list[Example]:
    with np.load(file) as arrays:
        stored = dict(arrays)
    count = sum(name.endswith(" scored") for name in stored)
    examples = []
    for number in range(count):
        values = {part: stored[f"{number} {part}"] for part in _CUE_FIELDS}
        cues = FrameCues(
            **{k: v.astype(np.int32) if k in _INDEX_FIELDS else v for k, v in values.items()}
        )
        examples.append(Example(cues, stored.get(f"{number} truth"), stored[f"{number} scored"]))
    return examples
