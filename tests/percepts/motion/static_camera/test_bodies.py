"""People who walk side by side are taken apart; cars, posts and shadows are not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from visup.percepts.motion.static_camera.blob_track import BlobTrack, Foreground, find_blobs
from visup.percepts.motion.static_camera.blob_tracker import track_blobs
from visup.percepts.motion.static_camera.side_by_side import (
    SLENDER,
    are_side_by_side,
    person_width,
    split_columns,
    split_people,
)

SIZE = (120, 200)
Mask = np.ndarray


def body(x: int, foot: int, tall: int = 60) -> Mask:
    """A head on shoulders: two fifths as wide as high."""
    out = np.zeros(SIZE, bool)
    wide = round(SLENDER * tall)
    head = round(0.2 * tall)
    out[foot - tall + head : foot, x : x + wide] = True
    out[foot - tall : foot - tall + head, x + wide // 3 : x + wide - wide // 3] = True
    return out


def seen(mask: Mask, image: np.ndarray | None = None, n: int = 0) -> Foreground:
    image = np.zeros((*SIZE, 3), np.float32) if image is None else image
    return find_blobs(image, mask, 20, n / 10, 0.1)


def box(mask: Mask) -> tuple[int, int, int, int]:
    ys, xs = np.nonzero(mask)
    left, top = int(xs.min()), int(ys.min())
    return left, top, int(xs.max()) + 1 - left, int(ys.max()) + 1 - top


def in_its_box(mask: Mask) -> Mask:
    ys, xs = np.nonzero(mask)
    return mask[ys.min() : ys.max() + 1, xs.min() : xs.max() + 1]


@given(
    st.integers(1, 3),
    st.integers(0, 2),
    st.integers(60, 90),
    st.lists(st.integers(-3, 3), min_size=3),
)
def test_bodies_side_by_side_are_as_many_as_they_are(
    count: int, overlap: int, tall: int, steps: list[int]
) -> None:
    wide = round(SLENDER * tall)
    bodies = [body(5 + k * (wide - overlap), 105 + steps[k], tall) for k in range(count)]
    columns = split_columns(in_its_box(np.logical_or.reduce(bodies)), SLENDER)
    assert len(columns) == count - 1
    for k, column in enumerate(columns, start=1):
        assert abs(column - k * (wide - overlap)) <= max(3, wide // 3)


@pytest.mark.parametrize(("wide", "high"), [(60, 25), (80, 30), (30, 60), (24, 60), (90, 90)])
def test_what_has_no_notch_stays_whole(wide: int, high: int) -> None:
    assert split_columns(np.ones((high, wide), bool), SLENDER) == ()


def test_a_body_beside_something_low_stays_whole() -> None:
    mask = body(10, 100)
    mask[92:100, 34:60] = True  # its shadow
    assert split_columns(in_its_box(mask), SLENDER) == ()


@given(arrays(bool, (24, 40)), st.floats(0.2, 0.6))
@settings(max_examples=60, deadline=None)
def test_blobs_are_only_divided(change: Mask, slender: float) -> None:
    view = find_blobs(np.zeros((24, 40, 3), np.float32), change, 4, 0.0, 0.1)
    apart = split_people(view, (), slender)
    assert ((apart.labels > 0) == (view.labels > 0)).all()
    assert set(np.unique(apart.labels)) - {0} == set(range(1, apart.count + 1))
    for number in range(1, apart.count + 1):
        assert len(np.unique(view.labels[apart.labels == number])) == 1


def test_two_halves_behind_a_post_are_no_bodies() -> None:
    one = body(20, 100)
    post = np.zeros(SIZE, bool)
    post[:, 28:36] = True
    left, right = one & ~post, one & ~post
    left[:, 28:], right[:, :36] = False, False
    assert not are_side_by_side(box(left), box(right), SLENDER)
    assert are_side_by_side(box(one), box(body(60, 103)), SLENDER)
    # A child's height apart: they share too little.
    assert not are_side_by_side(box(one), box(body(60, 100, 24)), SLENDER)


def followed(frames: list[Mask]) -> tuple[BlobTrack, ...]:
    known: tuple[BlobTrack, ...] = ()
    born = 0
    rng = np.random.default_rng(0)
    tones = rng.uniform(0, 255, (*SIZE, 3)).astype(np.float32)
    for n, mask in enumerate(frames):
        image = np.where(mask[..., None], np.roll(tones, 3 * n, axis=1), 0).astype(np.float32)
        known, born = track_blobs(known, seen(mask, image, n), born)
    return known


def test_a_pair_that_came_as_one_blob_is_followed_as_two() -> None:
    pair = [body(10 + 3 * n, 100) | body(32 + 3 * n, 102) for n in range(25)]
    visible = [t for t in followed(pair) if t.visible is not None]
    assert len(visible) == 2
    assert abs(visible[0].centre[0] - visible[1].centre[0]) > 15


def test_one_walker_is_followed_as_one() -> None:
    assert len(followed([body(10 + 3 * n, 100) for n in range(25)])) == 1


def test_how_wide_bodies_are_is_known_of_people_where_nothing_was_followed() -> None:
    assert person_width(()) == SLENDER
