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
LEAST_SIDE = 4
"""Least width or height of a box within the image, pixels; smaller ones are out of view."""

PixelBox = tuple[int, int, int, int]


@dataclass(slots=True)
class BoxTracker:
    """The tracker of one object.

    Attributes:
        view: The taught view.
        starts: Frame in which it starts.
        outlined: Whether the object was outlined in that frame.
    """

    view: TaughtView
    starts: int
    outlined: bool
    _tracker: cv2.Tracker | None = None

    def track(self, frame: Frame) -> PixelBox | None:
        """Its box in the next frame, or None if lost."""
        image = frame.image
        if frame.index < self.starts:
            return None
        if self._tracker is None:
            box = self.view.bbox if self.outlined else best_match(self.view, image)
            self._tracker = cv2.TrackerCSRT.create()
            self._tracker.init(image, box)
            return box
        found, told = self._tracker.update(image)
        return (int(told[0]), int(told[1]), int(told[2]), int(told[3])) if found else None


def best_match(view: TaughtView, image: NDArray[np.uint8]) -> PixelBox:
    """The best match of the taught picture, (x, y, width, height) pixels."""
    x, y, w, h = view.bbox
    left, top = x - view.origin[0], y - view.origin[1]
    scale = image.shape[1] / view.frame_size[0]
    width = min(image.shape[1], max(LEAST_SIDE, round(w * scale)))
    height = min(image.shape[0], max(LEAST_SIDE, round(h * scale)))
    template = cv2.resize(view.image[top : top + h, left : left + w], (width, height))
    score = cv2.matchTemplate(image, template, cv2.TM_CCOEFF_NORMED)
    _, _, _, at = cv2.minMaxLoc(score)
    return int(at[0]), int(at[1]), width, height


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
                yield from self._told(region, tracker.view.name, frame.time)

    def _told(self, region: Region, name: str, now: float) -> Iterator[Percept]:
        yield Percept("region", region, now, "csrt")
        named = Hypothesis(region.id, name, 0, SIMILARITY)
        yield Percept("hypothesis", named, now, "csrt", SIMILARITY)


def box_region(box: PixelBox, number: int, size: tuple[int, int]) -> Region | None:
    """The part of a box inside an image of (width, height), or None if too small."""
    x, y, w, h = box
    left, top, right, bottom = max(0, x), max(0, y), min(size[0], x + w), min(size[1], y + h)
    if min(right - left, bottom - top) < LEAST_SIDE:
        return None
    full = np.ones((bottom - top, right - left), dtype=bool)
    return region_of(full, number, at=(left, top), size=size)


def box_behaviour(brief: Brief) -> BoxRegions:
    """The behaviour of the baseline for a clip."""
    own = brief.video.resolve()
    trackers = []
    for shown, view in zip(brief.shown, views_of(brief.shown), strict=True):
        here = shown.video.resolve() == own
        trackers.append(BoxTracker(view, shown.frame if here else 0, here))
    return BoxRegions(trackers)
