"""Random worlds as runs to learn from: the mental model over time, given the masks of a world.

True masks and the true camera motion replace perception, so that learning is measured in isolation; in
practice noise of a segmenter is added. No image is rendered, so a world takes a few seconds.
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
from visup.render.worlds.plate import PlateCamera
from visup.render.worlds.world import FPS, World
from visup.render.worlds.world_renderer import WorldRenderer
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent


def world_minds(world: World) -> tuple[Mind, ...]:
    """The mental model of a world at each frame, without a task."""
    renderer = WorldRenderer(world)
    labels = {role: world.labels[name] for role, name in world.actors.items()}
    behaviours = [TrueCamera(renderer.camera), *role_behaviours(renderer.mask, labels, FPS)]
    width, height = world.size
    blank = np.zeros((height, width, 3), np.uint8)
    agent = reasoning_agent(WatchSettings(source=world.name), (), behaviours)
    try:
        return tuple(
            agent.step(Frame(index, index / FPS, blank)).mind for index in range(world.frames)
        )
    finally:
        agent.close()


class TrueCamera:
    """A behaviour that reports the true background motion since the last frame.

    Args:
        camera: The camera of the world.
    """

    contract = Contract("true_camera", gives=("camera",))

    def __init__(self, camera: PlateCamera) -> None:
        self._camera = camera

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One camera motion per frame."""
        motion = affine_motion(self._camera, max(0, frame.index - 1), frame.index, frame.size)
        yield self.contract.percept(frame, CameraMotion(motion))


def affine_motion(
    camera: PlateCamera, before: int, now: int, size: tuple[int, int]
) -> NDArray[np.float64]:
    """(2, 3) least-squares affine approximation of the image motion between two frames, pixels."""
    previous, current = camera.to_plate(before), camera.to_plate(now)
    if previous is None or current is None:
        return np.eye(2, 3)
    width, height = size
    points = np.array([(x * width, y * height, 1.0) for x in (0, 0.5, 1) for y in (0, 0.5, 1)])
    moved = points @ (np.linalg.inv(current) @ previous).T
    solution, *_ = np.linalg.lstsq(points, moved[:, :2] / moved[:, 2:], rcond=None)
    return np.asarray(solution.T)
