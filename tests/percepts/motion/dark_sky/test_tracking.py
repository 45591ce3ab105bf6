"""Laws: a body keeps its number and its outline while it passes, touches or covers another, or is hidden."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.motion.dark_sky.scenes import alike, bar, disc, painted
from visup.percepts.motion.dark_sky.body import SkyBody
from visup.percepts.motion.dark_sky.sky import bright_components
from visup.percepts.motion.dark_sky.tracking import Bodies, SkyFrame, track_bodies

FPS = 12.5
Masks = Sequence[np.ndarray]
Scene = Callable[[int], tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]]
"""Frame -> masks, levels and corners of bodies, the last one in front."""


def followed(scene: Scene, frames: int) -> list[Bodies]:
    """The bodies in each frame of a drawn scene."""
    out: list[Bodies] = []
    for k in range(frames):
        masks, levels, corners = scene(k)
        tone = painted(masks, levels, k, corners)
        found = bright_components(tone, 40.0)
        assert found is not None
        first = max((b.key for bodies in out for b in bodies), default=0) + 1
        here = SkyFrame(tone, found, k / FPS, (0.0, 0.0))
        out.append(track_bodies(out[-1] if out else (), here, first))
    return out


def body_at(bodies: Bodies, mask: np.ndarray) -> SkyBody:
    return max(bodies, key=lambda b: alike(b.visible, mask))


def seen(body: SkyBody, k: int) -> bool:
    return abs(body.last_seen - k / FPS) < 1e-6


@settings(deadline=None, max_examples=12)
@given(st.floats(1.5, 2.5), st.integers(-6, 6), st.sampled_from([(150.0, 90.0), (70.0, 200.0)]))
def test_one_passes_before_another(speed: float, high: int, levels: tuple[float, float]) -> None:
    there = disc(80, 60, 16)

    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        x = 15 + speed * k
        return [there, disc(x, 60 + high, 8)], levels, [(80, 60), (x, 60)]

    frames = int(125 / speed)
    all_ = followed(scene, frames)
    first = [body_at(all_[0], m).key for m in scene(0)[0]]
    for k, bodies in enumerate(all_):
        behind, before = scene(k)[0]
        assert {b.key for b in bodies if seen(b, k)} == set(first)
        by_key = {b.key: b for b in bodies}
        assert alike(by_key[first[1]].visible, before) > 0.7
        assert alike(by_key[first[0]].visible, behind & ~before) > 0.7
    assert len(all_[-1]) == 2


def test_the_arm_that_takes_hold_of_a_body_does_not_swallow_it() -> None:
    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        reach = min(20 + k, 66)
        way = max(0, k - 55) // 2
        masks = [disc(80 + way, 60, 16), bar(0, reach + way, 56, 64)]
        return masks, [140, 100], [(80 + way, 60), (reach + way, 60)]

    all_ = followed(scene, 90)
    satellite, arm = (body_at(all_[0], m).key for m in scene(0)[0])
    last = {b.key: b for b in all_[-1]}
    assert set(last) == {satellite, arm}
    assert alike(last[satellite].visible, scene(89)[0][0]) > 0.8
    assert alike(last[arm].visible, scene(89)[0][1] & ~scene(89)[0][0]) > 0.8
    assert not last[satellite].alone
    assert last[arm].cut
    assert not last[satellite].cut


def test_an_arm_that_reaches_across_a_body_is_one_arm_before_one_body() -> None:
    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        reach = min(30 + k, 120)
        return [disc(80, 60, 16), bar(0, reach, 56, 64)], [150, 90], [(80, 60), (reach, 60)]

    all_ = followed(scene, 100)
    satellite, arm = (body_at(all_[0], m).key for m in scene(0)[0])
    last = {b.key: b for b in all_[-1]}
    behind, before = scene(99)[0]
    assert set(last) == {satellite, arm}
    assert alike(last[arm].visible, before) > 0.85
    assert alike(last[satellite].visible, behind & ~before) > 0.85


def test_a_body_that_is_hauled_into_the_light_is_followed_to_where_it_stops() -> None:
    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        way = 0.5 * min(max(k - 15, 0), 60)
        light = 80 + 2 * min(max(k - 15, 0), 60)
        masks = [disc(80 + way, 60, 16), bar(0, round(66 + way), 56, 64)]
        return masks, [light, 100], [(80 + way, 60), (66 + way, 60)]

    before = [disc(80, 60, 16), bar(0, 58, 56, 64)], [80.0, 100.0], [(80.0, 60.0), (58.0, 60.0)]
    all_ = followed(lambda k: before if k < 15 else scene(k), 110)
    satellite = body_at(all_[0], before[0][0]).key
    last = next(b for b in all_[-1] if b.key == satellite)
    assert alike(last.visible, scene(109)[0][0] & ~scene(109)[0][1]) > 0.8
    # It is remembered as it looks now, not as it looked when it was last alone.
    assert abs(float(last.template.tone[last.template.mask].mean()) - 200) < 20


def test_what_comes_off_for_a_moment_is_a_part() -> None:
    """A shadow runs across a body, and for some frames parts an end of it from the rest."""

    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        shadow = bar(72, 80, 40, 80) if 20 <= k < 25 else bar(0, 0, 0, 0)
        return [bar(40, 95, 50, 70), shadow], [120, 4], [(40, 50), (0, 0)]

    all_ = followed(scene, 40)
    assert len(all_[22]) == 2
    assert len(all_[-1]) == 1
    assert all_[-1][0].key == all_[0][0].key
    assert alike(all_[-1][0].visible, scene(39)[0][0]) > 0.9


def test_a_hidden_body_is_the_same_when_it_is_seen_again() -> None:
    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        x = 20 + 1.5 * k
        return [disc(80, 60, 9), disc(x, 60, 24)], [140, 90], [(80, 60), (x, 60)]

    all_ = followed(scene, 80)
    small = body_at(all_[0], scene(0)[0][0]).key
    hidden = [
        k for k, bodies in enumerate(all_) if not any(b.key == small and seen(b, k) for b in bodies)
    ]
    assert hidden
    assert len(hidden) > 5
    again = body_at(all_[-1], scene(79)[0][0])
    assert again.key == small
    assert seen(again, 79)
    assert len(all_[-1]) == 2


def test_what_comes_in_by_parts_is_one_body() -> None:
    """A fork: its two prongs come into view first, then what joins them."""

    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        x = -10 + 2 * k
        fork = bar(x - 40, x, 40, 47) | bar(x - 40, x, 66, 73) | bar(x - 40, x - 28, 40, 73)
        return [fork, disc(130, 60, 9)], [120, 90], [(x, 40), (130, 60)]

    all_ = followed(scene, 50)
    assert max(len(bodies) for bodies in all_) == 3
    assert len(all_[-1]) == 2
    fork = scene(49)[0][0]
    assert alike(body_at(all_[-1], fork).visible, fork) > 0.85


def test_what_goes_is_forgotten_and_what_comes_is_new() -> None:
    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        x = 30 if k < 10 else 120
        return [disc(x, 60, 9)], [90], [(x, 60)]

    all_ = followed(scene, 30)
    assert len(all_[12]) == 2
    assert len(all_[-1]) == 1
    assert all_[-1][0].key != all_[0][0].key


@settings(deadline=None, max_examples=12)
@given(st.floats(0.05, 0.5), st.floats(0, 6.28))
def test_a_slow_drift_is_told_from_rest(speed: float, angle: float) -> None:
    """A body drifts by a fraction of a pixel a frame; its edge pixels are blended as a camera would."""

    def tone(k: int, moving: bool) -> np.ndarray:
        way = speed * k if moving else 0.0
        x, y = 80 + way * np.cos(angle), 60 + way * np.sin(angle)
        ys, xs = np.mgrid[:120, :160]
        inside = np.clip(16 - np.hypot(xs - x, ys - y) + 0.5, 0, 1)
        noise = np.random.default_rng(k).normal(0, 0.7, inside.shape)
        return np.asarray(np.clip(np.round(4 + 120 * inside + noise), 0, 255), np.uint8)

    for moving in (True, False):
        bodies: Bodies = ()
        told = False
        for k in range(50):
            picture = tone(k, moving)
            found = bright_components(picture, 40.0)
            assert found is not None
            bodies = track_bodies(bodies, SkyFrame(picture, found, k / FPS, (0.0, 0.0)), 1)
            told = told or bodies[0].has_drifted(200.0)
        assert told == moving


def test_a_drift_with_the_ground_is_no_drift() -> None:
    bodies: Bodies = ()
    for k in range(40):
        picture = painted([disc(40 + k, 60, 12)], [120], seed=k)
        found = bright_components(picture, 40.0)
        assert found is not None
        bodies = track_bodies(bodies, SkyFrame(picture, found, k / FPS, (float(k), 0.0)), 1)
        assert not bodies[0].has_drifted(200.0)


def test_what_wobbles_in_place_has_not_drifted() -> None:
    rng = np.random.default_rng(3)
    bodies: Bodies = ()
    for k in range(60):
        dx, dy = rng.normal(0, 0.4, 2)
        picture = painted([disc(80 + dx, 60 + dy, 14)], [120], seed=k)
        found = bright_components(picture, 40.0)
        assert found is not None
        bodies = track_bodies(bodies, SkyFrame(picture, found, k / FPS, (0.0, 0.0)), 1)
        assert not bodies[0].has_drifted(200.0)


def test_what_comes_in_moves_as_its_end_in_view_does() -> None:
    """Its centre moves at half that speed while more and more of it comes over the border."""

    def scene(k: int) -> tuple[Masks, Sequence[float], Sequence[tuple[float, float]]]:
        return [bar(0, 10 + 2 * k, 50, 66), disc(140, 20, 8)], [120, 90], [(2 * k, 50), (140, 20)]

    bodies = followed(scene, 25)[-1]
    came = body_at(bodies, scene(24)[0][0])
    assert came.cut
    assert abs(came.velocity[0] - 2 * FPS) < 0.2 * FPS
    assert abs(came.velocity[1]) < 0.2 * FPS
