"""The search for points near to where they are expected, beside OpenCV's and a plain one."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.percepts.motion.clips import texture
from visup.agent import Frame
from visup.percepts.motion.features._point_search_jit import (
    DAMPING,
    HALF,
    WINDOW,
    search_nearby,
)
from visup.percepts.motion.features.motion_constraints import find_points
from visup.percepts.motion.features.point_search import NEARBY, search, search_widely
from visup.percepts.motion.features.work_image import WorkImage, prepare_image

SHAPE = (96, 128)
LIMITS = 10, 0.03, NEARBY
shifts = st.tuples(st.floats(-3, 3), st.floats(-3, 3))


def moved(seed: int, by: tuple[float, float]) -> tuple[WorkImage, WorkImage]:
    """A texture, and the same moved by (x, y) pixels."""
    skin = texture(seed, SHAPE).astype(np.uint8)
    matrix = np.array([[1, 0, by[0]], [0, 1, by[1]]])
    other = cv2.warpAffine(skin, matrix, SHAPE[::-1], borderMode=cv2.BORDER_REFLECT)
    one, two = (
        prepare_image(Frame(0, 0.0, np.asarray(image, np.uint8)), 512) for image in (skin, other)
    )
    return one, two


def points_in(image: WorkImage) -> NDArray[np.float32]:
    return find_points(image, 8, 1.0).xy


@given(st.integers(0, 99), shifts, st.floats(-0.7, 0.7))
@settings(deadline=None, max_examples=20)
def test_points_are_found_where_the_picture_has_moved(
    seed: int, by: tuple[float, float], off: float
) -> None:
    source, target = moved(seed, by)
    xy = points_in(source)
    expected = (xy + by).astype(np.float32)
    own = source.grey, source.gx, source.gy
    end, found, misfit = search_nearby(
        own, target.grey, xy, expected + np.array([off, 0], np.float32), LIMITS
    )
    inner = ((expected > 14) & (expected < np.array(SHAPE[::-1]) - 14)).all(axis=1)
    assert found[inner].mean() > 0.9
    error = np.abs(end - expected)[inner & found].max(axis=1)
    assert np.quantile(error, 0.9) < 0.1
    assert misfit[inner & found].mean() < 6


@given(st.integers(0, 99), shifts)
@settings(deadline=None, max_examples=10)
def test_opencv_finds_the_same(seed: int, by: tuple[float, float]) -> None:
    source, target = moved(seed, by)
    start = points_in(source)[:, None]
    begin = (start + np.array(by, np.float32)).astype(np.float32)
    ours, found, off = search(source, target, start, begin, 1, near=True)
    theirs, known, misfit = search_widely(source, target, start, begin, 1, near=True)
    both = (found > 0) & (known > 0)
    assert both.mean() > 0.5
    assert np.quantile(np.abs(ours - theirs)[both[:, 0]], 0.95) < 0.1
    assert np.median(np.abs(off - misfit)[both]) < 0.5


@given(st.integers(0, 99), shifts)
@settings(deadline=None, max_examples=5)
def test_the_compiled_search_is_the_plain_one(seed: int, by: tuple[float, float]) -> None:
    source, target = moved(seed, by)
    xy = points_in(source)
    begin = (xy + np.array(by, np.float32) + np.array(0.3, np.float32)).astype(np.float32)
    own = source.grey, source.gx, source.gy
    end, found, misfit = search_nearby(own, target.grey, xy, begin, LIMITS)
    for n in range(0, len(xy), 7):
        there, good, off = plain(source, target.grey, xy[n], begin[n])
        assert good == found[n]
        np.testing.assert_allclose(end[n], there if good else begin[n], atol=2e-3)
        np.testing.assert_allclose(misfit[n], off, atol=0.05)


def plain(
    source: WorkImage,
    target: NDArray[np.uint8],
    xy: NDArray[np.float32],
    begin: NDArray[np.float32],
) -> tuple[NDArray[np.float64], bool, float]:
    """The search for one point in double precision."""
    most, enough, reach = LIMITS
    x, y = xy.astype(int)
    here, off = begin.astype(float), 255.0
    if not inside(xy):
        return here, False, off
    part = np.s_[y - HALF : y + HALF + 1, x - HALF : x + HALF + 1]
    slope = np.stack([source.gx[part].ravel(), source.gy[part].ravel()]).astype(float)
    tensor = slope @ slope.T
    tensor += np.eye(2) * (DAMPING * np.trace(tensor) + 1e-3)
    for _ in range(most):
        if not inside(here):
            break
        gap = window(target, here) - source.grey[part]
        step = -np.linalg.solve(tensor, slope @ gap.ravel())
        off, here = float(np.abs(gap).mean()), here + step
        if np.hypot(*(here - begin)) > reach:
            break
        if np.hypot(*step) < enough:
            return here, inside(here), off
    return here, False, off


def window(image: NDArray[np.uint8], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """The window around a position, interpolated."""
    u, v = np.floor(at).astype(int)
    a, b = at - (u, v)
    part = image[v - HALF : v + HALF + 2, u - HALF : u + HALF + 2].astype(float)
    rows = (1 - b) * part[:-1] + b * part[1:]
    out = np.asarray((1 - a) * rows[:, :-1] + a * rows[:, 1:])
    assert out.shape == (WINDOW, WINDOW)
    return out


def inside(at: NDArray[np.floating]) -> bool:
    height, width = SHAPE
    return bool(HALF <= at[0] < width - HALF - 1 and HALF <= at[1] < height - HALF - 1)
