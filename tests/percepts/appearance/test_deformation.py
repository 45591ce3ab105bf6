"""An appearance is deformed as its points move beyond its pose, and an arm that bends is followed."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.percepts.appearance.scenes import HEIGHT, WIDTH, table
from visup.percepts.appearance.models.appearance_model import Appearance, view_models
from visup.percepts.appearance.models.deformation import (
    MIN_POINTS,
    deformation,
    deformed,
    with_former_size,
)
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import prepare_scene
from visup.percepts.appearance.tracking import short_term_tracking
from visup.percepts.appearance.tracking.adaptation import refreshed
from visup.percepts.appearance.tracking.track_pixels import points_of_own_colour
from visup.percepts.appearance.tracking.tracker import TaughtObjectTracker
from visup.percepts.taught.taught_view import taught_view_from_mask

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

SHOULDER, LENGTHS, THICKNESS = (60, 150), (70, 70), 16
FRAMES, BEND = 24, 1.1  # radians by which the elbow bends in all


def arm(bend: float) -> tuple[NDArray[np.uint8], Mask]:
    """A picture of an arm of two striped links before a table, and its mask."""
    image, mask = table(), np.zeros((HEIGHT, WIDTH), np.uint8)
    ends = [np.array(SHOULDER, dtype=float)]
    for length, angle in zip(LENGTHS, (-1.2, -0.2 + bend), strict=True):
        ends.append(ends[-1] + length * np.array([np.cos(angle), np.sin(angle)]))
    for a, b, colour in zip(ends, ends[1:], ((190, 90, 40), (150, 60, 30)), strict=False):
        points = [tuple(round(v) for v in a + k * (b - a)) for k in np.linspace(0, 1, 8)]
        cv2.line(mask, points[0], points[-1], 1, THICKNESS)
        cv2.line(image, points[0], points[-1], colour, THICKNESS)
        for p in points:
            cv2.circle(image, p, 4, (230, 230, 230), -1)
    noise = np.random.default_rng(int(1000 * bend)).normal(0, 1.5, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8), mask.astype(bool)


def model() -> Appearance:
    image, mask = arm(0.0)
    (view,) = view_models([taught_view_from_mask("arm", image, mask)])
    return view.appearance


MODEL = model()
SHAPE = MODEL.shape
POSE = PatchPose(100.0, 90.0, 1.3, 0.1)


def grid(step: int = 10) -> Floats:
    """(N, 2) float32: points all over the patch at `POSE`, in the image."""
    matrix = POSE.matrix(SHAPE)
    rows, cols = np.mgrid[4 : SHAPE[0] : step, 4 : SHAPE[1] : step]
    at = np.column_stack([cols.ravel(), rows.ravel()])
    return np.asarray(at @ matrix[:, :2].T + matrix[:, 2], dtype=np.float32)


def moved(points: Floats, before: PatchPose, after: PatchPose) -> Floats:
    """The points, moved as the pose."""
    motion = before.motion_to(after)
    return np.asarray(points @ motion[:, :2].T + motion[:, 2], dtype=np.float32)


poses = st.builds(
    PatchPose,
    st.floats(80, 120),
    st.floats(70, 110),
    st.floats(1.1, 1.5),
    st.floats(-0.3, 0.3),
)


@given(poses)
def test_points_that_move_as_the_pose_does_deform_nothing(after: PatchPose) -> None:
    points = grid()
    assert deformation(SHAPE, POSE, after, (points, moved(points, POSE, after))) is None


@given(st.integers(0, MIN_POINTS - 1))
def test_few_points_deform_nothing(count: int) -> None:
    points = grid()[:count]
    assert deformation(SHAPE, POSE, POSE, (points, points + np.float32(3))) is None


@given(poses, st.floats(1.0, 4.0), st.floats(-3.1, 3.1))
def test_points_that_all_shift_alike_shift_mask_and_pixels(
    after: PatchPose, far: float, way: float
) -> None:
    points = grid()
    shifted = after.shifted(far * np.cos(way), far * np.sin(way))
    motion = deformation(SHAPE, POSE, after, (points, moved(points, POSE, shifted)))
    assert motion is not None
    bent = deformed(MODEL, motion)
    by = np.array([[1, 0, far * np.cos(way)], [0, 1, far * np.sin(way)]])
    wanted = cv2.warpAffine(MODEL.mask, by, SHAPE[::-1])
    inner = (slice(8, -8), slice(8, -8))
    np.testing.assert_allclose(bent.mask[inner], wanted[inner], atol=0.15)


@given(st.integers(0, len(grid()) - 1), st.floats(3, 40))
def test_one_point_on_something_else_changes_nothing(which: int, far: float) -> None:
    points = grid()
    after = points + np.float32(2)
    clean = deformation(SHAPE, POSE, POSE, (points, after))
    after[which] += np.float32(far)
    motion = deformation(SHAPE, POSE, POSE, (points, after))
    assert clean is not None
    assert motion is not None
    np.testing.assert_allclose(motion, clean, atol=0.01)


@given(poses, st.floats(0.9, 1.1))
def test_a_pose_keeps_the_size_that_the_camera_gives_it(folded: PatchPose, zoom: float) -> None:
    points = grid()
    camera = np.array([[zoom, 0, 3], [0, zoom, -2]])
    after = moved(points, POSE, folded)
    kept = with_former_size(folded, POSE, (points, after), camera)
    assert kept.scale == pytest.approx(POSE.scale * zoom)
    assert kept.angle == folded.angle
    off = after - moved(points, POSE, kept)
    np.testing.assert_allclose(np.median(off, axis=0), 0, atol=0.01)


def test_points_on_the_background_are_not_the_objects() -> None:
    image, mask = arm(0.0)
    scene = prepare_scene(image, 0.0)
    way = np.array([np.cos(-1.2), np.sin(-1.2)])
    on_arm = np.array([SHOULDER + far * way for far in (15, 35, 55)], dtype=np.float32)
    off_arm = np.array([(20, 20), (200, 150)], dtype=np.float32)
    assert all(mask[int(y), int(x)] for x, y in on_arm)
    after = np.concatenate([on_arm, off_arm])
    before = after - np.float32(2)
    kept = points_of_own_colour(scene, (before, after), MODEL.colours)
    np.testing.assert_array_equal(kept[0], before[: len(on_arm)])
    np.testing.assert_array_equal(kept[1], on_arm)


@given(st.floats(0, 1))
def test_an_appearance_is_refreshed_within_its_mask_by_a_share_of_the_frame(rate: float) -> None:
    frame = np.full_like(MODEL.lab, 100)
    fresh = refreshed(MODEL, frame, rate)
    inside, outside = MODEL.mask > 0.99, MODEL.mask == 0
    wanted = MODEL.lab + rate * (100.0 - MODEL.lab)
    np.testing.assert_allclose(fresh.lab[inside], wanted[inside], atol=2)
    np.testing.assert_array_equal(fresh.lab[outside], MODEL.lab[outside])


def iou(tracker: TaughtObjectTracker, mask: Mask) -> float:
    """Overlap of what a tracker sees of the arm with a mask."""
    (track,) = tracker.tracks
    if track.visible is None:
        return 0.0
    seen = np.zeros_like(mask)
    left, top, right, bottom = track.visible.window
    seen[top:bottom, left:right] = track.visible.mask
    return float(np.count_nonzero(seen & mask) / np.count_nonzero(seen | mask))


def tracker_of_arm() -> TaughtObjectTracker:
    image, mask = arm(0.0)
    return TaughtObjectTracker(view_models([taught_view_from_mask("arm", image, mask)]))


def step(tracker: TaughtObjectTracker, number: int) -> Mask:
    """Track the arm in one of the frames in which it bends; its mask there."""
    image, mask = arm(BEND * number / (FRAMES - 1))
    tracker.step(prepare_scene(image, number / 15), lambda _: 1)
    return mask


def followed() -> float:
    """Overlap at the end of an arm that was followed while its elbow bent."""
    tracker = tracker_of_arm()
    masks = [step(tracker, k) for k in range(FRAMES)]
    return iou(tracker, masks[-1])


def test_an_arm_that_bends_is_followed() -> None:
    assert followed() > 0.7


def test_without_deformation_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(short_term_tracking, "deformation", lambda *_: None)
    assert followed() < 0.6


def shifts_all(shape: tuple[int, int], *_: object) -> Floats:
    """A wrong deformation: the whole object is said to be elsewhere."""
    return np.full((*shape, 2), 8, dtype=np.float32)


@pytest.mark.parametrize("differs", [True, False])
def test_a_wrong_deformation_is_not_taken(monkeypatch: pytest.MonkeyPatch, differs: bool) -> None:
    """It differs more from the frame; and if it did not, its colours would be those of the table."""
    if differs:
        monkeypatch.setattr(short_term_tracking, "COLOUR_MARGIN", 2.0)  # more than colours can cost
    else:
        monkeypatch.setattr(short_term_tracking, "mean_difference", lambda *_: 0.0)
    monkeypatch.setattr(short_term_tracking, "deformation", lambda *_: None)
    rigid = followed()
    monkeypatch.setattr(short_term_tracking, "deformation", shifts_all)
    assert followed() == rigid


@pytest.mark.parametrize("right", [True, False])
def test_an_arm_that_nothing_else_locates_is_seen_where_its_points_bend_it(
    monkeypatch: pytest.MonkeyPatch, right: bool
) -> None:
    """Unless what the bent arm should look like is not there."""
    tracker, last = tracker_of_arm(), 8
    for k in range(last):
        step(tracker, k)
    monkeypatch.setattr(short_term_tracking, "_track_moving", lambda track, *_: track)
    monkeypatch.setattr(short_term_tracking, "colour_agreement", lambda _, pose, __: (1.0, pose))
    if not right:
        monkeypatch.setattr(short_term_tracking, "deformation", shifts_all)
    step(tracker, last)
    assert (tracker.tracks[0].last_seen == last / 15) is right
