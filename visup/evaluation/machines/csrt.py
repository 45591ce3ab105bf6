"""The baseline: OpenCV's CSRT tracker on each taught box, with its boxes as regions and names as taught.

A tracker starts on the frame in which its object was outlined if that is a frame of the clip; else in the
first frame, at the best match of the taught picture (normalised correlation).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Directive,
    Frame,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
    Region,
)
from visup.agent.contract.behaviour import Contract
from visup.evaluation.machines.clips import Brief
from visup.percepts.taught.taught_view import TaughtView
from visup.teaching.outline_teaching import views_of
from visup.testing import region_of

SIMILARITY = 0.9
MIN_SIDE_PX = 4
"""Least width or height of a box within the image, pixels; smaller ones are out of view."""

PixelBox = tuple[int, int, int, int]


@dataclass(slots=True)
class BoxTracker:
    """The tracker of one object.

    Attributes:
        view: The taught view.
        start_frame: Frame in which it starts.
        outlined: Whether the object was outlined in that frame.
    """

    view: TaughtView
    start_frame: int
    outlined: bool
    _tracker: cv2.Tracker | None = None

    def track(self, frame: Frame) -> PixelBox | None:
        """Its box in the next frame, or None if lost."""
        image = frame.image
        if frame.index < self.start_frame:
            return None
        if self._tracker is None:
            box = self.view.bbox if self.outlined else best_match(self.view, image)
            self._tracker = cv2.TrackerCSRT.create()
            self._tracker.init(image, box)
            return box
        tracked, tracked_box = self._tracker.update(image)
        return (
            (int(tracked_box[0]), int(tracked_box[1]), int(tracked_box[2]), int(tracked_box[3]))
            if tracked
            else None
        )


def best_match(view: TaughtView, image: NDArray[np.uint8]) -> PixelBox:
    """The best match of the taught picture, (x, y, width, height) pixels."""
    x, y, w, h = view.bbox
    left, top = x - view.origin[0], y - view.origin[1]
    scale = image.shape[1] / view.frame_size[0]
    width = min(image.shape[1], max(MIN_SIDE_PX, round(w * scale)))
    height = min(image.shape[0], max(MIN_SIDE_PX, round(h * scale)))
    template = cv2.resize(view.image[top : top + h, left : left + w], (width, height))
    score = cv2.matchTemplate(image, template, cv2.TM_CCOEFF_NORMED)
    _, _, _, best = cv2.minMaxLoc(score)
    return int(best[0]), int(best[1]), width, height


@dataclass(slots=True)
class BoxRegions:
    """A behaviour that reports tracked boxes as regions with the taught names.

    Attributes:
        trackers: One for each object.
    """

    trackers: Sequence[BoxTracker]
    contract: Contract = field(
        default=Contract("csrt", gives=("region", "hypothesis", "health")), init=False
    )

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report one frame; see `Behaviour`."""
        yield Percept("health", Health(HealthStatus.OK), frame.time, "csrt")
        for number, tracker in enumerate(self.trackers, start=1):
            box = tracker.track(frame)
            region = None if box is None else box_region(box, number, frame.size)
            if region is not None:
                yield from self._percepts(region, tracker.view.name, frame.time)

    def _percepts(self, region: Region, name: str, now: float) -> Iterator[Percept]:
        yield Percept("region", region, now, "csrt")
        named = Hypothesis(region.id, name, 0, SIMILARITY)
        yield Percept("hypothesis", named, now, "csrt", SIMILARITY)


def box_region(box: PixelBox, number: int, size: tuple[int, int]) -> Region | None:
    """The part of a box inside an image of (width, height), or None if too small."""
    x, y, w, h = box
    left, top, right, bottom = max(0, x), max(0, y), min(size[0], x + w), min(size[1], y + h)
    if min(right - left, bottom - top) < MIN_SIDE_PX:
        return None
    full = np.ones((bottom - top, right - left), dtype=bool)
    return region_of(full, number, at=(left, top), size=size)


def box_behaviour(brief: Brief) -> BoxRegions:
    """The behaviour of the baseline for a clip."""
    clip_video = brief.video.resolve()
    trackers = []
    for outline, view in zip(brief.outlines, views_of(brief.outlines), strict=True):
        same_clip = outline.video.resolve() == clip_video
        trackers.append(BoxTracker(view, outline.frame if same_clip else 0, same_clip))
    return BoxRegions(trackers)
