"""Networks of the YOLO family: preparing a frame as input, and decoding boxes from the output."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from visup.percepts.detections.boxes import Detection

GREY = 114
"""Padding around the image: the grey that these networks were trained with."""

MIN_SCORE, MAX_OVERLAP = 0.25, 0.45
"""Least score of a box, and most overlap of two boxes of a class (non-maximum suppression)."""

CHOSEN_COLUMNS = 6


class Layout(Enum):
    """The meaning of a candidate's columns."""

    CLASSES = "middle and size, a score for each class"
    ANYTHING = "middle and size, a score that there is anything, a score for each class"
    CHOSEN = "corners, score, number of the class"


@dataclass(frozen=True, slots=True)
class Letterbox:
    """The fit of an image into the input of a network.

    Attributes:
        scale: Pixels of the network per pixel of the image.
        left: Padding at the left, pixels.
        top: Padding at the top, pixels.
    """

    scale: float
    left: int
    top: int

    def back(self, boxes: NDArray[np.float32]) -> NDArray[np.float32]:
        """Corners (N, 4) x1, y1, x2, y2 in pixels of the image."""
        moved = boxes - np.array([self.left, self.top] * 2, np.float32)
        return (moved / self.scale).astype(np.float32)


def letterbox(
    image: NDArray[np.uint8], size: tuple[int, int]
) -> tuple[NDArray[np.float32], Letterbox]:
    """An image as network input: scaled to fit, padded with grey, RGB, 0 to 1.

    Args:
        image: (H, W, 3) uint8 BGR.
        size: (width, height) of the network's input.

    Returns:
        (1, 3, height, width) float32, and the fit.
    """
    import cv2

    height, width = image.shape[:2]
    scale = min(size[0] / width, size[1] / height)
    fitted = round(width * scale), round(height * scale)
    left, top = (size[0] - fitted[0]) // 2, (size[1] - fitted[1]) // 2
    canvas = np.full((size[1], size[0], 3), GREY, np.uint8)
    canvas[top : top + fitted[1], left : left + fitted[0]] = cv2.resize(image, fitted)
    blob = canvas[:, :, ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255.0
    return np.ascontiguousarray(blob), Letterbox(scale, left, top)


def decode_yolo(
    output: NDArray[np.floating],
    names: Sequence[str] = (),
    fitted: Letterbox = Letterbox(1.0, 0, 0),  # frozen
    *,
    least_score: float = MIN_SCORE,
    most_overlap: float = MAX_OVERLAP,
) -> tuple[Detection, ...]:
    """Decode the boxes of one image from a network's output.

    Known layouts, with C classes and N candidates:

    - (1, 4 + C, N): v8, v9, v11, v12: centre and size, then a score for each class.
    - (1, N, 5 + C): v3, v5, v6, v7 and YOLOX with its grid decoded: also an objectness score.
    - (1, N, 6): v10, v26 and others without suppression: corners, score, class.

    The layout is inferred from the shape, and from the number of names where known; without names the longer
    side is taken for the candidates, and rows for the older layout.

    Args:
        output: The array, with or without the leading 1.
        names: Class names, where known.
        fitted: The fit of the image, from `letterbox`.
        least_score: Boxes below are dropped.
        most_overlap: Of two boxes of one class that overlap more, the lower-scored is dropped.

    Returns:
        The boxes without numbers, image pixels, highest score first.

    Raises:
        ValueError: The array's shape fits no known layout.
    """
    rows, layout = _rows(np.asarray(output, np.float32), len(names))
    if layout is Layout.CHOSEN:
        corners, scores, classes = rows[:, :4], rows[:, 4], rows[:, 5].astype(np.int64)
        keep = np.flatnonzero(scores >= least_score)
        keep = keep[np.argsort(-scores[keep], kind="stable")]
    else:
        corners, scores, classes = _scored(rows, layout)
        keep = _suppressed(corners, scores, classes, least_score, most_overlap)
    corners = fitted.back(corners)
    return tuple(_detection(corners[k], float(scores[k]), int(classes[k]), names) for k in keep)


def _rows(output: NDArray[np.float32], classes: int) -> tuple[NDArray[np.float32], Layout]:
    """Candidates as rows, and their layout."""
    if output.ndim == 3 and output.shape[0] == 1:
        output = output[0]
    if output.ndim != 2 or (output.shape[1] < 5 and output.shape[0] < 5):
        raise ValueError(f"an array of shape {output.shape} is not one of YOLO's layouts")
    if _chosen(output):
        return output, Layout.CHOSEN
    known = {5 + classes: Layout.ANYTHING, 4 + classes: Layout.CLASSES} if classes else {}
    if output.shape[1] in known:
        return output, known[output.shape[1]]
    if output.shape[0] in known:
        return output.T, known[output.shape[0]]
    if output.shape[0] < output.shape[1]:
        return output.T, Layout.CLASSES
    return output, Layout.ANYTHING


def _chosen(output: NDArray[np.float32]) -> bool:
    """Whether rows are corners, a score and a class number, which unlike a score is an integer."""
    if output.shape[1] != CHOSEN_COLUMNS:
        return False
    ordered = (output[:, 2] >= output[:, 0]) & (output[:, 3] >= output[:, 1])
    whole = output[:, 5] == np.round(output[:, 5])
    return bool((ordered & whole).all())


def _scored(
    rows: NDArray[np.float32], layout: Layout
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    """Corners, scores and classes of candidates given by their centres."""
    middle, half = rows[:, :2], rows[:, 2:4] / 2
    corners = np.hstack([middle - half, middle + half]).astype(np.float32)
    of_each = rows[:, 4:] if layout is Layout.CLASSES else rows[:, 5:] * rows[:, 4:5]
    best = of_each.argmax(axis=1)
    return corners, of_each[np.arange(len(rows)), best], best


def _suppressed(
    corners: NDArray[np.float32],
    scores: NDArray[np.float32],
    classes: NDArray[np.int64],
    least: float,
    most: float,
) -> NDArray[np.int64]:
    """Indices of the remaining candidates, highest score first."""
    import cv2

    boxes = np.hstack([corners[:, :2], corners[:, 2:] - corners[:, :2]])
    kept = cv2.dnn.NMSBoxesBatched(boxes.tolist(), scores.tolist(), classes.tolist(), least, most)
    places = np.asarray(kept, np.int64).reshape(-1)
    return places[np.argsort(-scores[places], kind="stable")]


def _detection(
    corners: NDArray[np.float32], score: float, number: int, names: Sequence[str]
) -> Detection:
    left, top, right, bottom = (float(v) for v in corners)
    name = names[number] if 0 <= number < len(names) else f"class {number}"
    return Detection(0, (left, top, right - left, bottom - top), min(1.0, score), name)
