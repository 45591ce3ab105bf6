"""Trackers of others, each from boxes frame by frame to boxes with numbers; and MOG2 blobs for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.detections.boxes import Box, Detection

Found = Mapping[int, tuple[Detection, ...]]
Tracked = dict[int, dict[int, Box]]
Tracker = Callable[[Found], Tracked]


def byte_track(found: Found, fps: float) -> Tracked:
    """ByteTrack as `supervision` had it up to 0.26, with its defaults."""
    import supervision

    tracker = supervision.ByteTrack(frame_rate=round(fps))
    return {k: _by_id(tracker.update_with_detections(_of(found[k]))) for k in sorted(found)}


def byte_track_of_trackers(found: Found, fps: float) -> Tracked:
    """ByteTrack of the library `trackers`, with its defaults."""
    import trackers

    tracker = trackers.ByteTrackTracker(frame_rate=fps)
    return {k: _by_id(tracker.update(_of(found[k]))) for k in sorted(found)}


def sort(found: Found, fps: float) -> Tracked:
    """SORT of the library `trackers`, with its defaults."""
    import trackers

    tracker = trackers.SORTTracker(frame_rate=fps)
    return {k: _by_id(tracker.update(_of(found[k]))) for k in sorted(found)}


PEERS: Mapping[str, Callable[[Found, float], Tracked]] = {
    "ByteTrack (supervision)": byte_track,
    "ByteTrack (trackers)": byte_track_of_trackers,
    "SORT (trackers)": sort,
}


def mog2_blobs(images: Sequence[NDArray[np.uint8]]) -> dict[int, tuple[Detection, ...]]:
    """Boxes of what differs from OpenCV's mixture of Gaussians: the usual first attempt."""
    model = cv2.createBackgroundSubtractorMOG2(history=200, varThreshold=16, detectShadows=True)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    out = {}
    for k, image in enumerate(images):
        mask = (model.apply(image) == 255).astype(np.uint8)
        clean = cv2.morphologyEx(
            cv2.morphologyEx(mask, cv2.MORPH_OPEN, kernel), cv2.MORPH_CLOSE, kernel
        )
        _, _, stats, _ = cv2.connectedComponentsWithStats(clean, connectivity=8)
        large = [s for s in stats[1:].tolist() if s[4] > 0.0005 * mask.size]
        out[k] = tuple(Detection(0, tuple(map(float, s[:4])), 1.0) for s in large)  # type: ignore[arg-type]
    return out


def _of(found: Sequence[Detection]) -> Any:
    import supervision

    boxes = np.array([d.box for d in found], np.float32).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    scores = np.array([d.score for d in found], np.float32)
    return supervision.Detections(xyxy=boxes, confidence=scores, class_id=np.zeros(len(found), int))


def _by_id(tracked: Any) -> dict[int, Box]:
    numbers = [] if tracked.tracker_id is None else tracked.tracker_id.tolist()
    rows = zip(numbers, tracked.xyxy.tolist(), strict=True)
    return {n: (a, b, c - a, d - b) for n, (a, b, c, d) in rows if n >= 0}
