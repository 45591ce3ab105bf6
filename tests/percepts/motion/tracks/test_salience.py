from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import cv2
import numpy as np
import pytest

from tests.percepts.motion.clips import FPS, SIZE, texture
from visup.agent import Frame
from visup.percepts.motion.features.motion_constraints import find_points
from visup.percepts.motion.features.motion_constraints import track_points as follow
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import superpixels
from visup.percepts.motion.features.work_image import prepare_image
from visup.percepts.motion.layers.affine import Affine
from visup.percepts.motion.layers.background_motion import BackgroundMotion, empty_prevalence
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.percepts.motion.tracks.id_allocator import IdAllocator
from visup.percepts.motion.tracks.lifecycle import ConfirmContext, confirm
from visup.percepts.motion.tracks.measurements import BaselineMotion, FrameMeasurements
from visup.percepts.motion.tracks.salience import foot_point, has_left_its_place, is_salient
from visup.percepts.motion.tracks.track import Track

WIDE = texture(1, SIZE)


def scene(time: float = 0.0) -> FrameMeasurements:
    image = prepare_image(Frame(0, time, np.repeat(WIDE[..., None], 3, axis=2)), 512)
    cells = superpixels(image, 8, 8.0)
    owner = np.zeros(cells.count, np.int64)
    flow = np.zeros((*image.shape, 2), np.float32)
    return FrameMeasurements(image, find_points(image, 8, 1.0), cells, owner, 1 / FPS, flow, ())


def still(at: FrameMeasurements) -> BaselineMotion:
    """Nothing has moved, over one frame."""
    c = follow(at.points, at.points.xy, (at.image, at.image), 1, 1.0, nearby=True)
    rest = (Affine(np.zeros((2, 3))),)
    return BaselineMotion(
        c, BackgroundMotion(rest, 1.0, None, empty_prevalence(at.image.shape), True)
    )


def track(
    at: FrameMeasurements, gone: float, way: float, explained: dict[int, float], width: int = 40
) -> Track:
    """A track over the columns up to a width, beside the left border but not beyond a cell of it."""
    x, y = at.cells.centre.T
    share = ((x < width) & (y > 60) & (y < 100)).astype(np.float32)
    if width >= SIZE[1]:
        share = (y > 60).astype(np.float32)
    rest = MappingProxyType(explained)
    return Track(
        1, 0, 0.0, 0.0, share, displacement=(gone, 0.0), path_length=way, background_fit=rest
    )


@pytest.mark.parametrize(
    ("gone", "way", "explained", "salient"),
    [
        (10.0, 10.5, {1: 0.1}, True),
        (10.0, 10.5, {1: 0.95, 12: 0.05}, True),  # slow: only a longer baseline tells
        (10.0, 30.0, {1: 0.1}, False),  # to and fro
        (0.5, 0.5, {1: 0.1}, False),  # it has not left its place
        (10.0, 10.5, {1: 0.9, 12: 0.6}, False),  # the background explains it
        (2.0, 2.0, {1: 0.1}, True),
    ],
)
def test_what_leaves_its_place_on_a_course_is_salient(
    gone: float, way: float, explained: dict[int, float], salient: bool
) -> None:
    at = scene(time=2.0)
    assert is_salient(track(at, gone, way, explained), at) is salient


def test_a_young_track_must_go_further() -> None:
    young, older = scene(time=0.1), scene(time=1.0)
    assert not is_salient(track(young, 2.0, 2.0, {1: 0.0}), young)
    assert is_salient(track(older, 2.0, 2.0, {1: 0.0}), older)


@pytest.mark.parametrize(
    ("way", "borne", "at_once", "salient"),
    [
        (10.5, {}, True, True),
        (30.0, {}, True, False),  # far, but to and fro
        (10.5, {4: 0.9}, False, True),
        (10.5, {4: 0.3}, False, False),  # the steps were those of many things
        (10.5, {4: 0.3}, True, False),
        (10.5, {4: 0.3, 5: 0.9}, False, True),  # the longest baseline decides
        (16.0, {4: 0.9}, True, True),  # steps as long as their noise, but gone it has
        (16.0, {4: 0.9}, False, False),
    ],
)
def test_a_longer_baseline_must_bear_out_the_way(
    way: float, borne: dict[int, float], at_once: bool, salient: bool
) -> None:
    at = scene(time=2.0)
    at = replace(at, measured=(still(at),))
    t = track(at, 10.0, way, {1: 0.1})
    inside = np.where(at.cells.centre[:, 0] > 12, t.share, 0).astype(np.float32)
    t = replace(t, share=inside, long_baseline_course=MappingProxyType(borne))
    assert is_salient(t, at, at_once=at_once) is salient


@pytest.mark.parametrize(("gone", "left"), [(8.0, False), (12.0, True)])
def test_what_has_gone_a_quarter_of_its_size_has_left_its_place(gone: float, left: bool) -> None:
    at = scene()
    assert has_left_its_place(track(at, gone, gone, {}), at) is left


@pytest.mark.parametrize("gone", [8.0, 14.0])
@pytest.mark.parametrize("in_place", [False, True])
def test_what_has_left_its_place_need_not_last_before_a_camera_that_shakes_in_place(
    gone: float, in_place: bool
) -> None:
    at = scene(time=0.08)
    young = track(at, gone, gone, {1: 0.3})
    young = replace(young, frames=2, evidence=300.0, last_seen=at.time)
    (t,) = confirm(
        (young,), at, IdAllocator(), MotionSettings(), ConfirmContext((False,), in_place)
    )
    assert bool(t.id) is (in_place and gone > 10)


def test_what_fills_the_border_is_a_ground() -> None:
    at = scene()
    assert is_salient(track(at, 10.0, 10.0, {1: 0.0}), at)
    assert not is_salient(track(at, 10.0, 10.0, {1: 0.0}, width=SIZE[1]), at)


def swaying(n: int, rng: np.random.Generator, phase: np.ndarray) -> Frame:
    """A still picture but for its upper left, where every leaf swings about its place."""
    ys, xs = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
    inside = cv2.GaussianBlur(((xs < 100) & (ys < 80)).astype(np.float32), (0, 0), 4.0)
    swing = 1.2 * inside * np.sin(0.9 * n + phase)
    image = cv2.remap(WIDE, xs + swing.astype(np.float32), ys, cv2.INTER_LINEAR)
    grey = np.clip(np.rint(image + rng.normal(0, 1.0, SIZE)), 0, 255).astype(np.uint8)
    return Frame(n, n / FPS, np.repeat(grey[..., None], 3, axis=2))


@pytest.mark.parametrize("seed", [2, 4, 5])
def test_leaves_that_sway_are_no_objects(seed: int) -> None:
    rng = np.random.default_rng(seed)
    phase = cv2.GaussianBlur(rng.uniform(-40, 40, SIZE).astype(np.float32), (0, 0), 6.0)
    segmenter = MotionSegmenter()
    seen = [segmenter.step(swaying(n, rng, phase)) for n in range(60)]
    assert not any(seen)


def travelling(n: int, own: float) -> Frame:
    """A camera goes sideways over a ground that recedes to a wall; a post stands there, or goes."""
    height, width = 240, 320
    ys, xs = np.mgrid[:height, :width].astype(np.float32)
    speed = np.maximum(ys - 90, 0) * np.float32(1.5 / 150)
    ground = cv2.resize(texture(1, (240, 480)), (960, 240), interpolation=cv2.INTER_CUBIC)
    image = cv2.remap(ground, xs + 300 + speed * n, ys, cv2.INTER_LINEAR)
    post = cv2.resize(texture(7, (60, 30), 0, 255), (36, 110))
    left = 200 - (float(speed[170, 0]) + own) * n
    place = np.array([[1, 0, left], [0, 1, 60]])
    shown = cv2.warpAffine(post, place, (width, height))
    mask = cv2.warpAffine(np.full_like(post, 255), place, (width, height)) / 255.0
    grey = np.clip(np.rint(image * (1 - mask) + shown * mask), 0, 255).astype(np.uint8)
    return Frame(n, n / FPS, np.repeat(grey[..., None], 3, axis=2))


@pytest.mark.parametrize(("own", "told"), [(0.0, False), (1.5, True), (-1.5, True)])
def test_what_stands_on_the_ground_is_no_object_however_much_parallax_it_has(
    own: float, told: bool
) -> None:
    segmenter = MotionSegmenter()
    assert any(segmenter.step(travelling(n, own)) for n in range(50)) is told


def test_the_foot_is_the_lowest_part_and_unknown_where_the_image_cuts_it() -> None:
    cells = scene().cells
    x, y = cells.centre.T
    found = foot_point((np.abs(x - 60) < 20) & (y > 30) & (y < 80), cells)
    assert found is not None
    assert found[0] == pytest.approx(60, abs=8)
    assert found[1] == pytest.approx(80, abs=10)
    assert foot_point(y > 30, cells) is None
    assert foot_point(y < 0, cells) is None
