"""The camera's motion: slow drifts add up, what rests is exactly at rest, and an arm is not the scene."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.agent import CameraMotion
from visup.percepts.appearance.background.camera_motion import (
    CameraTrack,
    scene_motion,
    track_camera,
)
from visup.percepts.appearance.background.point_tracking import STILL
from visup.percepts.appearance.models.scene import prepare_scene

Image = NDArray[np.uint8]
FPS, WIDTH, HEIGHT = 25.0, 240, 180


def texture(seed: int, width: int, height: int) -> NDArray[np.float32]:
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(40, 210, (height // 8, width // 8)).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC))


WORLD, ARM = texture(1, 2 * WIDTH, 2 * HEIGHT), texture(2, WIDTH, HEIGHT)


def picture(at: tuple[float, float], arm: float = 0.0, number: int = 0) -> Image:
    """What a camera at a place sees, with an arm that reaches so far down; with noise."""
    shift = np.array([[1.0, 0.0, -60.0 - at[0]], [0.0, 1.0, -60.0 - at[1]]])
    grey = cv2.warpAffine(WORLD, shift, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR)
    rows = round(arm)
    if rows > 0:
        grey[:rows, 60:180] = ARM[HEIGHT - rows :, 60:180]
    grey = grey + np.random.default_rng(number).normal(0.0, 1.0, grey.shape)
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def track_object(
    places: list[tuple[float, float]], arm: list[float]
) -> list[NDArray[np.float64] | None]:
    track, moved = CameraTrack(), []
    shots = zip(places, arm, strict=True)
    scenes = [prepare_scene(picture(p, a, k), k / FPS) for k, (p, a) in enumerate(shots)]
    for old, new in pairwise(scenes):
        track, camera = track_camera(track, old, new, None)
        moved.append(camera)
    return moved


def total(moved: list[NDArray[np.float64] | None]) -> tuple[float, float]:
    """By how much the middle of the lower half of the picture has moved, pixels."""
    each = [CameraMotion(m).displacement((120.0, 130.0)) for m in moved if m is not None]
    return sum(x for x, _ in each), sum(y for _, y in each)


@settings(max_examples=6, deadline=None)
@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
def test_a_drift_adds_up_to_what_it_is(dx: float, dy: float) -> None:
    """To a pixel or so over a second, however slow."""
    count = 25
    moved = track_object([(dx * k, dy * k) for k in range(count + 1)], [0.0] * (count + 1))
    assert all(m is not None for m in moved)
    x, y = total(moved)  # the picture moves against the camera
    assert np.hypot(x + dx * count, y + dy * count) < 1.6


def test_a_camera_that_rests_is_exactly_still() -> None:
    assert all(m is STILL for m in track_object([(0.0, 0.0)] * 12, [0.0] * 12))


def test_an_arm_that_reaches_in_does_not_move_the_scene() -> None:
    """It fills a third of the picture in the end, with a texture as strong as that of the rest."""
    reach = [0.0] * 16 + [4.0 * k for k in range(30)]
    assert np.hypot(*total(track_object([(0.0, 0.0)] * len(reach), reach))) < 1.5


def at_sea(at: tuple[float, float], number: int) -> Image:
    """What a camera sees of a coast above water, whose waves run in three ways at once."""
    image, water = picture(at, number=number), np.zeros((HEIGHT, WIDTH), dtype=np.float32)
    for k, angle in enumerate((0.0, 2.4, 4.8)):
        dx, dy = 2.0 * number * np.cos(angle) + at[0], number * np.sin(angle) + at[1]
        shift = np.array([[1.0, 0.0, -60.0 - dx], [0.0, 1.0, -60.0 - dy]])
        waves = texture(10 + k, 2 * WIDTH, 2 * HEIGHT) - 125
        water += cv2.warpAffine(waves, shift, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR)
    image[COAST:] = np.clip(125 + water / np.sqrt(3), 0, 255)[COAST:, :, None]
    return image


COAST = 35
"""Rows that the coast fills, a fifth of the picture."""


@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_waves_do_not_move_the_camera(speed: float) -> None:
    """In a moment many of them seem to move as one; what is unknown for a while is made up for."""
    count, track, moved = 30, CameraTrack(), []
    scenes = [prepare_scene(at_sea((speed * k, 0.0), k), k / FPS) for k in range(count + 1)]
    for old, new in pairwise(scenes):
        track, camera = track_camera(track, old, new, None)
        moved.append(camera)
    x, y = total(moved)
    assert np.hypot(x + speed * count, y) < 1.0
    assert all(m is not None for m in moved[count // 2 :])


def test_a_slight_jerk_counts_as_rest() -> None:
    """What is below the tracking accuracy since the key frame is noise."""
    places = [(0.0, 0.0)] * 3 + [(0.3, 0.0)] * 8
    assert all(m is STILL for m in track_object(places, [0.0] * len(places)))


@pytest.mark.parametrize(
    ("proven", "age_s", "known"), [(True, 0.07, True), (False, 0.07, False), (False, 0.3, True)]
)
def test_three_fifths_of_the_points_need_to_be_known(
    proven: bool, age_s: float, known: bool
) -> None:
    """They count if they moved with the scene before, or were followed for some time."""
    rng = np.random.default_rng(0)
    key = rng.uniform(0, 200, (50, 2)).astype(np.float32)
    now = key + np.array((5.0, 0.0), dtype=np.float32)
    now[:20] += rng.uniform(3, 9, (20, 2)).astype(np.float32)
    exact = np.tile(0.04 * np.eye(2), (50, 1, 1))
    track = CameraTrack(key_points=key, points=now, covariance=exact, confirmed=np.full(50, proven))
    found = scene_motion(track, age_s)
    assert (found is not None) == known
    if found is not None:
        assert found[:, 2] == pytest.approx((5.0, 0.0), abs=0.2)


def test_a_pan_is_known_while_an_arm_covers_much_of_the_picture() -> None:
    """Points that moved with the scene before are believed in a new key frame."""
    count = 46
    places = [(1.0 * k, 0.0) for k in range(count)]
    moved = track_object(places, [0.0] * 16 + [4.0 * k for k in range(30)])
    assert all(m is not None for m in moved[8:])
    x, y = total(moved)
    assert np.hypot(x + (count - 1), y) < 2.0


def test_a_pan_is_known_soon_beside_an_arm_that_moves_from_the_first_picture_on() -> None:
    count = 12
    moved = track_object(
        [(1.0 * k, 0.0) for k in range(count)], [70 + 4.0 * k for k in range(count)]
    )
    assert all(m is not None for m in moved[6:])
    x, y = total(moved)
    assert np.hypot(x + (count - 1), y) < 1.0


def test_a_fast_pan_is_followed_from_frame_to_frame() -> None:
    """Half a second after its key frame a point is 60 pixels away, too far to be looked for from there."""
    count = 24
    x, y = total(track_object([(5.0 * k - 40, 0.0) for k in range(count)], [0.0] * count))
    assert np.hypot(x + 5.0 * (count - 1), y) < 3.0


def test_a_crowd_that_goes_all_ways_leaves_the_camera_unknown() -> None:
    """Nothing rests, and nothing moves like most."""
    crowd, track, unknown = np.random.default_rng(0), CameraTrack(), 0
    ways = crowd.uniform(-2.5, 2.5, (4, 6, 2))
    ways += np.sign(ways)
    scenes = []
    for k in range(20):
        grey = np.zeros((HEIGHT, WIDTH), dtype=np.float32)
        for (row, col), _ in np.ndenumerate(ways[..., 0]):
            dx, dy = 60 + ways[row, col] * k
            shift = np.array([[1.0, 0.0, -dx], [0.0, 1.0, -dy]])
            tile = np.s_[45 * row : 45 * row + 45, 40 * col : 40 * col + 40]
            grey[tile] = cv2.warpAffine(WORLD, shift, (WIDTH, HEIGHT))[tile]
        image = np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2)
        scenes.append(prepare_scene(image, k / FPS))
    for old, new in pairwise(scenes):
        track, camera = track_camera(track, old, new, None)
        unknown += camera is None
    assert unknown > 12


def on_a_plain_floor(x: float, number: int) -> tuple[Image, NDArray[np.bool_]]:
    """A dark cart at x on a floor of faint stripes, and its exact mask."""
    rows = 120 + 6 * np.sin(np.arange(HEIGHT) / 5.0)
    grey = np.repeat(rows[:, None], WIDTH, axis=1)
    mask = np.zeros((HEIGHT, WIDTH), dtype=bool)
    mask[60:130, round(x) : round(x) + 80] = True
    grey[mask] = 30
    grey = grey + np.random.default_rng(number).normal(0.0, 2.0, grey.shape)
    image = np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    return image, mask


def test_the_outline_of_an_object_does_not_move_the_camera() -> None:
    """On a plain floor the best points are those next to the object, which move with it."""
    track, moved = CameraTrack(), []
    pictures = [on_a_plain_floor(20.0 + 3.0 * max(0, k - 6), k) for k in range(30)]
    scenes = [prepare_scene(image, k / FPS) for k, (image, _) in enumerate(pictures)]
    for (old, new), (_, mask) in zip(pairwise(scenes), pictures, strict=False):
        track, camera = track_camera(track, old, new, mask)
        moved.append(camera)
    assert all(m is None or m is STILL for m in moved)
    assert sum(m is STILL for m in moved) > 10


def test_slow_drift_of_a_faint_scene_is_not_lost() -> None:
    """Points are compared with the key frame: errors from frame to frame do not add up."""
    count, track, moved = 40, CameraTrack(), []
    faint = [128 + 0.12 * (picture((0.15 * k, 0.0), number=k) - 128.0) for k in range(count + 1)]
    scenes = [prepare_scene(image.astype(np.uint8), k / FPS) for k, image in enumerate(faint)]
    for old, new in pairwise(scenes):
        track, camera = track_camera(track, old, new, None)
        moved.append(camera)
    x, y = total(moved)
    assert np.hypot(x + 0.15 * count, y) < 1.6


@given(
    st.lists(st.floats(-0.3, 0.3), min_size=4, max_size=4),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
    st.tuples(st.floats(0, 640), st.floats(0, 480)),
)
def test_a_displacement_leads_back_to_where_it_was(
    bend: list[float], shift: tuple[float, float], was: tuple[float, float]
) -> None:
    motion = np.column_stack([np.eye(2) + np.reshape(bend, (2, 2)), shift])
    now = motion[:, :2] @ was + motion[:, 2]
    moved = CameraMotion(motion).displacement((float(now[0]), float(now[1])))
    assert moved == pytest.approx(tuple(now - was), abs=1e-6)
