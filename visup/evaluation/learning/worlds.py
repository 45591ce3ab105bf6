"""Random worlds as runs to learn from: what is believed while the masks of a world are watched.

Masks stand in for eyes, and the camera's true motion for that which eyes would see, so that learning is
measured by itself: noise of a segmenter comes on top in practice. No picture is drawn, which leaves a few
seconds for a world.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    CameraMotion,
    Contract,
    Directive,
    Frame,
    Mind,
    Observation,
    Percept,
)
from visup.evaluation.machines.mask_regions import role_behaviours
from visup.render.worlds.frames import WorldRenderer
from visup.render.worlds.plate import PlateCamera
from visup.render.worlds.world import FPS, World
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent


def world_minds(world: World) -> tuple[Mind, ...]:
    """What is believed of a world frame by frame, watched without a task."""
    renderer = WorldRenderer(world)
    labels = {role: world.labels[name] for role, name in world.actors.items()}
    eyes = [TrueCamera(renderer.camera), *role_behaviours(renderer.mask, labels, FPS)]
    width, height = world.size
    blank = np.zeros((height, width, 3), np.uint8)
    agent = reasoning_agent(WatchSettings(source=world.name), (), eyes)
    try:
        return tuple(
            agent.step(Frame(index, index / FPS, blank)).mind for index in range(world.frames)
        )
    finally:
        agent.close()


class TrueCamera:
    """A behaviour that reports how the picture of what rests has moved since the last frame.

    Args:
        camera: Of the world.
    """

    contract = Contract("true_camera", gives=("camera",))

    def __init__(self, camera: PlateCamera) -> None:
        self._camera = camera

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One motion for each frame."""
        motion = affine_motion(self._camera, max(0, frame.index - 1), frame.index, frame.size)
        yield self.contract.percept(frame, CameraMotion(motion))


def affine_motion(
    camera: PlateCamera, before: int, now: int, size: tuple[int, int]
) -> NDArray[np.float64]:
    """(2, 3) the affine motion that comes closest to how the picture moved between two frames, pixels."""
    there, here = camera.to_plate(before), camera.to_plate(now)
    if there is None or here is None:
        return np.eye(2, 3)
    width, height = size
    at = np.array([(x * width, y * height, 1.0) for x in (0, 0.5, 1) for y in (0, 0.5, 1)])
    moved = at @ (np.linalg.inv(here) @ there).T
    found, *_ = np.linalg.lstsq(at, moved[:, :2] / moved[:, 2:], rcond=None)
    return np.asarray(found.T)
