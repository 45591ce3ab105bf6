"""The pose of a fiducial marker: OpenCV's ArUco as a behaviour.

Stick a printed marker on a tool or a table, and its position and attitude are in the mind.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import radians, tan

import cv2
import numpy as np
from pydantic import BaseModel, Field

from visup.agent import Contract, Directive, Frame, Observation, Percept
from visup.agent.cycle.agent import Agent


class Markers:
    """Reports each marker: its number, position (x right, y down, z forward, metres), rotation vector."""

    contract = Contract("markers", gives=("marker",), cost_ms=50)

    class Settings(BaseModel):
        """Of the marker and the camera."""

        side_m: float = Field(default=0.1, gt=0, description="length of a marker's side, metres")
        fov_vertical_deg: float = Field(default=40.0, gt=0, lt=180)

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = settings or self.Settings()

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterator[Percept]:
        """One percept for each marker of the dictionary 4X4_50."""
        detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
        width, height = frame.size
        focal = height / 2 / tan(radians(self.settings.fov_vertical_deg) / 2)
        camera = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
        half = self.settings.side_m / 2
        corners = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
        outlines, numbers, _ = detector.detectMarkers(frame.image)
        for outline, number in zip(
            outlines, [] if numbers is None else numbers.ravel(), strict=True
        ):
            found, turn, place = cv2.solvePnP(
                corners, outline.reshape(4, 2), camera, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
            )
            if found:
                pose = {
                    "place": tuple(place.ravel().tolist()),
                    "turn": tuple(turn.ravel().tolist()),
                }
                yield self.contract.percept(frame, {"number": int(number), **pose})


def approaching(count: int) -> Iterator[Frame]:
    """A marker that comes closer: its side grows from 60 pixels."""
    marker = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    for n in range(count):
        side = 60 + 12 * n
        image = np.full((240, 320, 3), 200, np.uint8)
        tile = cv2.aruco.generateImageMarker(marker, 7, side)
        image[120 - side // 2 :, 160 - side // 2 :][:side, :side] = tile[..., None]
        yield Frame(n, n / 10, image)


if __name__ == "__main__":
    for step in Agent([Markers()]).steps(approaching(6)):
        for marker in step.observation.of("marker"):
            print(
                f"{step.time:3.1f} s  marker {marker['number']} is {marker['place'][2]:.3f} m away"
            )
