"""A camera that zooms out makes objects smaller, which hides nothing of them."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.scenes import box_region
from visup.agent import CameraMotion, Region
from visup.agent.model.fast_replace import replace
from visup.rules.presence.object_tracks import (
    MIN_ZOOM,
    ObjectTrack,
    magnified,
    new_track,
    update_track,
)


def whole() -> Region:
    """An object that is entirely in view."""
    found = box_region(1, (100, 100, 40, 40))
    assert found is not None
    return found


def camera(factor: float, turn: float = 0.0) -> CameraMotion:
    """A camera that magnifies lengths by a factor, and turns, in radians."""
    c, s = factor * np.cos(turn), factor * np.sin(turn)
    return CameraMotion(np.array([[c, -s, 3.0], [s, c, -2.0]]))


def crowded_track(frames: int, factor: float, moves: CameraMotion | None) -> ObjectTrack:
    """An object beside another, in images in which lengths shrink or grow by a factor a frame."""
    track = new_track(whole(), 0.0)
    for k in range(1, frames + 1):
        smaller = replace(whole(), area=whole().area * factor ** (2 * k))
        track = magnified({1: track}, moves)[1]
        track = update_track(track, smaller, k / 15, crowded=True, allowed_gap_s=0.25)
    return track


@given(st.floats(0.99, 1.01), st.floats(-0.1, 0.1))
def test_the_magnification_is_that_of_areas(factor: float, turn: float) -> None:
    assert camera(factor, turn).magnification == pytest.approx(factor**2)


@given(st.sampled_from([0.99, 0.995, 0.998, 1.002, 1.01]), st.integers(1, 120))
def test_what_a_zoom_makes_smaller_is_not_hidden(factor: float, frames: int) -> None:
    assert crowded_track(frames, factor, camera(factor)).visible_share == pytest.approx(1.0)


def test_what_is_smaller_before_a_camera_at_rest_is_hidden() -> None:
    for moves in (None, camera(1.0), camera(1.0 - MIN_ZOOM / 4)):
        track = crowded_track(60, 0.99, moves)
        assert track.visible_share == pytest.approx(0.99**120)


def test_no_track_is_changed_without_zoom() -> None:
    track = new_track(whole(), 0.0)
    assert magnified(MappingProxyType({1: track}), camera(1.0, 0.1)) == {1: track}
