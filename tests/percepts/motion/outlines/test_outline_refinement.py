from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.clips import texture
from visup.evaluation.motion.mask_scores import iou
from visup.percepts.motion.outlines._outline_refinement_jit import (
    BINS,
    histogram_odds,
    mean_field,
    places_of,
    taken_side,
)
from visup.percepts.motion.outlines.outline_refinement import (
    BAND_WIDTH,
    HALF_WINDOW,
    LEAST,
    MOST,
    NOISE,
    ROUNDS,
    SHARED_PIXELS,
    SMOOTHING_PIXELS,
    likeness_of_neighbours,
    local_log_odds,
    refine_outline,
    window_means,
)

SHAPE = (70, 90)


def disc(x: float, y: float, radius: float) -> np.ndarray:
    ys, xs = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return np.asarray(np.hypot(xs - x, ys - y) < radius)


def shares(mask: np.ndarray) -> np.ndarray:
    return np.where(mask, np.float32(0.8), np.float32(0.1))


def painted(mask: np.ndarray, inner: int, outer: int, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    grey = np.where(mask, inner, outer) + rng.normal(0, 3, SHAPE)
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def ring_of(inside: np.ndarray) -> np.ndarray:
    """Pixels beside an outline."""
    kernel = np.ones((2 * BAND_WIDTH + 1, 2 * BAND_WIDTH + 1), np.uint8)
    return np.asarray(cv2.dilate(inside, kernel) != cv2.erode(inside, kernel))


@settings(deadline=None, max_examples=20)
@given(
    st.integers(30, 60), st.integers(28, 42), st.integers(14, 22), st.integers(-3, 3), st.booleans()
)
def test_an_outline_that_is_a_few_pixels_off_comes_to_lie_on_the_edge(
    x: int, y: int, radius: int, off: int, light: bool
) -> None:
    true = disc(x, y, radius)
    tone = painted(true, *((180, 40) if light else (40, 180)))
    rough = disc(x + off, y, radius - off)
    found = refine_outline(shares(rough), tone) > 0.5
    assert iou(found, true) >= min(0.97, iou(rough, true))


def test_a_block_of_sky_at_the_side_of_an_object_is_given_up() -> None:
    true = disc(45, 35, 20)
    rough = true | cv2.dilate(true.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool)
    found = refine_outline(shares(rough), painted(true, 200, 10)) > 0.5
    assert iou(found, true) > 0.95 > iou(rough, true)


@pytest.mark.parametrize("gap", [4, 6])
def test_gaps_between_bright_and_dark_parts_are_given_up_to_the_dark_sky(gap: int) -> None:
    """Panels and a hull, as one rough piece: the tones inside are many, those of the sky are not."""
    true = np.zeros(SHAPE, bool)
    true[15:55, 20:28], true[15:55, 28 + gap : 40 + gap] = True, True
    true[32:38, 28 : 28 + gap] = True
    rough = np.zeros(SHAPE, bool)
    rough[12:58, 17 : 43 + gap] = True
    tone = painted(true, 200, 10)
    tone[15:55, 20:28] = 60
    found = refine_outline(shares(rough), tone) > 0.5
    assert iou(found, true) > 0.85 > 0.65 > iou(rough, true)


@settings(deadline=None, max_examples=20)
@given(st.integers(20, 70), st.integers(20, 50), st.integers(5, 25), st.integers(0, 50))
def test_only_pixels_beside_the_outline_may_change(x: int, y: int, radius: int, seed: int) -> None:
    share = shares(disc(x, y, radius))
    tone = np.repeat(texture(seed, SHAPE)[..., None], 3, axis=2)
    inside = (share > 0.5).astype(np.uint8)
    # Each round begins at the outline that the round before has drawn.
    kernel = np.ones((2 * ROUNDS * BAND_WIDTH + 1, 2 * ROUNDS * BAND_WIDTH + 1), np.uint8)
    far = cv2.dilate(inside, kernel) == cv2.erode(inside, kernel)
    assert np.array_equal(refine_outline(share, tone)[far], share[far])


def test_where_both_sides_look_alike_hardly_anything_changes() -> None:
    """Only the steps of a drawn circle are smoothed."""
    share = shares(disc(45, 35, 18))
    plain = np.full((*SHAPE, 3), 90, np.uint8)
    assert iou(refine_outline(share, plain) > 0.5, share > 0.5) > 0.95


@pytest.mark.parametrize("mask", [np.zeros(SHAPE, bool), np.ones(SHAPE, bool)])
def test_what_has_no_outline_stays(mask: np.ndarray) -> None:
    share = shares(mask)
    assert np.array_equal(refine_outline(share, painted(mask, 10, 200)), share)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 1000))
def test_odds_are_those_of_two_gaussians_in_the_window(seed: int) -> None:
    """Against sums over every other pixel of every window, pixel by pixel."""
    rng = np.random.default_rng(seed)
    tone = rng.integers(0, 256, (*SHAPE, 3), dtype=np.uint8)
    inside = disc(45, 35, 20).view(np.uint8)
    near = places_of(ring_of(inside))
    coarse = np.ascontiguousarray(tone[::2, ::2])
    found = local_log_odds(inside, near, tone, coarse, window_means(coarse))
    some, half = tone[::2, ::2], HALF_WINDOW[0] // 2
    wide = cv2.copyMakeBorder(some, half, half, half, half, cv2.BORDER_REFLECT_101).astype(float)
    sides = np.ascontiguousarray(inside[::2, ::2])
    mask = cv2.copyMakeBorder(sides, half, half, half, half, cv2.BORDER_REFLECT_101) > 0
    for place in rng.choice(np.flatnonzero(found), 12, replace=False):
        y, x = near[place]
        v, u = y // 2, x // 2
        window, own = (a[v : v + HALF_WINDOW[0], u : u + HALF_WINDOW[0]] for a in (wide, mask))
        assert LEAST < own.mean() < 1 - LEAST
        cost = []
        for side in (own, ~own):
            weights = (side / side.size + SHARED_PIXELS / side.size).ravel()
            samples, weights = window.reshape(-1, 3), weights / weights.sum()
            mean = weights @ samples
            variance = weights @ samples**2 - mean**2 + NOISE**2
            gap = (tone[y, x] - mean) ** 2
            cost.append(0.5 * (gap / variance + np.log(variance)).sum() / 3)
        expected = float(np.clip(cost[1] - cost[0], -3, 3))
        assert found[place] == pytest.approx(expected, abs=0.02)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 1000))
def test_odds_are_those_of_the_colours_of_the_object_and_its_surroundings(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tone = rng.choice(np.array([10, 30, 200], np.uint8), (*SHAPE, 3))
    inside, ring = disc(45, 35, 15).view(np.uint8), disc(45, 35, 25).view(np.uint8)
    near = places_of(ring_of(inside))
    found = np.clip(np.log(histogram_odds(near, inside, ring, tone, SMOOTHING_PIXELS)), -MOST, MOST)
    colours = tone // (256 // BINS)
    sides = (inside > 0, (ring > 0) & (inside == 0))
    sizes = np.array([side.sum() for side in sides])
    for place in rng.choice(len(near), 12, replace=False):
        at = tuple(near[place])
        others = np.ones(SHAPE, bool)
        others[at] = False
        alike = (colours == colours[at]).all(axis=2) & others
        counts = np.array([(alike & side).sum() for side in sides])
        within, beyond = counts * sizes.sum() / sizes + SMOOTHING_PIXELS
        expected = float(np.clip(np.log(within / beyond), -MOST, MOST))
        assert found[place] == pytest.approx(expected, abs=1e-3)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 1000), st.integers(6, 18))
def test_a_border_is_drawn_where_neighbours_differ_though_evidence_errs(
    seed: int, edge: int
) -> None:
    rng = np.random.default_rng(seed)
    true = np.broadcast_to(np.arange(24) < edge, (9, 24))
    tone = np.repeat(np.where(true, 60, 160).astype(np.uint8)[..., None], 3, axis=2)
    near = places_of(np.ones(true.shape, bool))
    told = np.where(rng.random(true.shape) < 0.2, ~true, true)
    odds = np.where(told, np.float32(1), np.float32(-1)).ravel()
    share = np.full(true.shape, 0.5, np.float32)
    found = mean_field(share, near, odds, likeness_of_neighbours(near, tone), 4.0, 20)
    assert np.mean((found > 0.5) != true) < 0.03 < np.mean(told != true)


def test_sides_are_the_tangent_of_half_the_odds_nearly() -> None:
    odds = np.linspace(-40, 40, 801)
    sides = np.array([taken_side(o) for o in odds])
    assert np.abs(sides - np.tanh(odds / 2)).max() < 0.024
    assert (np.diff(sides) >= 0).all()
    assert np.abs(sides).max() <= 1
