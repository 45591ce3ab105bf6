"""Splits a blob of people who walk side by side, at the notches between their heads.

A blob as wide as two or three upright bodies, with a notch from above between them, is cut there. The width
of a body relative to its height is estimated from isolated tracks and a prior for people.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

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

SLENDER = 0.4  # prior for the width of a body, as a share of its height
UPRIGHT = 0.65  # greatest width of a body, as a share of its height
KNOWN_FRAMES = 5  # isolated frames after which a track is used to estimate the width of bodies
WIDE = 1.6  # least width of a blob of two bodies, in widths of a body
MOST = 3  # bodies in one blob
APART = 2  # isolated frames after which a track is an object of its own
THIN_PX = 4  # least width of a body, pixels
NOTCH = 0.86  # greatest height of the notch, as a share of the shorter body: shoulders are at 0.82
ALIKE = 0.6  # least height of the shorter of two bodies, as a share of the taller
WHOLE = 0.6  # least width of a piece that counts as a body, as a share of a body's width
AROUND = 0.3  # search range of a cut about the equal division, as a share of a body's width


def split_people(view: Foreground, tracks: Sequence[BlobTrack], slender: float) -> Foreground:
    """The foreground with the bodies of people side by side as separate blobs.

    Args:
        view: The foreground of a frame.
        tracks: Tracks predicted to this frame; blobs shared by two of them are left to template matching.
        slender: Width of a body as a share of its height.
    """
    labels, count = view.labels, view.count
    for blob, box in enumerate(find_objects(view.labels), start=1):
        mask = view.labels[box] == blob
        if mask.shape[1] < WIDE * slender * mask.shape[0] or _shared(blob, view.labels, tracks) > 1:
            continue
        columns = split_columns(mask, slender)
        if not columns:
            continue
        labels = labels.copy() if labels is view.labels else labels
        here = labels[box]
        for column in columns:
            count += 1
            here[:, column:][mask[:, column:]] = count
    return view if labels is view.labels else replace(view, labels=labels, count=count)


def person_width(tracks: Sequence[BlobTrack]) -> float:
    """Width of a body as a share of its height: the median of isolated tracks and the prior."""
    alone = [
        s.shape.shape[1] / s.shape.shape[0]
        for s in tracks
        if s.id and not s.merged and not s.cut and s.isolated_frames >= KNOWN_FRAMES
    ]
    return float(np.median([SLENDER, SLENDER, *(r for r in alone if r <= UPRIGHT)]))


def split_columns(mask: Mask, slender: float) -> tuple[int, ...]:
    """The columns at which the second and further bodies of a blob begin; empty for a single body.

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


def are_side_by_side(
    a: tuple[int, int, int, int], b: tuple[int, int, int, int], slender: float
) -> bool:
    """Whether two pieces of an object are bodies side by side, rather than halves of one behind a post.

    Args:
        a: (x, y, width, height) of one.
        b: The same of the other.
        slender: Width of a body as a share of its height.
    """
    (_, ay, aw, ah), (_, by, bw, bh) = a, b
    slim = all(WHOLE * slender * h <= w <= UPRIGHT * h for w, h in ((aw, ah), (bw, bh)))
    common = min(ay + ah, by + bh) - max(ay, by)
    return slim and common >= ALIKE * max(ah, bh)


def _heights(mask: Mask) -> NDArray[np.int64]:
    """Height of each column of a blob above the bottom of its box, pixels, median of three columns."""
    rows = mask.shape[0]
    tops = np.where(mask.any(axis=0), rows - mask.argmax(axis=0), 0)
    return np.asarray(np.median([np.roll(tops, 1), tops, np.roll(tops, -1)], axis=0), np.int64)


def _shared(blob: int, labels: Labels, tracks: Sequence[BlobTrack]) -> int:
    """Number of tracks that were isolated before and are predicted to lie in a blob."""
    count = 0
    for s in tracks:
        at, own = template_window(s, labels.shape)
        inside = int(np.count_nonzero(crop(s.shape, own) & (crop(labels, at) == blob)))
        known = s.isolated_frames >= APART
        count += int(known and 2 * inside > int(np.count_nonzero(s.shape)))
    return count
