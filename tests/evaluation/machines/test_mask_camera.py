"""By masks, too, the camera's motion is known: what rests before a camera that sways is told to rest."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.percepts.appearance.test_camera import ARM, FPS, HEIGHT, WIDTH, picture
from visup.agent import CameraMotion, Frame, Observation
from visup.evaluation.machines.mask_camera import SceneCamera

ARM_BOTTOM = 150


def arm_mask(_: int) -> NDArray[np.uint8]:
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[:ARM_BOTTOM, 60:180] = 7
    return mask


def motions(positions: list[tuple[float, float]], arm: bool) -> list[CameraMotion]:
    mask = arm_mask if arm else lambda _: np.zeros((HEIGHT, WIDTH), np.uint8)
    camera, reported = SceneCamera(mask), []
    for number, position in enumerate(positions):
        image = picture(position, ARM_BOTTOM if arm else 0, number)
        if arm:  # it moves by itself, within its mask
            image[:ARM_BOTTOM, 60:180] = np.roll(ARM, 3 * number, 0)[:ARM_BOTTOM, 60:180, None]
        frame = Frame(number, number / FPS, image)
        observation = Observation(number, frame.time, frame.size)
        reported += [p.value for p in camera.perceive(frame, observation, ())]
    return reported


steps = st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), min_size=2, max_size=5)


@settings(max_examples=15, deadline=None)
@given(steps, st.booleans())
def test_the_scene_moves_with_the_camera_whatever_an_object_does(
    moves: list[tuple[float, float]], arm: bool
) -> None:
    positions = [tuple(p) for p in np.vstack([(0.0, 0.0), np.cumsum(moves, axis=0)]).tolist()]
    reported = motions(positions, arm)
    # What rests moves in the picture against the camera.
    displacement = np.sum([m.displacement((30.0, 160.0)) for m in reported], axis=0)
    assert np.hypot(*(displacement + np.array(positions[-1]))) < 0.5 + 0.1 * len(moves)


def test_a_camera_at_rest_is_reported_as_at_rest() -> None:
    assert all(np.array_equal(m.motion, np.eye(2, 3)) for m in motions([(0.0, 0.0)] * 4, True))
