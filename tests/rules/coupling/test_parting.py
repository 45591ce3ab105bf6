"""Bodies in contact that begin to part are told by their motion before a gap shows."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import Thought, reason
from tests.rules.scenes import box_region, reach_of, seen
from visup.agent import ObjectBelief, Presence, Region, Truth
from visup.rules.geometry.regions import DIRECTIONS
from visup.rules.relations._kinematics_jit import separation_speeds
from visup.rules.relations.kinematics import sightings

Velocity = tuple[float, float]
speeds = st.floats(-30, 30)


def body(id_: int, left: float, velocity: Velocity, sigma: float = 0.5) -> Region:
    region = box_region(id_, (left, 200, 80, 60))
    assert region is not None
    return replace(region, velocity=velocity, velocity_sigma=sigma)


def pair(a: Region, b: Region) -> tuple[np.ndarray, np.ndarray]:
    objects = tuple(ObjectBelief(r.id, r, Presence.SEEN, 0.0, 1.0) for r in (a, b))
    support = np.array([reach_of(r)[0] for r in (a, b)])
    return separation_speeds(support, sightings(objects, 1.0), DIRECTIONS)


@settings(max_examples=40, deadline=None)
@given(speeds, speeds, speeds, speeds, st.integers(140, 300))
def test_only_the_motion_along_the_line_between_counts(
    ax: float, ay: float, bx: float, by: float, left: int
) -> None:
    """Side by side, overlapping by up to half or apart; the same from both sides."""
    speed, spread = pair(body(1, 100, (ax, ay)), body(2, left, (bx, by)))
    assert speed[0, 1] == pytest.approx(bx - ax, abs=1e-6)
    assert speed[1, 0] == pytest.approx(speed[0, 1], abs=1e-6)
    assert spread[0, 1] == pytest.approx(0.5 * 2**0.5)


def test_an_unknown_velocity_says_nothing() -> None:
    speed, _ = pair(body(1, 100, (0, 0), sigma=0.0), body(2, 180, (9, 0)))
    assert np.isnan(speed[0, 1])


def scene(told: float, moves: float, gap: float, sigma: float = 0.5) -> list[Thought]:
    """The right body says from 4 s on that it moves at `told`, and moves at `moves`, px/s.

    Before that the two close in at 10 px/s; their outlines jitter by up to 2 px a frame."""
    rng = np.random.default_rng(3)
    observations = []
    for i in range(160):
        t = i / 25
        left = 180 + gap + (10 * (4 - t) if t < 4 else moves * (t - 4)) + rng.uniform(-2, 2)
        velocity = (-10.0 if t < 4 else told, 0.0)
        observations.append(seen(i, [body(1, 100, (0, 0)), body(2, left, velocity, sigma)]))
    return reason(observations)


def first_diverging(thoughts: list[Thought]) -> float:
    found = ((t.mind.time, t.mind.relation("diverging", 1, 2)) for t in thoughts)
    return next((t for t, r in found if r is not None and r.truth is Truth.TRUE), np.inf)


def test_parting_after_contact_is_told_in_half_a_second_and_later_without_velocities() -> None:
    assert 4.3 <= first_diverging(scene(told=8.0, moves=8.0, gap=-20)) < 4.5
    assert first_diverging(scene(told=8.0, moves=8.0, gap=-20, sigma=0.0)) > 4.6


@pytest.mark.parametrize(
    ("told", "gap", "sigma"),
    [(0.0, -20, 0.5), (2.5, -20, 0.5), (8.0, -20, 2.5), (8.0, 60, 0.5)],
    ids=["at rest", "too slow", "too uncertain", "not in contact"],
)
def test_bodies_at_rest_do_not_diverge(told: float, gap: float, sigma: float) -> None:
    assert first_diverging(scene(told, moves=0.0, gap=gap, sigma=sigma)) == np.inf
