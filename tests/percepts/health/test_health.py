"""Camera faults are reported within a second, and sound video never is."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.paths import SHARED
from tests.percepts.motion.clips import clip, texture
from visup.agent import Frame, HealthStatus
from visup.agent.model.errors import SettingsError
from visup.evaluation.health.camera_faults import EXPECTED_STATUS, inject
from visup.evaluation.health.runner import (
    back_and_forth,
    evaluate_health,
    find_sources,
    plan_trials,
    statuses,
)
from visup.percepts.health.frame_timing import ArrivalMonitor
from visup.percepts.health.image_quality import measure_quality
from visup.percepts.health.repeated_frames import Repeat

START, LENGTH = 20, 50
OK = HealthStatus.OK
Frames = Sequence[Frame]
Scene = Callable[[], tuple[Frame, ...]]


@cache
def ground() -> np.ndarray:
    """Structure of a few dozen pixels, as a lens gives it."""
    return np.asarray(cv2.resize(texture(1, (80, 120), 0, 255), (480, 320)), np.uint8)


@cache
def panning() -> tuple[Frame, ...]:
    disc = (lambda n: (60 + 2.0 * n, 80.0), 24.0, texture(2, (320, 480), 0, 255))
    shots = clip(ground(), lambda n: (20 + 1.5 * n, 30), [disc], LENGTH)
    return tuple(s.frame for s in shots)


@cache
def street() -> tuple[Frame, ...]:
    """A still camera; two things pass."""
    one = (lambda n: (30 + 3.0 * n, 60.0), 16.0, texture(2, (320, 480), 0, 255))
    two = (lambda n: (200 - 2.0 * n, 120.0), 12.0, texture(3, (320, 480), 120, 255))
    shots = clip(ground(), lambda n: (20, 30), [one, two], LENGTH, noise=1.5)
    return tuple(s.frame for s in shots)


@cache
def sky() -> tuple[Frame, ...]:
    """A dark sky; an arm comes at a pixel a frame, a satellite hardly moves."""
    satellite = (lambda n: (70 + 0.1 * n, 60.0), 26.0, texture(2, (320, 480), 60, 255))
    arm = (lambda n: (200 - 1.0 * n, 110.0), 30.0, texture(4, (320, 480), 40, 200))
    dark = np.full((320, 480), 3, np.uint8)
    shots = clip(dark, lambda n: (0, 0), [satellite, arm], LENGTH, noise=0.5)
    return tuple(s.frame for s in shots)


SCENES: tuple[Scene, ...] = (panning, street, sky)


def told(frames: Frames) -> list[HealthStatus]:
    return [status for _, status in statuses(frames)]


def within_a_second(frames: Frames) -> set[HealthStatus]:
    since = frames[START].time
    return {s for f, s in statuses(frames) if since <= f.time <= since + 1.0 + 1e-6} - {OK}


def changed(frames: Frames, start: int, change: Callable[[np.ndarray, int], np.ndarray]) -> Frames:
    return [
        Frame(f.index, f.time, change(f.image, n).astype(np.uint8)) if n >= start else f
        for n, f in enumerate(frames)
    ]


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("kind", sorted(EXPECTED_STATUS))
def test_each_fault_is_named_within_a_second(scene: Scene, kind: str) -> None:
    for seed in range(2):
        harmed = inject(scene(), START, kind, seed)
        assert EXPECTED_STATUS[kind] in within_a_second(harmed), seed
        assert set(told(harmed)[:START]) == {OK}


@given(st.sampled_from(("black", "white", "noise", "blocked")), st.integers(0, 10_000))
@settings(max_examples=12, deadline=None)
def test_whatever_is_drawn_is_reported(kind: str, seed: int) -> None:
    assert within_a_second(inject(panning(), START, kind, seed))


@pytest.mark.parametrize("scene", SCENES)
def test_sound_video_is_well_even_through_codecs(scene: Scene, tmp_path: Path) -> None:
    assert set(told(scene())) == {OK}
    path = str(tmp_path / "clip.mp4")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"mp4v"), 25, scene()[0].size)
    for frame in scene():
        writer.write(frame.image)
    writer.release()
    capture = cv2.VideoCapture(path)
    coded = [Frame(f.index, f.time, np.asarray(capture.read()[1], np.uint8)) for f in scene()]
    assert set(told(coded)) == {OK}


@pytest.mark.parametrize("gain", [0.5, 0.8, 1.3])
@pytest.mark.parametrize("scene", SCENES)
def test_a_step_of_exposure_is_no_fault(scene: Scene, gain: float) -> None:
    stepped = changed(scene(), START, lambda image, n: np.clip(image * gain, 0, 255))
    assert set(told(stepped)) == {OK}


@pytest.mark.parametrize("scene", SCENES)
def test_an_image_that_fades_and_comes_back_is_no_cover(scene: Scene) -> None:
    def fade(image: np.ndarray, n: int) -> np.ndarray:
        return np.asarray(image * (0.6 + 0.4 * np.cos(n / 8)))

    assert not set(told(changed(scene(), 0, fade))) - {OK, HealthStatus.DARK}


def test_one_thing_that_stops_is_not_frozen() -> None:
    disc = (lambda n: (60 + 2.0 * min(n, 25), 80.0), 24.0, texture(2, (320, 480), 0, 255))
    shots = clip(ground(), lambda n: (20, 30), [disc], 60)
    assert set(told([s.frame for s in shots])) == {OK}


def test_a_still_image_from_the_start_is_not_called_frozen() -> None:
    image = panning()[0].image
    assert set(told([Frame(n, n / 25, image) for n in range(40)])) == {OK}


@pytest.mark.parametrize("kind", ["black", "white", "noise", "scrambled", "blocked", "frozen"])
def test_recovery_is_told(kind: str) -> None:
    frames = panning()
    harmed = inject(frames[:40], START, kind, 3)
    said = told([*harmed, *frames[40:]])
    assert said[39] is EXPECTED_STATUS[kind]
    assert set(said[42:]) == {OK}


def test_small_colourless_and_odd_images_do_not_fail() -> None:
    rng = np.random.default_rng(1)
    for shape in ((1, 1, 3), (2, 7, 3), (33, 9, 3), (20, 30), (64, 48, 1), (5, 400, 3)):
        images = [rng.integers(0, 256, shape).astype(np.uint8) for _ in range(20)]
        assert len(told([Frame(n, n / 25, i) for n, i in enumerate(images)])) == 20
    sizes = [panning()[0].image[: 80 + n, :200] for n in range(20)]
    assert set(told([Frame(n, n / 25, i) for n, i in enumerate(sizes)])) == {OK}


def test_the_same_frames_give_the_same_report() -> None:
    harmed = inject(sky(), START, "scrambled", 5)
    assert told(harmed) == told(harmed)


@given(st.integers(8, 40), st.integers(0, 7), st.integers(0, 7))
@settings(max_examples=15, deadline=None)
def test_straight_steps_are_counted_wherever_the_grid_lies(size: int, x: int, y: int) -> None:
    tiles = np.random.default_rng(size).integers(0, 256, (40, 60)).astype(np.uint8)
    board = np.kron(tiles, np.ones((size, size), np.uint8))[y : y + 160, x : x + 240]
    turned = np.asarray(cv2.GaussianBlur(board, (0, 0), 1.2), np.uint8)
    assert measure_quality(board).steps > 0.01
    assert measure_quality(turned).steps < 0.001


@given(st.floats(3.0, 60.0), st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_noise_is_measured(sigma: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = np.clip(128 + rng.normal(0, sigma, (96, 160, 3)), 0, 255).astype(np.uint8)
    assert measure_quality(image).noise == pytest.approx(sigma, rel=0.35, abs=1.0)


def come(steps: Sequence[int], every: int = 1, rate: float = 25.0) -> list[int]:
    """What is missing after each frame, for given distances between frames."""
    arrivals = ArrivalMonitor(lost=0.2, gap=3, frozen_s=0.5)
    numbers = np.cumsum([0, *steps]) * every
    return [arrivals.arrive(int(n), n / rate, Repeat()) for n in numbers]


@given(st.integers(1, 9), st.floats(5.0, 60.0), st.integers(3, 30))
@settings(max_examples=40, deadline=None)
def test_a_gap_is_told_at_any_rate_and_only_then(every: int, rate: float, gap: int) -> None:
    assert not any(come([1] * 30, every, rate))
    said = come([1] * 15 + [1 + gap] + [1] * 40, every, rate)
    assert not any(said[:16])
    assert said[16] >= gap
    assert said[-1] == 0 or 40 / (rate / every) < 1.0


@given(st.lists(st.integers(1, 2), min_size=30, max_size=60))
@settings(max_examples=30, deadline=None)
def test_missing_frames_are_those_that_did_not_come(steps: list[int]) -> None:
    said = come([1] * 20 + steps)
    for n, missing in enumerate(said):
        recent = ([1] * 20 + steps)[max(0, n - 30) : n]
        assert missing <= sum(s - 1 for s in recent)


def test_a_camera_that_always_repeats_frames_drops_none() -> None:
    halved = [Frame(n, n / 25, panning()[n // 2 * 2].image) for n in range(LENGTH)]
    assert set(told(halved)) == {OK}


def bench(places: Sequence[float], noise: float = 0.0) -> list[Frame]:
    """A still camera; one thing stands at given places, the rest rests."""
    disc = (lambda n: (60 + places[n], 90.0), 24.0, texture(2, (320, 480), 0, 255))
    return [s.frame for s in clip(ground(), lambda n: (20, 30), [disc], len(places), noise=noise)]


@given(
    st.integers(1, 9), st.sampled_from((1, 4, 8)), st.sampled_from((0.0, 1.5)), st.integers(2, 3)
)
@settings(max_examples=6, deadline=None)
def test_a_mover_that_pauses_drops_no_frames(
    rest: int, ramp: int, noise: float, pauses: int
) -> None:
    """With the very same image again and again while it rests, where there is no noise."""
    paces = [2.5 * (n + 1) / (ramp + 1) for n in range(ramp)]
    once = [2.5] * 12 + paces[::-1] + [0.0] * rest + paces
    places = np.cumsum([*once * pauses, *[2.5] * 6])
    assert set(told(bench(places.tolist(), noise))) == {OK}


@given(st.integers(0, 1000), st.sampled_from((0.0, 1.5)))
@settings(max_examples=5, deadline=None)
def test_frames_repeated_while_something_moves_are_missing(seed: int, noise: float) -> None:
    frames = bench([2.5 * n for n in range(LENGTH)], noise)
    came = np.random.default_rng(seed).random(LENGTH) > 0.5
    came[:START] = True
    # The image of the last frame that came stands in for those that did not.
    newest = np.maximum.accumulate(np.where(came, np.arange(LENGTH), 0))
    stalled = [Frame(f.index, f.time, frames[k].image) for f, k in zip(frames, newest, strict=True)]
    assert HealthStatus.DROPPED in told(stalled)


def test_frames_that_come_too_late_and_then_too_early_are_not_missing() -> None:
    arrivals = ArrivalMonitor(lost=0.1, gap=3, frozen_s=0.5)
    late = [n / 25 + (0.04 if n > 20 and n % 4 == 0 else 0.0) for n in range(80)]
    assert not any(arrivals.arrive(n, time, Repeat()) for n, time in enumerate(late))


def test_a_campaign_is_drawn_from_its_seed() -> None:
    sources = [Path("a"), Path("b"), Path("c")]
    assert list(plan_trials(sources, 30, 4)) == list(plan_trials(sources, 30, 4))
    assert list(plan_trials(sources, 30, 4)) != list(plan_trials(sources, 30, 5))
    assert {t.kind for t in plan_trials(sources, 30, 4)} == set(EXPECTED_STATUS)
    assert {t.source for t in plan_trials(sources, 3, 4)} == set(sources)


@pytest.mark.parametrize("kind", sorted(EXPECTED_STATUS))
def test_an_injection_spares_what_came_before_and_keeps_time(kind: str) -> None:
    harmed = inject(panning(), START, kind, 9)
    assert harmed[:START] == list(panning()[:START])
    assert all(a.time < b.time and a.index < b.index for a, b in pairwise(harmed))
    assert all(f.image.shape == panning()[0].image.shape for f in harmed)
    again = inject(panning(), START, kind, 9)
    assert all(np.array_equal(a.image, b.image) for a, b in zip(harmed, again, strict=True))


def test_the_campaign_scores_what_is_reported(tmp_path: Path) -> None:
    place = tmp_path / "pan" / "frames"
    place.mkdir(parents=True)
    for frame in panning():
        cv2.imwrite(str(place / f"{frame.index:05d}.png"), frame.image)
    (tmp_path / "pan" / "masks").mkdir()
    cv2.imwrite(str(tmp_path / "pan" / "masks" / "0.png"), panning()[0].image)
    assert find_sources(tmp_path) == [place]
    figures = evaluate_health(tmp_path, faults=7, seed=1)
    assert set(figures["items"]) == set(EXPECTED_STATUS)
    total = figures["total"]
    assert total["clips"] == 7
    assert total["false_reports"] == 0
    assert total["hours"] == pytest.approx(49 / 25 / 3600)
    assert total["found"] >= total["named"] >= 6 / 7
    json.dumps(figures)


def test_a_campaign_without_video_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no video"):
        evaluate_health(tmp_path)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared data is not there")
def test_shared_video_keeps_the_bar_in_a_quick_look() -> None:
    total = evaluate_health(SHARED / "video" / "static", faults=7, limit=200)["total"]
    assert total["named"] == 1.0
    assert total["false_reports"] == 0


@given(st.integers(2, 9), st.integers(1, 60))
def test_a_short_clip_is_shown_to_and_fro(count: int, length: int) -> None:
    images = [np.full((2, 2, 3), k, np.uint8) for k in range(count)]
    shown = back_and_forth([Frame(k, 0.04 * k, image) for k, image in enumerate(images)], length)
    tones = [int(f.image[0, 0, 0]) for f in shown]
    assert len(shown) == length
    assert tones[:count] == list(range(count))[:length]
    assert all(abs(b - a) == 1 for a, b in pairwise(tones))
    assert all(b.index == a.index + 1 and b.time > a.time for a, b in pairwise(shown))
