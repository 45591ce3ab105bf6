"""A camera that shakes in place is told from one that pans, and from one that rests."""

import math

from hypothesis import given
from hypothesis import strategies as st

from visup.percepts.motion.layers.camera_sway import CameraSway

ANGLE = st.floats(0, 2 * math.pi)


def swayed(steps: list[tuple[float, float]]) -> CameraSway:
    sway = CameraSway()
    for step in steps:
        sway = sway.after(step)
    return sway


@given(ANGLE, st.floats(2.0, 20.0))
def test_to_and_fro_is_in_place(angle: float, far: float) -> None:
    x, y = far * math.cos(angle), far * math.sin(angle)
    assert swayed([(x, y), (-x, -y)] * 8).in_place


@given(ANGLE, st.floats(0.0, 20.0))
def test_one_way_is_not(angle: float, far: float) -> None:
    assert not swayed([(far * math.cos(angle), far * math.sin(angle))] * 16).in_place


@given(st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)), max_size=30))
def test_a_camera_that_rests_does_not_shake(steps: list[tuple[float, float]]) -> None:
    assert not swayed(steps).in_place
