"""Further instances of a taught object: things that look the same, each tracked by itself.

A taught view fits every object of its kind: of two equal parts on a table either may be the one that the task
is about. So where an object is detected for the first time, the rest of the image is searched for others that
match nearly as well. Which of them is meant is decided by reasoning, from what happens to them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.appearance_model import ViewModel
from visup.percepts.appearance.models.blob import Blob, overlap_of_smaller
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.redetection import (
    RedetectionCandidate,
    view_candidates,
)

MAX_INSTANCES = 3
"""Most objects that look the same."""

EQUAL_SCORE = 0.85
"""Least score of a further instance, relative to that of the first one."""

MAX_OVERLAP = 0.1
"""Greatest share of a further instance that lies on another object."""


def further_instances(
    scene: Scene,
    first: Mapping[str, RedetectionCandidate],
    views: Sequence[tuple[int, ViewModel]],
    occupied: Collection[Blob],
) -> Iterator[RedetectionCandidate]:
    """Positions of further instances of objects that have just been detected for the first time.

    Args:
        scene: The frame.
        first: Name -> where it was detected.
        views: The views of these objects, each with its number.
        occupied: Pixels of all objects in view, the new ones included.
    """
    blobs = list(occupied)
    for name, best in first.items():
        mine = [(k, v) for k, v in views if v.name == name]
        for _ in range(MAX_INSTANCES - 1):
            found = _next_instance(scene, best, mine, blobs)
            if found is None:
                break
            blobs.append(found[1])
            yield found[0]


def _next_instance(
    scene: Scene,
    best: RedetectionCandidate,
    views: Sequence[tuple[int, ViewModel]],
    occupied: Collection[Blob],
) -> tuple[RedetectionCandidate, Blob] | None:
    """The best position that is free, with its pixels; None if none is good enough."""
    free = _free_pixels(scene, occupied)
    found = [c for k, v in views for c in view_candidates(scene, v, k, free)]
    least = EQUAL_SCORE * best.match.score
    for candidate in sorted(found, key=lambda c: -c.match.score):
        if candidate.match.score < least:
            return None
        blob = candidate.pixels(scene)
        if blob and not any(overlap_of_smaller(blob, o) > MAX_OVERLAP for o in occupied):
            return candidate, blob
    return None


def _free_pixels(scene: Scene, occupied: Collection[Blob]) -> NDArray[np.bool_]:
    """(h, w) bool: pixels of no object."""
    taken = np.zeros(scene.size[::-1], dtype=np.uint8)
    for blob in occupied:
        left, top, right, bottom = blob.window
        taken[top:bottom, left:right] |= blob.mask.view(np.uint8)
    return np.asarray(cv2.dilate(taken, np.ones((5, 5), np.uint8)) == 0)
