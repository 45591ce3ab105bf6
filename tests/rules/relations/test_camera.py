"""Velocities are those in the resting scene, where the camera's motion is perceived."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import Rect, box_region, seen
from visup.agent import CameraMotion, Mind, Observation, Percept, Region, Truth
from visup.rules.geometry.regions import DIRECTIONS
from visup.rules.relations._kinematics_jit import steady_separation
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
        motion = np.column_stack([np.eye(2), np.array(PAN) / fps])
        yield with_camera(look, motion) if told else look


def with_camera(look: Observation, motion: np.ndarray) -> Observation:
    """The same observation with the camera's motion, (2, 3)."""
    camera = Percept("camera", CameraMotion(motion), look.time, "script")
    first, *others = look.reports
    return replace(look, reports=(replace(first, percepts=(camera, *first.percepts)), *others))


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


CENTRE = (320.0, 240.0)


def zoomed(zoom: float, goes: float, told: bool, fps: float = 25.0) -> Iterator[Observation]:
    """Two bodies before a camera that zooms, of which one approaches the other.

    Args:
        zoom: Growth of the picture, share per second.
        goes: Speed of the second towards the first in the scene, pixels of the first frame per second.
        told: Whether the zoom is perceived.
        fps: Frames per second.
    """
    step = (1.0 + zoom) ** (1.0 / fps)
    for i in range(round(2.4 * fps)):
        scale = step**i

        def seen_box(id_: int, rect: Rect, scale: float = scale) -> Region | None:
            x, y, width, height = rect
            left, top = (c + scale * (v - c) for v, c in zip((x, y), CENTRE, strict=True))
            return box_region(id_, (left, top, scale * width, scale * height))

        boxes = seen_box(1, (150, 210, 80, 60)), seen_box(2, (430 - goes * i / fps, 220, 50, 50))
        shift = (1.0 - step) * np.array(CENTRE)
        look = seen(i, boxes, fps)
        yield with_camera(look, np.column_stack([step * np.eye(2), shift])) if told else look


@pytest.mark.parametrize("zoom", [-0.1, -0.03, 0.03, 0.1])
@pytest.mark.parametrize(
    ("goes", "told", "expected"),
    [
        (0.0, True, "keeping_distance"),
        (15.0, True, "converging"),
        (-15.0, True, "diverging"),
        (0.0, False, ""),
    ],
)
def test_a_zoom_brings_nothing_nearer(zoom: float, goes: float, told: bool, expected: str) -> None:
    mind = reason(zoomed(zoom, goes, told))[-1].mind
    by_picture = "converging" if zoom < 0.0 else "diverging"
    assert mind.truth(expected or by_picture, 1, 2) is Truth.TRUE


@given(st.floats(-0.2, 0.2), st.floats(20.0, 400.0), st.floats(10.0, 60.0), st.integers(2, 8))
def test_distances_at_rest_are_those_of_now_whatever_the_zoom(
    zoom: float, apart: float, radius: float, times: int
) -> None:
    scales = (1.0 + zoom) ** np.linspace(-1.0, 0.0, times)
    centres = np.array([(0.0, 0.0), (apart + 2.0 * radius, 0.0)])
    support = centres @ DIRECTIONS.T + radius
    separation = np.zeros((times, 2, 2))
    separation[:, [0, 1], [1, 0]] = (scales * apart)[:, None]
    drift = scales[:, None, None] * centres
    found = steady_separation(separation, support, drift, DIRECTIONS)
    assert found[:, 0, 1] == pytest.approx(apart, abs=0.01 * apart + 1e-6)
    assert np.array_equal(found[:, 0, 1], found[:, 1, 0])


def test_what_overlaps_or_is_out_of_view_stays_as_it_is() -> None:
    places = np.array([(0.0, 0.0), (10.0, 0.0), (400.0, 0.0)])
    support = places @ DIRECTIONS.T + 20.0
    support[2] = np.nan
    separation = np.arange(18.0).reshape(2, 3, 3)
    drift = np.stack([np.zeros((3, 2)), places])
    assert np.array_equal(steady_separation(separation, support, drift, DIRECTIONS), separation)
