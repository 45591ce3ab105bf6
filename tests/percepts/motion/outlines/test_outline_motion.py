from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.clips import texture, window
from tests.percepts.motion.outlines.test_outline_refinement import SHAPE, disc, ring_of, shares
from visup.agent import Frame
from visup.evaluation.motion.mask_scores import iou
from visup.percepts.motion.features.work_image import WorkImage, prepare_image
from visup.percepts.motion.outlines._outline_motion_jit import sampled
from visup.percepts.motion.outlines._outline_refinement_jit import places_of
from visup.percepts.motion.outlines.outline_motion import MOST, CropMotion, part_motion
from visup.percepts.motion.outlines.outline_refinement import refine_outline

WHOLE = (slice(0, SHAPE[0]), slice(0, SHAPE[1]))
Shift = tuple[float, float]


def view(index: int, grey: np.ndarray) -> WorkImage:
    return prepare_image(Frame(index, index / 25, np.repeat(grey[..., None], 3, axis=2)), 640)


def moved(true: np.ndarray, seed: int, inner: Shift, outer: Shift) -> tuple[WorkImage, CropMotion]:
    """A disc over a ground of the same two tones; both moved since the image before."""
    skin, ground = texture(seed, (200, 220)), texture(seed + 1, (200, 220))

    def shown(back: int) -> np.ndarray:
        own, other = (
            window(image, 50 + back * x, 50 + back * y, SHAPE)
            for image, (x, y) in ((skin, inner), (ground, outer))
        )
        was = window(np.uint8(255) * true, back * inner[0], back * inner[1], SHAPE) > 127
        return np.where(was, own, other)

    new, old = view(1, shown(0)), view(0, shown(1))
    flow = np.where(true[..., None], np.array(inner), np.array(outer))
    return new, part_motion(new, old, -flow.astype(np.float32), WHOLE)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 1000), st.integers(2, 4), st.integers(-3, 3), st.integers(2, 4))
def test_a_disc_with_the_colours_of_its_ground_is_outlined_by_its_motion(
    seed: int, dx: int, dy: int, off: int
) -> None:
    true = disc(45, 35, 20)
    rough = disc(45 + off, 35, 20)
    new, motion = moved(true, seed, (-dx, dy), (0, 0))
    blind = iou(refine_outline(shares(rough), new.tone) > 0.5, true)
    found = iou(refine_outline(shares(rough), new.tone, motion) > 0.5, true)
    assert found > max(0.85, blind)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 1000), st.integers(-3, 3), st.integers(-3, 3))
def test_where_both_sides_move_alike_motion_says_nothing(seed: int, dx: int, dy: int) -> None:
    true = disc(45, 35, 20)
    _, motion = moved(true, seed, (dx, dy), (dx, dy))
    inside = true.view(np.uint8)
    odds = motion.log_odds(places_of(ring_of(inside)), motion.side_flows(inside))
    assert np.abs(odds).max() < 1e-3


def test_where_nothing_is_textured_motion_says_nothing() -> None:
    inside = disc(45, 35, 20).view(np.uint8)
    plain = view(1, np.full(SHAPE, 90, np.uint8))
    flow = np.where(inside[..., None] > 0, np.array((3, 0)), np.array((0, 0)))
    motion = part_motion(plain, plain, flow.astype(np.float32), WHOLE)
    assert not motion.log_odds(places_of(ring_of(inside)), motion.side_flows(inside)).any()


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 1000), st.integers(2, 4))
def test_pixels_of_either_side_are_told_and_odds_are_bounded(seed: int, dx: int) -> None:
    true = disc(45, 35, 20)
    _, motion = moved(true, seed, (dx, 1), (-1, 0))
    inside = true.view(np.uint8)
    near = places_of(ring_of(inside))
    odds = motion.log_odds(near, motion.side_flows(inside))
    side = true[near[:, 0], near[:, 1]]
    assert odds[side].mean() > 0.5
    assert odds[~side].mean() < 0
    assert np.abs(odds).max() <= MOST


@pytest.mark.parametrize("mask", [np.zeros(SHAPE, bool), np.ones(SHAPE, bool)])
def test_a_side_that_is_not_there_has_no_flow(mask: np.ndarray) -> None:
    _, motion = moved(disc(45, 35, 20), 1, (2, 0), (0, 0))
    inner, outer = motion.side_flows(mask.view(np.uint8))
    assert inner[..., 2].all() == mask.all()
    assert outer[..., 2].any() != mask.any()


@given(st.integers(0, 1000), st.floats(-4, 14), st.floats(-4, 12))
def test_images_are_sampled_between_pixels_and_end_with_their_border(
    seed: int, x: float, y: float
) -> None:
    image = np.random.default_rng(seed).integers(0, 256, (9, 11), dtype=np.uint8)
    x, y = float(np.float32(x)), float(np.float32(y))
    u, v = np.clip(x, 0, 10), np.clip(y, 0, 8)
    columns = [np.interp(u, np.arange(11), row) for row in image]
    assert sampled(image, x, y) == pytest.approx(np.interp(v, np.arange(9), columns), abs=1e-3)
