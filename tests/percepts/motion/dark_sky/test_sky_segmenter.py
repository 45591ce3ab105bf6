"""Regions of motion take the outlines of bodies before a dark sky; bodies that drift get regions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from tests.percepts.motion.dark_sky.scenes import SHAPE, alike, bar, disc, painted
from visup.agent import Frame, Region
from visup.percepts.motion import MotionSegmenter
from visup.percepts.motion.dark_sky.sky_segmenter import DarkSkySegmenter
from visup.percepts.motion.outlines.region_outline import describe_mask
from visup.percepts.motion.tracks.id_allocator import IdAllocator

FPS = 12.5
SIZE = (SHAPE[1], SHAPE[0])


def region(mask: np.ndarray, number: int) -> Region:
    return describe_mask(mask, (0, 0), SIZE).region(number, (3.0, 0.0), 1.0, 0.8)


def whole(one: Region) -> np.ndarray:
    out = np.zeros(SHAPE, bool)
    x, y, w, h = one.bbox
    out[y : y + h, x : x + w] = one.mask
    return out


class Run:
    """A segmenter with its ids, frame after frame."""

    def __init__(self, last: int = 0) -> None:
        self.segmenter, self.ids, self.k = DarkSkySegmenter(), IdAllocator(), 0
        self.ids.reserve(last)

    def step(
        self, tone: np.ndarray, regions: Sequence[Region] = (), shift: tuple[float, float] = (0, 0)
    ) -> tuple[Region, ...]:
        frame = Frame(self.k, self.k / FPS, np.repeat(tone[..., None], 3, axis=2))
        self.k += 1
        return self.segmenter.outlined(frame, tuple(regions), shift, 40.0, self.ids)


def test_fragments_become_one_region_with_the_outline_of_the_body() -> None:
    body, run = disc(80, 60, 16), Run(last=9)
    parts = [region(disc(74, 56, 7), 4), region(disc(88, 64, 6), 7)]
    found = run.step(painted([body], [120]), parts)
    assert [r.id for r in found] == [4]
    assert alike(whole(found[0]), body) > 0.85
    assert found[0].velocity == (3.0, 0.0)
    # It is reported under its number although only the other fragment is seen, or none.
    assert [r.id for r in run.step(painted([body], [120], 1), parts[1:])] == [4]
    assert [r.id for r in run.step(painted([body], [120], 2))] == [4]


def test_two_bodies_keep_their_own_regions() -> None:
    a, b, run = disc(40, 60, 12), disc(120, 60, 12), Run(last=2)
    found = run.step(painted([a, b], [120, 90]), [region(a, 1), region(b, 2)])
    assert [r.id for r in found] == [1, 2]
    # The track of one goes over to the other: numbers stay with the bodies.
    found = run.step(painted([a, b], [120, 90], 1), [region(b, 1)])
    assert {r.id: alike(whole(r), m) > 0.85 for r, m in zip(found, (a, b), strict=True)} == {
        1: True,
        2: True,
    }


def test_a_track_that_passes_to_another_body_does_not_lend_it_the_number() -> None:
    a, b, run = disc(40, 60, 12), disc(120, 60, 12), Run(last=1)
    assert [r.id for r in run.step(painted([a, b], [120, 90]), [region(a, 1)])] == [1]
    found = run.step(painted([a, b], [120, 90], 1), [region(b, 1)])
    assert len({r.id for r in found}) == len(found) == 2
    own = next(r for r in found if r.id == 1)
    assert alike(whole(own), a) > 0.85


def test_a_body_in_full_view_moves_as_its_way_tells() -> None:
    run = Run(last=1)
    for k in range(12):
        body = disc(60 + 0.5 * k, 60, 14)
        found = run.step(painted([body], [120], k), [region(body, 1)])
    assert found[0].velocity[0] == pytest.approx(0.5 * FPS, rel=0.3)


def test_small_holes_are_filled() -> None:
    ring, run = disc(80, 60, 16) & ~disc(80, 60, 3), Run(last=1)
    found = run.step(painted([ring], [120]), [region(ring, 1)])
    assert whole(found[0])[60, 80]


def test_a_small_body_at_rest_is_reported_only_once_it_drifts() -> None:
    run = Run(last=5)
    for k in range(20):
        assert run.step(painted([disc(80, 60, 4)], [120], k)) == ()
    told = [run.step(painted([disc(80 + 0.5 * k, 60, 4)], [120], k)) for k in range(25)]
    assert told[0] == ()
    assert [r.id for r in told[-1]] == [6]
    assert told[-1][0].velocity[0] == pytest.approx(0.5 * FPS, rel=0.3)


def test_a_large_body_at_rest_is_reported_after_a_second() -> None:
    body, run = disc(80, 60, 14), Run(last=5)
    told = [run.step(painted([body], [120], k)) for k in range(20)]
    assert all(regions == () for regions in told[:12])
    assert [[r.id for r in regions] for regions in told[14:]] == [[6]] * 6
    assert alike(whole(told[-1][0]), body) > 0.85
    assert told[-1][0].velocity == (0.0, 0.0)


def test_a_large_body_that_the_border_cuts_is_not_reported_at_rest() -> None:
    run = Run()
    for k in range(30):
        assert run.step(painted([disc(5, 60, 14)], [120], k)) == ()
    assert run.ids.new() == 1  # none was given


def test_a_body_that_the_border_cuts_is_reported_when_it_halts() -> None:
    arm, run = bar(0, 90, 50, 62), Run(last=3)
    assert [r.id for r in run.step(painted([arm], [120]), [region(arm, 3)])] == [3]
    told = [run.step(painted([arm], [120], k)) for k in range(1, 40)]
    assert {tuple(r.id for r in regions) for regions in told} == {(3,)}
    assert alike(whole(told[-1][0]), arm) > 0.85
    assert told[-1][0].velocity == (0.0, 0.0)


def test_a_small_body_that_moves_with_the_ground_is_not_reported() -> None:
    run = Run()
    for k in range(30):
        assert run.step(painted([disc(40 + k, 60, 4)], [120], k), (), (-1.0, 0.0)) == ()


def test_a_small_mover_before_a_ground_that_the_border_cuts_stays_as_it_is() -> None:
    ground, run = bar(0, 160, 90, 120), Run(last=1)
    mover = region(bar(60, 76, 95, 108), 1)
    assert run.step(painted([ground], [120]), [mover]) == (mover,)


def test_without_a_dark_sky_nothing_changes() -> None:
    run, there = Run(last=1), region(disc(60, 60, 10), 1)
    assert run.step(np.full(SHAPE, 90, np.uint8), [there]) == (there,)


def test_the_motion_segmenter_sees_what_drifts_slowly() -> None:
    """A quarter of a pixel in a second: no motion over one frame tells it."""
    segmenter = MotionSegmenter()
    found: tuple[Region, ...] = ()
    for k in range(45):
        ys, xs = np.mgrid[:240, :320]
        inside = np.clip(30.5 - np.hypot(xs - 160 - 0.08 * k, ys - 120), 0, 1)
        grey = np.clip(4 + 130 * inside, 0, 255).astype(np.uint8)
        found = segmenter.step(Frame(k, k / FPS, np.repeat(grey[..., None], 3, axis=2)))
    assert len(found) == 1
    assert found[0].area == pytest.approx(np.pi * 30**2, rel=0.05)
