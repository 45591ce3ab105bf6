"""Law: what is drawn before a dark sky is found, wherever it lies; stars, noise and daylight are not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.dark_sky.scenes import SHAPE, alike, bar, disc, painted
from visup.percepts.motion.dark_sky.sky import (
    HALO,
    bright_components,
    brightness,
    joining_gap,
    sky_tone,
    without_halos,
)

LEAST = 40.0


@settings(deadline=None, max_examples=25)
@given(
    st.floats(25, 60), st.floats(25, 95), st.floats(5, 18), st.integers(40, 255), st.integers(0, 99)
)
def test_a_body_is_found_with_its_outline(
    x: float, y: float, radius: float, level: int, seed: int
) -> None:
    mask, other = disc(x, y, radius), disc(120, 60, 12)
    found = bright_components(painted([mask, other], [level, 90], seed), LEAST)
    assert found is not None
    assert len(found.areas) == 3
    own = found.labels[round(y), round(x)]
    assert own
    assert alike(found.bright & (found.labels == own), mask) > 0.8
    assert not found.cut.any()


def test_what_the_border_cuts_is_told() -> None:
    found = bright_components(painted([bar(0, 30, 50, 60), disc(100, 60, 9)], [90, 90]), LEAST)
    assert found is not None
    assert found.cut[found.labels[55, 5]]
    assert not found.cut[found.labels[60, 100]]


def test_stars_are_no_bodies() -> None:
    stars = [disc(x, y, 1.5) for x, y in ((20, 20), (60, 90), (130, 30), (131, 33))]
    found = bright_components(painted(stars, [255] * 4), LEAST)
    assert found is not None
    assert len(found.areas) == 1


def test_a_star_beside_a_body_is_no_part_of_it() -> None:
    found = bright_components(painted([disc(60, 60, 12), disc(77, 60, 1.5)], [90, 255]), 200.0)
    assert found is not None
    assert found.bright[60, 60]
    assert not found.bright[60, 77]


def test_a_narrow_gap_does_not_part_a_body_but_stays_dark() -> None:
    gap = joining_gap(SHAPE) - 2
    halves = bar(40, 60, 40, 60) | bar(60 + gap, 80, 40, 60)
    found = bright_components(painted([halves], [90]), LEAST)
    assert found is not None
    assert len(found.areas) == 2
    far = bar(40, 60, 40, 60) | bar(60 + 3 * gap + 4, 100, 40, 60)
    apart = bright_components(painted([far], [90]), LEAST)
    assert apart is not None
    assert len(apart.areas) == 3


@pytest.mark.parametrize(
    ("name", "tone"),
    [
        ("daylight", np.full(SHAPE, 120, np.uint8)),
        ("a little black", painted([bar(0, 160, 14, 120)], [120])),
        ("a dark room", painted([bar(0, 160, 0, 18), bar(0, 160, 18, 36)], [20, 26])),
        ("a noisy picture", np.random.default_rng(1).integers(0, 40, SHAPE).astype(np.uint8)),
    ],
)
def test_without_a_dark_sky_there_are_no_components(name: str, tone: np.ndarray) -> None:
    assert sky_tone(tone) is None
    assert bright_components(tone, LEAST) is None


def test_the_earth_is_no_body() -> None:
    found = bright_components(painted([bar(0, 160, 50, 120), disc(40, 20, 9)], [120, 90]), LEAST)
    assert found is not None
    assert len(found.areas) == 2
    assert found.labels[80, 80] == 0


def test_a_blue_panel_is_as_bright_as_its_brightest_channel() -> None:
    image = np.zeros((*SHAPE, 3), np.uint8)
    image[..., 0] = 90
    assert (brightness(image) == 90).all()
    assert brightness(image[..., 1]).shape == SHAPE
    assert brightness(image[..., :1]).shape == SHAPE


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 999), st.floats(0, 29), st.integers(1, 255))
def test_a_halo_has_less_than_its_share_of_the_brightest_neighbour(
    seed: int, level: float, brightest: int
) -> None:
    tone = np.random.default_rng(seed).integers(0, brightest + 1, (9, 11)).astype(np.uint8)
    lit = cv2.dilate(tone, np.ones((3, 3), np.uint8)).astype(np.float32)
    above = lit > level  # only beside what is brighter than the sky is it asked
    expected = tone - level > HALO * (lit - level)
    assert np.array_equal(without_halos(tone, level)[above], expected[above])
