"""Camera motion for ideal perception: from the points of the picture that belong to no object.

Masks tell where objects are, not how the camera moves, which perception from pixels reports too; without it
all that rests would seem to move before a camera that shakes or pans.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import CameraMotion, Directive, Frame, Observation, Percept
from visup.agent.contract.behaviour import Contract
from visup.percepts.appearance.background.camera_motion import CameraTrack, track_camera
from visup.percepts.appearance.models.scene import Scene, prepare_scene


class SceneCamera:
    """A behaviour that reports how the picture of the static scene has moved since the last frame.

    Args:
        mask: Returns the (H, W) uint8 mask of a frame number; 0 is the static scene.
    """

    contract = Contract("scene_camera", gives=("camera",))

    def __init__(self, mask: Callable[[int], NDArray[np.uint8]]) -> None:
        self._mask = mask
        self._last: tuple[int, Scene] | None = None
        self._track = CameraTrack()

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One camera motion per frame, except where the points do not agree."""
        scene = prepare_scene(frame.image, frame.time)
        last, self._last = self._last, (frame.index, scene)
        if last is None:
            return
        self._track, motion = track_camera(self._track, last[1], scene, self._object_mask(*last))
        if motion is not None:
            motion = motion.copy()
            motion[:, 2] /= scene.scale
            yield self.contract.percept(frame, CameraMotion(motion))

    def _object_mask(self, index: int, scene: Scene) -> NDArray[np.bool_]:
        """(h, w) objects in a frame at working size."""
        size = scene.size
        objects = (self._mask(index) > 0).astype(np.uint8)
        return np.asarray(cv2.resize(objects, size, interpolation=cv2.INTER_NEAREST) > 0)
