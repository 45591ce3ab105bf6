"""Records of blob tracking: the track of one object, and the foreground blobs of one frame."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.outlines.region_outline import component_areas, renumbered

Mask = NDArray[np.bool_]
Labels = NDArray[np.int32]
Box = tuple[int, int, int, int]
TONES = 6  # bins of each channel in a histogram


@dataclass(frozen=True, slots=True, eq=False)
class BlobTrack:
    """The track of one object.

    Attributes:
        key: Number in order of initiation.
        id: Public number, 0 until reported.
        initiated: Time of initiation, seconds.
        last_seen: Time when last visible, seconds.
        frames: Number of frames in which it was visible.
        corner: (x, y) of the upper left corner of the template, pixels of the background model.
        velocity: (vx, vy), pixels per second.
        shape: (h, w) bool, template: its silhouette when it was last isolated.
        tone: (h, w, 3) float32, its tones, grey levels.
        histogram: (TONES ** 3,) float32 of its tones, sums to 1.
        initial_sides: (4,) sides of its box at initiation: left, top, right, bottom.
        path_length: (4,) path length of each side since then, pixels.
        isolated_frames: Number of frames in which it shared no blob.
        visible: Its visible pixels as (box, mask within it); None when hidden.
        merged: Whether it shares a blob with others.
        cut: Whether the image border cuts it, or ever did: then it is not a part of another object.
        split_px: Displacement since it was last seen in one piece, pixels.
        shadow: Whether it looks like a deep shadow; evaluated only without a public id.
    """

    key: int
    id: int
    initiated: float
    last_seen: float
    frames: int
    corner: tuple[float, float]
    velocity: tuple[float, float]
    shape: Mask
    tone: Floats
    histogram: Floats
    initial_sides: Floats
    path_length: Floats
    isolated_frames: int
    visible: tuple[Box, Mask] | None
    merged: bool = False
    cut: bool = False
    split_px: float = 0.0
    shadow: bool = False

    @property
    def centre(self) -> tuple[float, float]:
        """(x, y) of the middle of the template."""
        h, w = self.shape.shape
        return self.corner[0] + w / 2, self.corner[1] + h / 2

    @property
    def sides(self) -> Floats:
        """(4,) sides of the template's box: left, top, right, bottom."""
        h, w = self.shape.shape
        x, y = self.corner
        return np.array([x, y, x + w, y + h], dtype=np.float32)

    def displacement(self) -> Floats:
        """(4,) distance of each side from its position at initiation, pixels."""
        return np.asarray(np.abs(self.sides - self.initial_sides), dtype=np.float32)


BlobTracks = tuple[BlobTrack, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Foreground:
    """The foreground of one frame.

    Attributes:
        image: (h, w, 3) float32, BGR, at the size of the background model.
        labels: (h, w) int32, number of the blob at each pixel, 0 for none.
        count: Number of blobs.
        time: Time of the frame, seconds.
        seconds: Seconds since the previous frame.
    """

    image: Floats
    labels: Labels
    count: int
    time: float
    seconds: float


def find_blobs(
    image: Floats, change: Mask, least: float, time: float, seconds: float
) -> Foreground:
    """Foreground blobs of at least `least` pixels, with small gaps closed and holes filled."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 5))
    closed = cv2.morphologyEx(change.view(np.uint8), cv2.MORPH_CLOSE, kernel)
    outlines, _ = cv2.findContours(closed, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros(closed.shape, np.uint8)
    cv2.drawContours(filled, outlines, -1, 1, cv2.FILLED)
    count, labels = cv2.connectedComponents(filled, connectivity=8)
    keep = component_areas(filled, labels, count) >= least
    keep[0] = False
    number = np.where(keep, np.cumsum(keep), 0).astype(np.int32)
    return Foreground(
        image, renumbered(np.asarray(labels, np.int32), number), int(keep.sum()), time, seconds
    )


def template_window(
    s: BlobTrack, shape: tuple[int, int], dx: int = 0, dy: int = 0
) -> tuple[Box, Box]:
    """The window of a template in the image, and in the template itself, both (x0, y0, x1, y1)."""
    x, y = round(s.corner[0]) + dx, round(s.corner[1]) + dy
    h, w = s.shape.shape
    x0, y0, x1, y1 = max(x, 0), max(y, 0), min(x + w, shape[1]), min(y + h, shape[0])
    x1, y1 = max(x1, x0), max(y1, y0)
    return (x0, y0, x1, y1), (x0 - x, y0 - y, x1 - x, y1 - y)


def crop(a: NDArray, box: Box) -> NDArray:  # type: ignore[type-arg]
    """The part of an image in a box (x0, y0, x1, y1)."""
    return a[box[1] : box[3], box[0] : box[2]]


def crop_mask(mask: Mask) -> tuple[Box, Mask]:
    """The box (x0, y0, x1, y1) around a mask that is not empty, and the mask within it."""
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    box = (x, y, x + w, y + h)
    return box, crop(mask, box)


def at_border(box: Box, view: Foreground) -> bool:
    """Whether a box (x0, y0, x1, y1) touches the border of the image."""
    h, w = view.labels.shape
    return min(box[0], box[1]) <= 0 or box[2] >= w or box[3] >= h


def tone_histogram(tones: Floats) -> Floats:
    """(TONES ** 3,) float32 histogram of (N, 3) tones, 0 to 255, that sums to 1."""
    bins = np.clip(tones * (TONES / 256.0), 0, TONES - 1).astype(np.int64)
    number = (bins[:, 0] * TONES + bins[:, 1]) * TONES + bins[:, 2]
    count = np.bincount(number, minlength=TONES**3).astype(np.float32)
    return np.asarray(count / max(1.0, float(count.sum())), dtype=np.float32)
