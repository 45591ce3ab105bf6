from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import numpy as np
import pytest

from tests.percepts.motion.clips import FPS, SIZE, Shot, clip, texture
from visup.agent import Directive, Frame, Region
from visup.agent.model.errors import SettingsError
from visup.evaluation.motion.mask_scores import iou
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.segmenter import MotionSegmenter

WIDE = texture(1, (320, 480))
SKIN = texture(2, (320, 480), 0, 255)
OTHER = texture(3, (320, 480), 90, 255)
DARK = texture(4, (320, 480), 0, 110)
SKY = np.full((320, 480), 4, np.uint8)
WALL = np.full((320, 480), 60, np.uint8)
PLAINS = {"dark sky": SKY, "grey wall": WALL}
PLAIN = pytest.mark.parametrize("plain", PLAINS)
Seen = list[tuple[Region, ...]]


def run(shots: Iterable[Shot], directives: tuple[Directive, ...] = ()) -> Seen:
    segmenter = MotionSegmenter()
    return [segmenter.step(shot.frame, directives) for shot in shots]


def best(regions: tuple[Region, ...], mask: np.ndarray) -> tuple[float, int]:
    return max(((iou(r.full_mask(SIZE[::-1]), mask), r.id) for r in regions), default=(0.0, 0))


def moving_over_pan(frames: int = 45, colour: bool = False) -> list[Shot]:
    disc = (lambda n: (60 + 2.0 * n, 80 - 0.5 * n), 24.0, SKIN)
    return list(clip(WIDE, lambda n: (20 + 1.2 * n, 30 + 0.4 * n), [disc], frames, colour=colour))


@cache  # several tests read what is seen of the same clip
def seen_over_pan(colour: bool) -> tuple[list[Shot], Seen]:
    shots = moving_over_pan(colour=colour)
    return shots, run(shots)


@cache
def seen_drifting(plain: str) -> tuple[list[Shot], Seen]:
    disc = (lambda n: (100 + 0.06 * n, 80 + 0.02 * n), 28.0, SKIN)
    shots = list(clip(PLAINS[plain], lambda n: (0, 0), [disc], 80))
    return shots, run(shots)


@pytest.mark.parametrize("colour", [False, True])
def test_a_disc_is_found_over_a_panning_background(colour: bool) -> None:
    shots, seen = seen_over_pan(colour=colour)
    late = [best(r, s.masks[0]) for r, s in zip(seen[20:], shots[20:], strict=True)]
    assert np.mean([j for j, _ in late]) > 0.75
    assert len({number for j, number in late if j > 0.5}) == 1


def test_velocity_is_that_of_the_image_with_its_sigma() -> None:
    shots, seen = seen_over_pan(colour=False)
    region = max(seen[-1], key=lambda r: iou(r.full_mask(SIZE[::-1]), shots[-1].masks[0]))
    error = np.hypot(region.velocity[0] - 2.0 * FPS, region.velocity[1] + 0.5 * FPS)
    assert error < 3.0
    assert 0 < region.velocity_sigma < 5.0


@PLAIN
def test_a_disc_that_drifts_is_found_within_two_seconds(plain: str) -> None:
    shots, seen = seen_drifting(plain)
    late = [best(r, s.masks[0]) for r, s in zip(seen[50:], shots[50:], strict=True)]
    assert np.mean([j for j, _ in late]) > 0.75
    assert len({number for _, number in late}) == 1
    last = max(seen[-1], key=lambda r: r.area)
    assert np.hypot(last.velocity[0] - 1.5, last.velocity[1] - 0.5) < 0.5


@PLAIN
def test_nothing_is_invented_beside_it(plain: str) -> None:
    shots, seen = seen_drifting(plain)
    for regions, shot in zip(seen, shots, strict=True):
        for region in regions:
            assert (region.full_mask(SIZE[::-1]) & shot.masks[0]).sum() > 0.5 * region.area


@pytest.mark.parametrize("camera", [(0.0, 0.0), (1.5, -0.5)])
def test_where_nothing_moves_by_itself_nothing_is_reported(camera: tuple[float, float]) -> None:
    shots = clip(WIDE, lambda n: (20 + camera[0] * n, 90 + camera[1] * n), [], 40)
    assert all(not regions for regions in run(shots))


@PLAIN
def test_a_disc_that_stops_is_kept_under_its_id(plain: str) -> None:
    disc = (lambda n: (60 + 2.0 * min(n, 30), 80.0), 24.0, SKIN)
    shots = list(clip(PLAINS[plain], lambda n: (0, 0), [disc], 120))
    seen = run(shots)
    late = [best(r, s.masks[0]) for r, s in zip(seen[25:], shots[25:], strict=True)]
    assert min(j for j, _ in late) > 0.6
    assert len({number for _, number in late}) == 1


def test_discs_that_cross_keep_their_ids() -> None:
    discs = [
        (lambda n: (50 + 1.5 * n, 70.0), 22.0, DARK),
        (lambda n: (190 - 1.5 * n, 95.0), 22.0, OTHER),
    ]
    shots = list(clip(WIDE, lambda n: (20, 30), discs, 90))
    seen = run(shots)
    before = [best(seen[25], m)[1] for m in shots[25].masks]
    after = [best(seen[85], m) for m in shots[85].masks]
    assert [number for _, number in after] == before
    assert min(j for j, _ in after) > 0.6


def test_the_same_frames_give_the_same_regions_bit_for_bit_whatever_comes_later() -> None:
    one, two = run(moving_over_pan(30)), seen_over_pan(colour=False)[1][:30]
    assert any(one)
    for a, b in zip(one, two, strict=True):
        assert [r.id for r in a] == [r.id for r in b]
        for p, q in zip(a, b, strict=True):
            assert p.bbox == q.bbox
            assert p.velocity == q.velocity
            assert np.array_equal(p.mask, q.mask)
            assert np.array_equal(p.contour, q.contour)


def test_regions_keep_their_contract() -> None:
    shots, seen = seen_over_pan(colour=False)
    for regions, shot in zip(seen, shots, strict=True):
        assert [r.id for r in regions] == sorted({r.id for r in regions})
        for r in regions:
            x, y, w, h = r.bbox
            assert r.mask.shape == (h, w)
            assert r.mask[[0, -1]].any(1).all()
            assert r.mask[:, [0, -1]].any(0).all()
            assert r.area == r.mask.sum()
            assert r.contour.dtype == np.float32
            assert r.contour.shape[1] == 2
            assert min(x, y) >= 0
            assert x + w <= shot.frame.size[0]
            assert y + h <= shot.frame.size[1]
            edge = x == 0 or y == 0 or x + w == SIZE[1] or y + h == SIZE[0]
            assert r.cut == edge
            assert 0 <= r.confidence <= 1


def test_ignore_leaves_out_what_moves_in_its_box() -> None:
    shots, seen = seen_over_pan(colour=False)
    assert any(seen)
    everywhere = Directive("ignore", "a test", {"bbox": (0, 0, SIZE[1], SIZE[0])})
    assert not any(run(shots, (everywhere,)))


def test_expected_regions_bound_the_number() -> None:
    discs = [
        (lambda n: (50 + 1.5 * n, 40.0), 20.0, SKIN),
        (lambda n: (190 - 1.5 * n, 110.0), 20.0, OTHER),
    ]
    shots = list(clip(WIDE, lambda n: (20, 30), discs, 35))
    assert max(len(r) for r in run(shots)) >= 2
    one = Directive("expect_regions", "a test", {"count": 1})
    assert max(len(r) for r in run(shots, (one,))) == 1


@pytest.mark.parametrize("shape", [(16, 16), (33, 200), (240, 31, 1), (50, 70, 3)])
def test_any_shape_is_taken(shape: tuple[int, ...]) -> None:
    segmenter = MotionSegmenter()
    rng = np.random.default_rng(0)
    for n in range(6):
        image = rng.integers(0, 256, shape).astype(np.uint8)
        assert isinstance(segmenter.step(Frame(n, n / 10, image)), tuple)


def test_a_change_of_size_starts_anew() -> None:
    segmenter = MotionSegmenter()
    shots = moving_over_pan(20)
    for shot in shots:
        segmenter.step(shot.frame)
    small = Frame(20, 20 / FPS, np.zeros((60, 80, 3), np.uint8))
    assert segmenter.step(small) == ()


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(SettingsError, match="cell"):
        MotionSettings(cell=1)
    with pytest.raises(SettingsError, match="work_size"):
        MotionSettings(work_size=3)


def test_where_cogitation_asks_to_look_an_object_is_told_sooner() -> None:
    disc = (lambda n: (100 + 0.12 * n, 80.0), 24.0, SKIN)
    shots = list(clip(WALL, lambda n: (0, 0), [disc], 80))
    there = Directive("look_at", "a test", {"bbox": (60, 40, 100, 80)})
    elsewhere = Directive("look_at", "a test", {"bbox": (0, 0, 40, 40)})

    def first(directive: Directive) -> int:
        segmenter = MotionSegmenter()
        return next(n for n, s in enumerate(shots) if segmenter.step(s.frame, (directive,)))

    assert first(there) < first(elsewhere)


def test_what_is_ignored_leaves_the_other_object_as_it_is() -> None:
    discs = [
        (lambda n: (50 + 1.5 * n, 40.0), 20.0, SKIN),
        (lambda n: (190 - 1.5 * n, 115.0), 20.0, OTHER),
    ]
    shots = list(clip(WIDE, lambda n: (20 + 0.8 * n, 30), discs, 35))
    below = Directive("ignore", "a test", {"bbox": (0, 88, SIZE[1], SIZE[0] - 88)})

    def above(seen: Seen) -> float:
        late = zip(seen[20:], shots[20:], strict=True)
        return float(np.mean([best(r, s.masks[0])[0] for r, s in late]))

    without = run(shots, (below,))
    assert above(without) > above(run(shots)) - 0.02
    assert max(len(r) for r in without) == 1
