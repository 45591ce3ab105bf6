"""Detectors as behaviours: boxes as regions, and their names as hypotheses."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from visup.agent import Contract, Directive, Frame, Hypothesis, Observation, Percept, Region
from visup.agent.model.errors import BehaviourError
from visup.percepts.detections.box_tracker import MultiBoxTracker
from visup.percepts.detections.boxes import Detection
from visup.percepts.detections.files import Frames
from visup.percepts.detections.network import YoloNetwork

PAST_S = 0.4
"""Time over which velocities are measured, seconds."""

VELOCITY_SIGMA = 4.0
"""Standard deviation of a velocity, pixels per second: detectors' boxes jitter by a pixel or two."""

MIN_SIDE = 2
"""Least width and height of the visible part of a box, pixels."""


class DetectorBehaviour:
    """A detector as a behaviour: its boxes become regions, and their names hypotheses.

    A plug-in subclasses it with its own `find` (and `start`, if it must load something); boxes without
    numbers are tracked.

    Args:
        find: Returns the boxes of a frame; a subclass may define it instead.

    Attributes:
        names: All possible names of objects, if known in advance.
    """

    contract = Contract("detections", gives=("region", "hypothesis"))
    names: tuple[str, ...] = ()

    def __init__(self, find: Callable[[Frame], Iterable[Detection]] | None = None) -> None:
        self._find = find
        self._tracker = MultiBoxTracker()
        self._past: dict[int, list[tuple[float, float, float]]] = {}

    def find(self, frame: Frame) -> Iterable[Detection]:
        """The boxes of a frame."""
        if self._find is None:
            raise BehaviourError(
                "this detector does not say what there is in a frame",
                expected="a function that gives the boxes of a frame, or a subclass with its own `find`",
            )
        return self._find(frame)

    def save(self) -> Mapping[str, Any]:
        """The recent positions of objects."""
        past = {track: list(map(list, rows)) for track, rows in self._past.items()}
        return {"past": past, "numbering": self._tracker.save()}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a behaviour with the same detector."""
        self._past = {int(k): [tuple(r) for r in rows] for k, rows in state["past"].items()}
        self._tracker.load(state["numbering"])

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One region for each box visible in the image, and a hypothesis for its name."""
        source = self.contract.name
        for detection in self._tracker.number(frame.index, tuple(self.find(frame))):
            region = self._region(detection, frame)
            if region is None:
                continue
            yield Percept("region", region, frame.time, source, region.confidence)
            if detection.name:
                named = Hypothesis(region.id, detection.name, 0, detection.score, of_kind=True)
                yield Percept("hypothesis", named, frame.time, source, detection.score)

    def _region(self, detection: Detection, frame: Frame) -> Region | None:
        x, y, w, h = detection.box
        width, height = frame.size
        left, top = max(0, round(x)), max(0, round(y))
        right, bottom = min(width, round(x + w)), min(height, round(y + h))
        if min(right - left, bottom - top) < MIN_SIDE:
            return None
        corners = [(left, top), (right - 1, top), (right - 1, bottom - 1), (left, bottom - 1)]
        return Region(
            id=detection.track,
            bbox=(left, top, right - left, bottom - top),
            mask=np.ones((bottom - top, right - left), dtype=bool),
            contour=np.array(corners, np.float32),
            centroid=((left + right - 1) / 2, (top + bottom - 1) / 2),
            area=float((right - left) * (bottom - top)),
            velocity=self._velocity(detection, frame.time),
            velocity_sigma=VELOCITY_SIGMA,
            cut=left == 0 or top == 0 or right == width or bottom == height,
            confidence=detection.score,
        )

    def _velocity(self, detection: Detection, now: float) -> tuple[float, float]:
        """Velocity of the centre of a box, pixels per second."""
        x, y, w, h = detection.box
        here = (now, x + w / 2, y + h / 2)
        past = [p for p in self._past.get(detection.track, []) if now - p[0] <= PAST_S]
        self._past[detection.track] = [*past, here]
        if not past:
            return (0.0, 0.0)
        then = past[0]
        return (here[1] - then[1]) / (now - then[0]), (here[2] - then[2]) / (now - then[0])


class DetectionsBehaviour(DetectorBehaviour):
    """Reports the boxes of each frame from a file; see `read_detections`.

    Args:
        frames: Index of a frame -> its boxes.
    """

    def __init__(self, frames: Frames) -> None:
        super().__init__(lambda frame: frames.get(frame.index, ()))
        found = {d.name for boxes in frames.values() for d in boxes if d.name}
        self.names = tuple(sorted(found))


class NetworkBehaviour(DetectorBehaviour):
    """Reports the detections of a network in each frame; see `YoloNetwork`.

    Args:
        path: The ONNX file.
    """

    contract = Contract("detections", gives=("region", "hypothesis"), cost_ms=100)

    def __init__(self, path: Path) -> None:
        network = YoloNetwork(path)
        super().__init__(network)
        self.names = network.names
