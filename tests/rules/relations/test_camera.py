"""Velocities are those in the resting scene, where the camera's motion is perceived."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import CameraMotion, Mind, Observation, Percept
from visup.rules.relations.reasoner import kinematics

PAN = (30.0, -10.0)
"""Pixels per second by which the picture of the scene moves."""


def panned(told: bool, frames: int = 60, fps: float = 25.0) -> Iterator[Observation]:
    """One body rests in the scene and one goes to the right, before a camera that pans."""
    for i in range(frames):
        x, y = PAN[0] * i / fps, PAN[1] * i / fps
        rest = box_region(1, (200 + x, 200 + y, 60, 40))
        goes = box_region(2, (60 + x + 50.0 * i / fps, 320 + y, 50, 50))
        look = seen(i, [rest, goes])
        if told:
            motion = np.column_stack([np.eye(2), np.array(PAN) / fps])
            camera = Percept("camera", CameraMotion(motion), look.time, "script")
            first, *others = look.reports
            first = replace(first, percepts=(camera, *first.percepts))
            look = replace(look, reports=(first, *others))
        yield look


def last(told: bool) -> Mind:
    return reason(panned(told))[-1].mind


def test_what_rests_in_the_scene_rests_though_the_camera_pans() -> None:
    now = kinematics(last(told=True))
    assert now.velocity[0] == pytest.approx((0.0, 0.0), abs=1.0)
    assert now.velocity[1] == pytest.approx((50.0, 0.0), abs=1.0)


def test_without_the_camera_velocities_are_those_in_the_image() -> None:
    now = kinematics(last(told=False))
    assert now.velocity[0] == pytest.approx(PAN, abs=1.0)
    assert now.velocity[1] == pytest.approx((50.0 + PAN[0], PAN[1]), abs=1.0)


def test_distances_are_the_same_either_way() -> None:
    told, untold = (kinematics(last(t)) for t in (True, False))
    assert told.pair("gap", 1, 2) == untold.pair("gap", 1, 2)
    assert told.pair("rate", 1, 2) == pytest.approx(untold.pair("rate", 1, 2))
    assert told.pair("relative_speed", 1, 2) == pytest.approx(
        untold.pair("relative_speed", 1, 2), abs=0.5
    )
