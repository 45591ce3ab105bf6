"""Laws of the memory of an object at rest: a shift is measured, and nothing else passes for one."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.agent import Frame, Observation, Region
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.rest_memory import (
    Displacement,
    displacement_since,
    remember_at_rest,
)
from visup.percepts.appearance.models.scene import Scene, prepare_scene
from visup.percepts.appearance.tracking.short_term_tracking import UNCHANGED_SHARE, is_calm
from visup.percepts.taught.taught_view import taught_view_from_mask

Image = NDArray[np.float32]
WIDTH, HEIGHT = 200, 160
CENTRE, RADII = (100.0, 80.0), (40.0, 26.0)
WINDOW = (50, 44, 150, 116)


def inside(dx: float = 0.0, dy: float = 0.0) -> Image:
    """(HEIGHT, WIDTH) float32 share of each pixel that an ellipse covers that has shifted."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    radius = np.hypot((x - CENTRE[0] - dx) / RADII[0], (y - CENTRE[1] - dy) / RADII[1])
    return np.asarray(np.clip((1 - radius) * min(RADII) + 0.5, 0, 1), dtype=np.float32)


def plain(dx: float = 0.0, dy: float = 0.0, contrast: float = 60.0) -> Image:
    """An object of one brightness before a floor with some texture; only its edges tell where it is."""
    rng = np.random.default_rng(3)
    floor = cv2.resize(rng.uniform(110, 130, (HEIGHT // 8, WIDTH // 8)), (WIDTH, HEIGHT))
    share = inside(dx, dy)
    return np.asarray(floor * (1 - share) + (120 + contrast) * share, dtype=np.float32)


def scene(image: Image, seed: int = 0) -> Scene:
    """What a camera with some noise sees of it."""
    noisy = image + np.random.default_rng(seed).normal(0, 1.0, image.shape)
    return prepare_scene(np.clip(noisy, 0, 255).astype(np.uint8), 0.0)


def seen(image: Image, seed: int = 1) -> Displacement:
    left, top, right, bottom = WINDOW
    blob = Blob(WINDOW, (inside() > 0.5)[top:bottom, left:right])
    return displacement_since(remember_at_rest(scene(plain()), blob), scene(image, seed))


@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 1.6), st.floats(0, 2 * np.pi), st.floats(0.8, 1.2), st.floats(-15, 15))
def test_a_shift_is_measured_in_any_light(
    length: float, way: float, gain: float, offset: float
) -> None:
    dx, dy = length * np.cos(way), length * np.sin(way)
    found = seen(plain(dx, dy) * gain + offset)
    assert found.certain
    assert found.dx == pytest.approx(dx, abs=0.1 + 0.2 * length)
    assert found.dy == pytest.approx(dy, abs=0.1 + 0.2 * length)


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 10_000), st.floats(0.7, 1.2), st.floats(-15, 15))
def test_noise_and_light_are_no_shift(seed: int, gain: float, offset: float) -> None:
    found = seen(plain() * gain + offset, seed)
    assert found.length < 0.15
    assert not found.certain


@settings(max_examples=25, deadline=None)
@given(st.integers(50, 150), st.sampled_from([0.6, 0.75]), st.booleans())
def test_the_edge_of_a_shadow_is_no_shift(edge: int, dark: float, from_left: bool) -> None:
    image = plain()
    part = slice(None, edge) if from_left else slice(edge, None)
    image[:, part] *= np.float32(dark)
    found = seen(image)
    assert not (found.certain and found.length >= 0.5)


@settings(max_examples=25, deadline=None)
@given(st.integers(40, 140), st.integers(40, 110), st.integers(12, 60), st.sampled_from([30, 220]))
def test_what_covers_a_part_of_it_is_no_shift(x: int, y: int, size: int, grey: int) -> None:
    image = plain()
    image[y : y + size, x : x + size] = grey
    found = seen(image)
    assert not (found.certain and found.length >= 0.5)


def test_an_object_without_edges_never_shifts() -> None:
    blank = scene(np.full((HEIGHT, WIDTH), 120, np.float32))
    memory = remember_at_rest(blank, Blob(WINDOW, np.ones((72, 100), dtype=bool)))
    assert displacement_since(memory, blank) == Displacement(0.0, 0.0, 0.0)


def test_a_shift_ends_rest_before_the_pixels_tell() -> None:
    """A plain object changes 1 % of its window when it has shifted by a pixel."""
    same = np.ones((72, 100), dtype=bool)
    assert np.mean(same) > UNCHANGED_SHARE
    assert is_calm(same, seen(plain()))
    assert not is_calm(same, seen(plain(1.0)))
    assert not is_calm(np.zeros_like(same), None)


FPS, LEAVES_S = 15.0, 1.0


def left_edges(acceleration: float) -> list[tuple[float, float]]:
    """Where a plain object is that sets out gently, and where it is seen; left edges, pixels."""

    def picture(t: float) -> NDArray[np.uint8]:
        way = 0.5 * acceleration * max(0.0, t - LEAVES_S) ** 2
        grey = plain(way) + np.random.default_rng(round(t * FPS)).normal(0, 1, (HEIGHT, WIDTH))
        return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)

    behaviour = AppearanceBehaviour((taught_view_from_mask("block", picture(0.0), inside() > 0.5),))
    found = []
    for k in range(round(2.2 * FPS)):
        frame = Frame(k, k / FPS, picture(k / FPS))
        percepts = behaviour.perceive(frame, Observation(k, frame.time, frame.size, ()), ())
        (region,) = (p.value for p in percepts if isinstance(p.value, Region))
        way = 0.5 * acceleration * max(0.0, frame.time - LEAVES_S) ** 2
        found.append((CENTRE[0] - RADII[0] + way, float(region.bbox[0])))
    return found


@pytest.mark.parametrize("acceleration", [15.0, 30.0])
def test_a_plain_object_that_sets_out_gently_is_followed(acceleration: float) -> None:
    assert all(abs(true - seen_at) < 5.0 for true, seen_at in left_edges(acceleration))
