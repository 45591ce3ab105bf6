from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.clips import FPS, SIZE, Shot, clip, texture
from visup.agent import Frame, Region
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.outlines.region_outline import describe_mask
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.percepts.motion.static_camera.background_model import (
    foreground_mask,
    initial_model,
    match_exposure,
    reveal_background,
    shadow_mask,
    update_background,
    with_unknown,
)
from visup.percepts.motion.static_camera.blob_filters import (
    GHOST,
    THING,
    is_deep_shadow,
    is_salient_blob,
    outline_contrast,
)
from visup.percepts.motion.static_camera.blob_track import BlobTracks, find_blobs, tone_histogram
from visup.percepts.motion.static_camera.blob_tracker import track_blobs
from visup.percepts.motion.static_camera.static_segmenter import region_mask, swept_mask
from visup.percepts.motion.static_camera.track_fusion import (
    FusionFrame,
    MotionEvidence,
    TrackFusion,
    are_near,
    common_pixels,
)
from visup.percepts.motion.tracks.id_allocator import IdAllocator

GROUND = np.repeat(texture(1, SIZE)[..., None], 3, axis=2).astype(np.float32)
NOWHERE = np.zeros(SIZE, dtype=bool)


def box(x: int, y: int, w: int = 14, h: int = 30) -> np.ndarray:
    out = NOWHERE.copy()
    out[y : y + h, x : x + w] = True
    return out


def with_boxes(*boxes: tuple[np.ndarray, float]) -> np.ndarray:
    image = GROUND.copy()
    for mask, tone in boxes:
        image[mask] = tone
    return image


def followed(frames: list[np.ndarray]) -> list[BlobTracks]:
    known: BlobTracks = ()
    born, out = 0, []
    picture = initial_model(GROUND)
    for n, image in enumerate(frames):
        view = find_blobs(image, foreground_mask(picture, image), 20, n / FPS, 1 / FPS)
        known, born = track_blobs(known, view, born)
        out.append(known)
    return out


@pytest.mark.parametrize(
    ("seed", "dim", "shadow"),
    [(1, 0.45, True), (1, 0.55, True), (2, 0.45, False), (2, 1.0, False), (1, 0.2, False)],
)
def test_a_deep_shadow_is_the_rest_dimmed_by_one_factor(
    seed: int, dim: float, shadow: bool
) -> None:
    mask, image = box(100, 60, 40, 40), GROUND.copy()
    image[mask] = dim * np.repeat(texture(seed, SIZE)[..., None], 3, axis=2)[mask]
    (found,) = track_blobs((), find_blobs(image, mask, 20, 0.0, 1 / FPS), 0)[0]
    assert is_deep_shadow(found, image, GROUND) == shadow


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 220), st.integers(0, 125), st.sampled_from([0.0, 255.0]))
def test_what_differs_from_the_rest_is_changed_and_nothing_else(
    x: int, y: int, tone: float
) -> None:
    mask = box(x, y)
    found = foreground_mask(initial_model(GROUND), with_boxes((mask, tone)))
    assert (found & mask).sum() / (found | mask).sum() > 0.8


@pytest.mark.parametrize(("bright", "shadow"), [(0.75, True), (0.3, False), (1.4, False)])
def test_a_shadow_is_darker_but_not_dark(bright: float, shadow: bool) -> None:
    image = np.clip(GROUND * bright, 0, 255).astype(np.float32)
    lit = GROUND[..., 0] > 60
    assert shadow_mask(initial_model(GROUND), image)[lit].mean() == pytest.approx(
        float(shadow), abs=0.1
    )


def test_what_stood_there_first_is_given_up_soon_after_it_leaves() -> None:
    mask = box(100, 60)
    picture = initial_model(with_boxes((mask, 250.0)))
    for _ in range(20):
        update_background(picture, GROUND, NOWHERE, 1 / FPS)
    assert not foreground_mask(picture, GROUND).any()


def test_what_was_long_seen_is_kept_where_an_object_is_told() -> None:
    mask, picture = box(100, 60), initial_model(GROUND)
    for _ in range(100):
        update_background(picture, GROUND, NOWHERE, 1 / FPS)
    for _ in range(200):
        update_background(picture, with_boxes((mask, 250.0)), mask, 1 / FPS)
    assert np.abs(picture.mean - GROUND)[mask].max() < 5


def test_what_rests_before_ground_that_was_known_is_long_not_taken_for_ground() -> None:
    mask, picture = box(100, 60), initial_model(GROUND)
    for _ in range(25):
        update_background(picture, GROUND, NOWHERE, 1 / FPS)
    for _ in range(300):
        update_background(picture, with_boxes((mask, 250.0)), mask, 1 / FPS, None, mask)
    assert np.abs(picture.mean - GROUND)[mask].max() < 5


@pytest.mark.parametrize("left", [False, True], ids=["it came", "it has left"])
def test_what_came_has_its_outline_in_the_picture_and_what_left_in_the_model(left: bool) -> None:
    mask = box(100, 60, 40, 40)
    pictures = [with_boxes((mask, 250.0)), GROUND]
    now, before = pictures[left], pictures[not left]
    (found,) = track_blobs((), find_blobs(now, mask, 20, 0.0, 1 / FPS), 0)[0]
    contrast = outline_contrast(found, now, before)
    assert contrast is not None
    assert contrast < GHOST if left else contrast > THING


def test_a_change_of_exposure_is_no_change() -> None:
    brighter = (GROUND * 1.2).astype(np.float32)
    assert foreground_mask(initial_model(GROUND), brighter).mean() > 0.5
    assert not foreground_mask(match_exposure(initial_model(GROUND), brighter), brighter).any()


def test_a_histogram_sums_to_one_and_tells_tones_apart() -> None:
    light, dark = np.full((9, 3), 250.0, np.float32), np.full((9, 3), 5.0, np.float32)
    assert tone_histogram(light).sum() == pytest.approx(1.0)
    assert np.sqrt(tone_histogram(light) * tone_histogram(dark)).sum() == 0


def test_two_that_cross_keep_their_numbers_and_tones() -> None:
    frames = [
        with_boxes((box(30 + 3 * n, 60), 250.0), (box(180 - 3 * n, 66), 0.0)) for n in range(45)
    ]
    known = followed(frames)
    tones = [{s.key: float(s.tone[s.shape].mean()) for s in known[n]} for n in (5, 44)]
    assert set(tones[1]) >= set(tones[0])
    for key, tone in tones[0].items():
        assert abs(tones[1][key] - tone) < 60
    middle = known[25]
    assert len([s for s in middle if s.merged]) == 2


def test_one_that_is_gone_for_a_moment_is_known_again() -> None:
    frames = [with_boxes((box(30 + 2 * n, 60), 250.0)) for n in range(40)]
    for n in range(18, 26):
        frames[n] = GROUND
    known = followed(frames)
    assert [s.key for s in known[-1]] == [1]
    assert known[22][0].visible is None
    assert known[-1][0].visible is not None


def test_what_goes_to_and_fro_is_not_salient() -> None:
    course = followed([with_boxes((box(60 + n, 60), 250.0)) for n in range(20)])[-1][0]
    swing = followed([with_boxes((box(60 + 4 * (n % 2), 60), 250.0)) for n in range(20)])[-1][0]
    assert is_salient_blob(course)
    assert not is_salient_blob(swing)


@pytest.mark.parametrize(("near", "salient"), [(0.0, True), (1.0, False)])
def test_what_only_grows_on_one_side_is_not_salient(near: float, salient: bool) -> None:
    frames = [
        with_boxes((box(60 + round((1 - near) * n), 60, 14 + round(near * n)), 250.0))
        for n in range(20)
    ]
    assert is_salient_blob(followed(frames)[-1][0]) == salient


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 200), st.integers(0, 120))
def test_what_is_forgotten_shows_no_change_until_it_is_seen_bare(x: int, y: int) -> None:
    mask = box(x, y)
    with_object = with_boxes((mask, 250.0))
    picture = with_unknown(initial_model(with_object), mask)
    assert not foreground_mask(picture, GROUND)[mask].any()
    for _ in range(30):
        update_background(picture, with_object, NOWHERE, 1 / FPS)
    assert (picture.seen_s[mask] == 0).all()
    before = picture.mean.copy()
    reveal_background(picture, GROUND, ~NOWHERE)
    assert np.array_equal(picture.mean[mask], GROUND[mask])
    assert np.array_equal(picture.mean[~mask], before[~mask])
    assert not foreground_mask(picture, GROUND).any()


def region(mask: np.ndarray, velocity: tuple[float, float] = (0.0, 0.0), number: int = 1) -> Region:
    return describe_mask(mask, (0, 0), SIZE[::-1]).region(number, velocity, 1.0, 1.0)


@settings(deadline=None, max_examples=20)
@given(st.integers(60, 140), st.integers(40, 80), st.integers(-40, 40), st.integers(-30, 30))
def test_where_a_region_was_is_between_there_and_here(x: int, y: int, vx: int, vy: int) -> None:
    here = box(x, y)
    was = swept_mask(here, region(here, (vx, vy)), 1.0, 1.0)
    assert was[here].all()
    assert was[box(x - vx, y - vy)].all()
    left, right = min(x, x - vx), max(x, x - vx) + 14
    top, bottom = min(y, y - vy), max(y, y - vy) + 30
    assert not np.delete(was, np.s_[left:right], axis=1).any()
    assert not np.delete(was, np.s_[top:bottom], axis=0).any()


def test_what_regions_cover_is_a_little_wider_than_they_are() -> None:
    mask = box(100, 60)
    found = region_mask([region(mask)], SIZE[::-1], SIZE)
    assert found[mask].all()
    assert mask.sum() < found.sum() < 2.5 * mask.sum()
    assert not region_mask([], SIZE[::-1], SIZE).any()


def test_regions_touch_when_few_pixels_part_them() -> None:
    one = region(box(60, 60))
    assert are_near(one, region(box(77, 60)))
    assert not are_near(one, region(box(90, 60)))


def points(mask: np.ndarray, sure: float) -> MotionEvidence:
    ys, xs = np.nonzero(mask)
    xy = np.stack([xs, ys], axis=1)[::7].astype(np.float32)
    return MotionEvidence(xy, np.full(len(xy), sure, np.float32))


@pytest.mark.parametrize(
    ("sure", "many", "whole"),
    [(5.0, 100.0, True), (-5.0, 100.0, False), (5.0, 1000.0, False)],
    ids=["it moves", "it is at rest", "it is small"],
)
def test_a_region_is_told_whole_where_its_points_move_and_the_picture_sees_a_part(
    sure: float, many: float, whole: bool
) -> None:
    """Half of the region is of one tone with the rest."""
    body, part, born = box(60, 60, 40, 40), box(60, 60, 22, 40), 0
    fusion, ids = TrackFusion(), IdAllocator()
    ids.reserve(1)
    known: BlobTracks = ()
    told: tuple[Region, ...] = ()
    for n in range(12):
        shift = n * 4
        seen = np.roll(part, shift, axis=1)
        own = region(np.roll(body, shift, axis=1), (100.0, 0.0))
        image: Floats = with_boxes((seen, 250.0))
        view = find_blobs(image, seen, 20, n / FPS, 1 / FPS)
        known, born = track_blobs(known, view, born)
        fusion.note([own], n / FPS, 12.0)
        evidence = points(np.roll(body & ~part, shift, axis=1), sure)
        frame = FusionFrame(SIZE[::-1], view, evidence, many)
        told, known = fusion.fuse(frame, known, [own], ids)
    assert len(told) == 1
    assert (told[0].area == own.area) == whole


def test_two_regions_are_never_reported_under_one_id() -> None:
    """Region 2 was reported as blob 3; the track that is confirmed as 3 is another object."""
    fusion, ids = TrackFusion(), IdAllocator()
    ids.reserve(3)
    two, three = (replace(region(box(x, 60)), id=i) for i, x in ((2, 40), (3, 90)))
    fusion._note_alias(two, [replace(two, id=3)])
    assert [r.id for r in fusion.passthrough([two, three], ids, 1e9)] == [3, 4]
    assert [r.id for r in fusion.passthrough([three], ids, 1e9)] == [4]  # and so it stays


@given(st.dictionaries(st.integers(1, 6), st.integers(1, 6)), st.sets(st.integers(1, 6)))
def test_ids_are_unique_whatever_regions_were_reported_as(
    aliases: dict[int, int], living: set[int]
) -> None:
    fusion, ids = TrackFusion(), IdAllocator()
    ids.reserve(6)
    own = region(box(60, 60))
    for number, other in aliases.items():
        fusion._note_alias(replace(own, id=number), [replace(own, id=other)])
    seen = fusion.passthrough([replace(own, id=number) for number in sorted(living)], ids, 1e9)
    assert len({r.id for r in seen}) == len(living)


def thin(frames: int, camera: float = 0.0) -> list[Shot]:
    """Something 8 pixels wide, as a person far away."""
    disc = (lambda n: (20 + 1.5 * n, 80.0), 4.0, np.full((320, 480), 250, np.uint8))
    wide = texture(1, (320, 480))
    return list(clip(wide, lambda n: (20 + camera * n, 30), [disc], frames))


def test_small_things_are_seen_where_the_camera_rests() -> None:
    segmenter = MotionSegmenter()
    shots = thin(80)
    seen = [segmenter.step(s.frame) for s in shots]
    late = [
        max(
            (float((r.full_mask(SIZE[::-1]) & s.masks[0]).sum() / s.masks[0].sum()), r.id)
            for r in rs
        )
        for rs, s in zip(seen[45:], shots[45:], strict=True)
    ]
    assert min(share for share, _ in late) > 0.6
    assert len({number for _, number in late}) == 1


def test_what_comes_and_rests_does_not_shrink() -> None:
    """Its rim has some of the tone of the ground, which the background must not follow inwards."""
    skin = texture(3, (320, 480), 60, 255)
    disc = (lambda n: (-20 + 2.5 * (min(n, 75) - 30), 80.0), 18.0, skin)
    segmenter, areas = MotionSegmenter(), []
    for shot in clip(texture(1, (320, 480)), lambda n: (20, 30), [disc], 190, noise=3.0):
        seen = [r.full_mask(SIZE[::-1]) for r in segmenter.step(shot.frame)]
        areas.append(int((np.any(seen, axis=0) & shot.masks[0]).sum()) if seen else 0)
    assert min(areas[90:]) > 0.9 * shot.masks[0].sum()


def test_nothing_is_believed_of_a_picture_while_the_camera_moves() -> None:
    segmenter = MotionSegmenter()
    wide = texture(1, (320, 480))
    for shot in clip(wide, lambda n: (20 + 1.0 * n, 30), [], 40):
        segmenter.step(shot.frame)
        assert not segmenter.camera_static


def test_ids_are_given_once_in_a_frame() -> None:
    segmenter = MotionSegmenter()
    discs = [
        (lambda n: (50 + 1.5 * n, 70.0), 22.0, texture(2, (320, 480), 0, 255)),
        (lambda n: (190 - 1.5 * n, 95.0), 22.0, texture(3, (320, 480), 90, 255)),
    ]
    for shot in clip(texture(1, (320, 480)), lambda n: (20, 30), discs, 60):
        regions = segmenter.step(shot.frame)
        assert len({r.id for r in regions}) == len(regions)
        for a in regions:
            assert common_pixels(a, a) == a.area


def test_grey_frames_are_taken() -> None:
    segmenter = MotionSegmenter()
    for n, shot in enumerate(thin(40)):
        segmenter.step(Frame(n, n / FPS, shot.frame.image[..., 0]))
    assert segmenter.camera_static
