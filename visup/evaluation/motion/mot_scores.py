"""Scores of MOT folders by the `motmetrics` library: MOTA and IDF1 of region boxes."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import ExtraMissingError, SourceError
from visup.evaluation.motion.mask_pairs import last_number

Box = tuple[float, float, float, float]
Boxes = Mapping[int, Box]


def read_truth(path: Path) -> dict[int, dict[int, Box]]:
    """Boxes of a MOT ground truth file.

    Args:
        path: `gt.txt`, one line for each box: frame (from 1), id, x, y, width, height, active, ...

    Returns:
        Frame number from 0 -> id -> (x, y, width, height), pixels; boxes not active left out.

    Raises:
        SourceError: A line is malformed.
    """
    truth: dict[int, dict[int, Box]] = {}
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if not line.strip():
            continue
        try:
            values = [float(v) for v in line.split(",")]
            x, y, w, h = values[2:6]
        except ValueError as error:
            raise SourceError(
                "this is not a line of a MOT ground truth",
                where=f"{path}:{number}",
                expected="frame, id, x, y, width, height, ...",
            ) from error
        if len(values) < 7 or values[6] != 0:
            truth.setdefault(int(values[0]) - 1, {})[int(values[1])] = (x, y, w, h)
    return truth


def truth_of_images(
    truth: Mapping[int, dict[int, Box]], images: Sequence[Path]
) -> dict[int, dict[int, Box]]:
    """Truth by the index of each image, matched by the numbers in their names.

    Args:
        truth: Frame number from 0 -> id -> box.
        images: The images in order.

    Raises:
        SourceError: The truth has a frame without an image.
    """
    numbers = [last_number(image) - 1 for image in images]
    if min(numbers, default=0) < -1 or len(set(numbers)) < len(
        numbers
    ):  # names without usable numbers: by order
        numbers = list(range(len(images)))
    index_of = {number: index for index, number in enumerate(numbers)}
    for frame in truth:
        if frame not in index_of:
            raise SourceError(
                f"there is no image of frame {frame + 1}, of which the truth tells",
                where=str(images[0].parent) if images else "",
                expected="an image with the number of each frame, from 1, in its name",
            )
    return {index_of[frame]: boxes for frame, boxes in truth.items()}


def box_distance(ground_truth: Sequence[Box], predicted: Sequence[Box]) -> NDArray[np.float64]:
    """1 - IoU of boxes (x, y, w, h), (len(true), len(seen)); nan where IoU is below 0.5."""
    a = np.asarray(ground_truth, dtype=np.float64).reshape(-1, 1, 4)
    b = np.asarray(predicted, dtype=np.float64).reshape(1, -1, 4)
    top_left = np.maximum(a[..., :2], b[..., :2])
    bottom_right = np.minimum(a[..., :2] + a[..., 2:], b[..., :2] + b[..., 2:])
    intersection = np.prod(np.clip(bottom_right - top_left, 0, None), axis=-1)
    union = np.prod(a[..., 2:], axis=-1) + np.prod(b[..., 2:], axis=-1) - intersection
    iou = intersection / np.maximum(union, 1e-9)
    return np.where(iou >= 0.5, 1 - iou, np.nan)


def mot_scores(ground_truth: Mapping[int, Boxes], predicted: Mapping[int, Boxes]) -> dict[str, Any]:
    """MOTA and IDF1 at IoU 0.5.

    Args:
        ground_truth: Frame -> id -> box.
        predicted: Frame -> region id -> box; its frames are scored.

    Returns:
        `mota`, `idf1` and `id_switches`.

    Raises:
        ExtraMissingError: The library is not installed.
    """
    try:
        import motmetrics
    except ImportError as error:
        raise ExtraMissingError("scoring MOT folders", "eval") from error
    # The library's own use of NumPy and pandas causes warnings.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        accumulator = motmetrics.MOTAccumulator(auto_id=True)
        for frame in sorted(predicted):
            objects, regions = ground_truth.get(frame, {}), predicted[frame]
            distance = box_distance(list(objects.values()), list(regions.values()))
            accumulator.update(list(objects), list(regions), distance)
        table = motmetrics.metrics.create().compute(
            accumulator, metrics=["mota", "idf1", "num_switches"], name="all"
        )
    row = table.loc["all"]
    return {
        "mota": float(row["mota"]),
        "idf1": float(row["idf1"]),
        "id_switches": int(row["num_switches"]),
    }
