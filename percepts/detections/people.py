"""Standing and walking people, by the detector included in OpenCV, without a download.

Histograms of oriented gradients with the linear SVM trained on the images of Dalal and Triggs, "Histograms
of Oriented Gradients for Human Detection" (2005). It detects whole people, upright and roughly from the side;
not hands, nor people who sit or are half hidden.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import cv2
import numpy as np
from pydantic import BaseModel, Field

from visup.agent import Contract, Frame
from visup.percepts.detections.behaviour import DetectorBehaviour
from visup.percepts.detections.boxes import Box, Detection

WINDOW = (64, 128)
"""Width and height of the detection window, pixels; a person fills some three quarters of its height."""

PERSON_PX = 96.0

LARGEST_PX = 1600
"""Most width and height of an enlarged image, which bounds the time per frame."""

MARGIN = (0.15, 0.06)
"""Margin of a detected box around the person, shares of its width and height."""


class PeopleBehaviour(DetectorBehaviour):
    """Boxes of people, called `person`.

    Args:
        settings: Settings.
    """

    contract = Contract("people", gives=("region", "hypothesis"), cost_ms=1000)
    names = ("person",)

    class Settings(BaseModel):
        """Settings of `--set people.NAME=VALUE`."""

        least_px: float = Field(
            default=60.0, ge=24, description="height of the smallest person, pixels"
        )
        least: float = Field(
            default=0.6, ge=0, description="boxes found with less than that are left out"
        )

    def __init__(self, settings: Settings | None = None) -> None:
        super().__init__()
        self.settings = settings or self.Settings()
        self._detector = cv2.HOGDescriptor()
        weights = np.array(cv2.HOGDescriptor.getDefaultPeopleDetector(), np.float32)
        self._detector.setSVMDetector(weights)

    def find(self, frame: Frame) -> Iterable[Detection]:
        """The people of a frame, from left to right."""
        scale = min(PERSON_PX / self.settings.least_px, LARGEST_PX / max(frame.size))
        image = cv2.resize(frame.image, None, fx=scale, fy=scale)
        if image.shape[1] < WINDOW[0] or image.shape[0] < WINDOW[1]:
            return
        boxes, weights = self._detector.detectMultiScale(image, winStride=(8, 8), scale=1.05)
        found = zip(map(tuple, np.reshape(boxes, (-1, 4)).tolist()), np.ravel(weights), strict=True)
        for box, weight in sorted(found):
            if weight >= self.settings.least:
                yield Detection(0, person_in(box, scale), 1.0 - math.exp(-weight), "person")


def person_in(box: Box, scale: float) -> Box:
    """The person inside a box detected at another scale, without its margin."""
    x, y, w, h = (value / scale for value in box)
    across, along = MARGIN
    return (x + across * w, y + along * h, (1 - 2 * across) * w, (1 - 2 * along) * h)
