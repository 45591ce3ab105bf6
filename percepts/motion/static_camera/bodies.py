"""People who walk side by side in one blob: taken apart where heads part, by how wide a body is.

A blob as wide as two or three upright bodies, with a notch from above between them, is cut there. How wide a
body is for its height follows from those that were followed by themselves, and from what people are.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.static_camera.blob_track import (
    BlobTrack,
    Foreground,
    Labels,
    Mask,
    crop,
    template_window,
)

SLENDER = 0.4  # width of a body as a share of its height, where nothing else is known
UPRIGHT = 0.65  # the same, at most
KNOWN_FRAMES = 5  # frames after which a body that stood alone tells how wide bodies are
WIDE = 1.6  # bodies' widths from which a blob may hold two
MOST = 3  # bodies in one blob
APART = 2  # frames apart from others after which one is known by itself
THIN_PX = 4  # a body that is less wide is a speck
NOTCH = (
    0.86  # height of the outline between two bodies, as a share of the lower: shoulders are at 0.82
)
ALIKE = 0.6  # height of the lower of two bodies, as a share of the higher
WHOLE = 0.6  # width of a piece, as a share of a body's, that is more than half of one
AROUND = 0.3  # how far from even shares bodies may part, as a share of a body's width


def with_bodies_apart(view: Foreground, tracks: Sequence[BlobTrack], slender: float) -> Foreground:
    """A frame in which each body of those that walk side by side is a blob of its own.

    Args:
        view: The frame.
        tracks: What is followed, where it is expected in this frame; blobs that two of them share are left to
            their templates.
        slender: Width of a body as a share of its height.
    """
    labels, count = view.labels, view.count
    for blob, box in enumerate(find_objects(view.labels), start=1):
        mask = view.labels[box] == blob
        if mask.shape[1] < WIDE * slender * mask.shape[0] or _shared(blob, view.labels, tracks) > 1:
            continue
        columns = parting_columns(mask, slender)
        if not columns:
            continue
        labels = labels.copy() if labels is view.labels else labels
        here = labels[box]
        for column in columns:
            count += 1
            here[:, column:][mask[:, column:]] = count
    return view if labels is view.labels else replace(view, labels=labels, count=count)


def body_width(tracks: Sequence[BlobTrack]) -> float:
    """Width of a body as a share of its height: the median of those that stand alone, and of people."""
    alone = [
        s.shape.shape[1] / s.shape.shape[0]
        for s in tracks
        if s.id and not s.merged and not s.cut and s.isolated_frames >= KNOWN_FRAMES
    ]
    return float(np.median([SLENDER, SLENDER, *(r for r in alone if r <= UPRIGHT)]))


def parting_columns(mask: Mask, slender: float) -> tuple[int, ...]:
    """The columns at which the second and further bodies of a blob begin; none where it is one.

    Args:
        mask: (h, w) bool, the blob in its box.
        slender: Width of a body as a share of its height.
    """
    height, width = mask.shape
    bodies = min(round(width / (slender * height)), MOST)
    if bodies < 2 or not THIN_PX * bodies <= width <= UPRIGHT * height * bodies:
        return ()
    tops = _heights(mask)
    reach = max(1, round(AROUND * width / bodies))
    columns = []
    for k in range(1, bodies):
        middle = round(k * width / bodies)
        first = max(1, middle - reach)
        part = tops[first : min(width - 1, middle + reach + 1)]
        columns.append(first + int(np.argmin(part)))
    edges = [0, *columns, width]
    peaks = [int(tops[a:b].max()) for a, b in pairwise(edges)]
    for k, column in enumerate(columns):
        low, high = sorted((peaks[k], peaks[k + 1]))
        if low < ALIKE * high or tops[column] > NOTCH * low:
            return ()
    return tuple(columns)


def are_bodies(a: Mask, b: Mask, slender: float) -> bool:
    """Whether two pieces of an outline are bodies side by side, and no halves of one behind a post.

    Args:
        a: (h, w) bool.
        b: (h, w) bool, of the same image.
        slender: Width of a body as a share of its height.
    """
    (_, ay, aw, ah), (_, by, bw, bh) = (cv2.boundingRect(m.view(np.uint8)) for m in (a, b))
    slim = all(WHOLE * slender * h <= w <= UPRIGHT * h for w, h in ((aw, ah), (bw, bh)))
    common = min(ay + ah, by + bh) - max(ay, by)
    return slim and common >= ALIKE * max(ah, bh)


def _heights(mask: Mask) -> NDArray[np.int64]:
    """How high above the lowest row of the box each column of a blob begins, pixels, smoothed over three."""
    rows = mask.shape[0]
    tops = np.where(mask.any(axis=0), rows - mask.argmax(axis=0), 0)
    return np.asarray(np.median([np.roll(tops, 1), tops, np.roll(tops, -1)], axis=0), np.int64)


def _shared(blob: int, labels: Labels, tracks: Sequence[BlobTrack]) -> int:
    """How many that were seen apart are expected in a blob."""
    count = 0
    for s in tracks:
        at, own = template_window(s, labels.shape)
        inside = int(np.count_nonzero(crop(s.shape, own) & (crop(labels, at) == blob)))
        known = s.isolated_frames >= APART
        count += int(known and 2 * inside > int(np.count_nonzero(s.shape)))
    return count
