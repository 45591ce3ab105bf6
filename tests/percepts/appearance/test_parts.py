"""Laws of the parts that taught things are seen with."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.appearance.scenes import HEIGHT, WIDTH, picture, shown
from visup.agent import Region
from visup.percepts.appearance.background.change_map import ChangeMap
from visup.percepts.appearance.background.point_tracking import STILL
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import prepare_scene
from visup.percepts.appearance.output.unexplained_regions import unexplained
from visup.percepts.appearance.tracking._rest_check_jit import unchanged_pixels
from visup.percepts.appearance.tracking.redetection import view_candidates
from visup.percepts.appearance.tracking.verification import verify
from visup.percepts.motion.outlines.region_outline import describe_mask

poses = st.builds(
    PatchPose, st.floats(0, 200), st.floats(0, 200), st.floats(0.3, 4), st.floats(-3, 3)
)


@given(poses, poses)
def test_the_motion_between_two_poses_takes_one_to_the_other(a: PatchPose, b: PatchPose) -> None:
    there = a.moved(a.motion_to(b))
    assert (there.x, there.y, there.scale) == pytest.approx((b.x, b.y, b.scale), abs=1e-6)
    assert np.cos(there.angle - b.angle) == pytest.approx(1)


@given(poses, st.floats(-20, 20), st.floats(-20, 20))
def test_a_shift_in_the_patch_and_back_changes_nothing(p: PatchPose, dx: float, dy: float) -> None:
    back = p.shifted(dx, dy).shifted(-dx, -dy)
    assert (back.x, back.y) == pytest.approx((p.x, p.y), abs=1e-6)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_pixels_are_compared_as_the_definition_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    was = rng.integers(0, 256, (6, 7, 3)).astype(np.uint8)
    now = np.clip(was.astype(int) + rng.integers(-25, 25, was.shape), 0, 255).astype(np.uint8)
    a, b = now.astype(np.float32), was.astype(np.float32)
    near = (abs(a - b) <= (14, 7, 7)).all(axis=2)
    ratio = (a[..., 0] + 1) / (b[..., 0] + 1)
    kind = abs((a[..., 1:] - 128) - (b[..., 1:] - 128) * ratio[..., None]).max(axis=2) <= 7
    shade = (b[..., 0] > 50) & (ratio > 0.62) & (ratio < 1.25) & kind
    assert np.array_equal(unchanged_pixels(now, was, 14, 7), near | shade)


@settings(max_examples=10, deadline=None)
@given(st.integers(-6, 6), st.integers(-6, 6))
def test_a_thing_is_verified_where_it_is(dx: int, dy: int) -> None:
    model = view_models(shown({"part": (100, 70)}, "part"))[0]
    image, _ = picture({"part": (100 + dx, 70 + dy)})
    match = verify(prepare_scene(image, 0.0), model.appearance, model.pose)
    assert match.score > 0.8
    assert (match.pose.x - model.pose.x, match.pose.y - model.pose.y) == pytest.approx(
        (dx, dy), abs=1.0
    )


def test_an_empty_table_has_no_place_for_a_thing() -> None:
    view = view_models(shown({"part": (100, 70)}, "part"))[0]
    assert view_candidates(prepare_scene(picture({})[0], 0.0), view, 0) == []


def test_a_change_is_where_a_thing_went() -> None:
    change = ChangeMap()
    for n in range(8):
        scene = prepare_scene(picture({"part": (20 + 6 * n, 60)})[0], n * 0.1)
        change.update(scene, STILL)
    lately = change.recently_changed(scene)
    assert lately is not None
    ys, xs = np.nonzero(lately)
    assert 4 * ys.min() > 30
    assert 4 * ys.max() < 110
    assert 4 * xs.max() > 60


def region(number: int, x: int, y: int, w: int, h: int) -> Region:
    outline = describe_mask(np.ones((h, w), dtype=bool), (x, y), (WIDTH, HEIGHT))
    return outline.region(number, (0.0, 0.0), 1.0, 1.0)


THING = region(1, 100, 60, 40, 40)


@pytest.mark.parametrize(
    ("moving", "told"),
    [
        (region(2, 10, 10, 30, 30), True),  # elsewhere
        (region(2, 100, 60, 40, 40), False),  # the thing itself
        (region(2, 98, 58, 5, 40), False),  # its rim
        (region(2, 110, 70, 10, 10), False),  # a fragment of it
        (region(2, 40, 60, 100, 40), True),  # what holds it
    ],
)
def test_what_a_thing_explains_is_not_told_twice(moving: Region, told: bool) -> None:
    left = unexplained([moving], [THING], (WIDTH, HEIGHT))
    assert bool(left) == told
    whole = THING.full_mask((WIDTH, HEIGHT))
    assert not any((r.full_mask((WIDTH, HEIGHT)) & whole).any() for r in left)
