"""Regions that are ground seen darker are shadows; what hides the ground is none, however dark."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.clips import texture
from visup.agent import Frame
from visup.percepts.motion.outlines.region_outline import describe_mask
from visup.percepts.motion.output import cast_shadows
from visup.percepts.motion.output.cast_shadows import (
    BareGround,
    CastShadowFilter,
    _bare_part,
    comparable_image,
    shadow_evidence,
)

SHAPE = (60, 80)
WHERE = cv2.ellipse(np.zeros(SHAPE, np.uint8), (40, 30), (30, 20), 0, 0, 360, 1, -1) > 0
TINT = np.array([0.7, 0.9, 1.1], np.float32)


def ground(seed: int, low: int = 90, high: int = 200) -> np.ndarray:
    grain = cv2.GaussianBlur(texture(seed, SHAPE, low, high).astype(np.float32), (0, 0), 1.0)
    return np.asarray(grain[..., None] * TINT)


def noisy(image: np.ndarray, seed: int, sigma: float = 2.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.asarray(image + rng.normal(0, sigma, image.shape), np.float32)


@given(st.floats(0.4, 0.85), st.integers(0, 50))
@settings(max_examples=30, deadline=None)
def test_darker_ground_is_shadow(dim: float, seed: int) -> None:
    bare = ground(seed)
    now = np.where(WHERE[..., None], dim * bare, bare)
    assert shadow_evidence(noisy(now, seed), noisy(bare, seed + 1), WHERE) > 0


@given(st.floats(0.3, 1.2), st.integers(0, 50))
@settings(max_examples=30, deadline=None)
def test_another_texture_of_the_same_colour_is_none(dim: float, seed: int) -> None:
    bare, body = ground(seed), dim * ground(seed + 1000)
    now = np.where(WHERE[..., None], body, bare)
    assert shadow_evidence(noisy(now, seed), noisy(bare, seed + 1), WHERE) <= 0


@pytest.mark.parametrize("colour", [(30, 60, 200), (200, 80, 20), (10, 10, 10), (250, 250, 250)])
def test_another_colour_is_none(colour: tuple[int, int, int]) -> None:
    bare = ground(3)
    now = np.where(WHERE[..., None], np.array(colour, np.float32), bare)
    assert shadow_evidence(noisy(now, 1), noisy(bare, 2), WHERE) < 0


def test_nothing_is_said_of_ground_that_was_never_seen_or_has_not_changed() -> None:
    bare = ground(5)
    assert shadow_evidence(noisy(bare, 1), noisy(bare, 2), WHERE) == 0
    assert shadow_evidence(noisy(0.5 * bare, 1), np.full_like(bare, np.nan), WHERE) == 0


def test_even_darkening_of_plain_ground_tells_less() -> None:
    bare = np.broadcast_to(150 * TINT, (*SHAPE, 3)).astype(np.float32)
    now = np.where(WHERE[..., None], 0.6 * bare, bare)
    plain = shadow_evidence(noisy(now, 1, 0.5), noisy(bare, 2, 0.5), WHERE)
    textured = shadow_evidence(noisy(0.6 * ground(1), 1), noisy(ground(1), 2), WHERE)
    assert 0 < plain < textured


@given(st.integers(-9, 9), st.integers(-9, 9))
@settings(max_examples=20, deadline=None)
def test_the_part_of_the_ground_that_is_looked_at_moves_with_the_camera(dx: int, dy: int) -> None:
    bare = ground(7)
    moved = BareGround(bare, bare, 0.0, np.array([[1.0, 0, dx], [0, 1, dy]]))
    found = _bare_part(moved, (20, 15, 50, 40))
    np.testing.assert_allclose(found, bare[15 + dy : 40 + dy, 20 + dx : 50 + dx], atol=1e-3)


@pytest.mark.parametrize("size", [(854, 480), (320, 240), (1001, 777), (60, 40)])
def test_a_smaller_image_has_the_tones_of_the_frame(size: tuple[int, int]) -> None:
    frame = cv2.resize(ground(3).astype(np.uint8), size, interpolation=cv2.INTER_LINEAR)
    found = comparable_image(Frame(0, 0.0, np.asarray(frame, np.uint8)))
    assert max(found.shape[:2]) <= 384
    back = cv2.resize(found, size, interpolation=cv2.INTER_LINEAR)
    assert np.abs(back - frame).mean() < 3


def test_what_is_certainly_no_shadow_is_looked_at_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[int] = []

    def opaque(*_: object) -> float:
        looks.append(0)
        return -1.5

    monkeypatch.setattr(cast_shadows, "shadow_evidence", opaque)
    region = describe_mask(WHERE, (0, 0), SHAPE[::-1]).region(1, (0.0, 0.0), 1.0, 1.0)
    shadows, image = CastShadowFilter(), np.zeros((*SHAPE, 3), np.uint8)
    unused: Any = None  # before a static camera the measurements are not asked for
    for n in range(41):
        frame = Frame(n, n / 25, image)
        assert shadows.step(frame, unused, [region], static=True) == (region,)
    # In four frames the evidence is as low as it can be; a fourth of the other 36.
    assert len(looks) == 4 + 9
