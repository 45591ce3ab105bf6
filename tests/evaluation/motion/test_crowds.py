"""Frames of crowds: the same from the same seed, and as crowded as asked for."""

import numpy as np
import pytest

from visup.evaluation.motion import crowds


def test_frames_depend_only_on_the_seed() -> None:
    one, same, other = (list(crowds.crowd(5, 2, seed)) for seed in (3, 3, 4))
    assert all(np.array_equal(a.image, b.image) for a, b in zip(one, same, strict=True))
    assert not np.array_equal(one[1].image, other[1].image)
    assert one[0].size == crowds.SIZE[::-1]


@pytest.mark.parametrize("distance", [0.0, 30.0, 80.0, 81.0, 1e4])
def test_a_reflected_position_stays_within_its_extent(distance: float) -> None:
    extent = np.array([80.0, 50.0])
    position = crowds._reflected(np.array([distance, distance]), extent)
    assert ((position >= 0) & (position <= extent)).all()


def test_movers_are_reflected_without_jumps() -> None:
    extent = np.array([80.0, 50.0])
    positions = [crowds._reflected(np.array([3.0, 2.0]) * n, extent) for n in range(200)]
    assert np.abs(np.diff(positions, axis=0)).max() <= 3.0


def test_growth_is_relative_to_one_mover(monkeypatch: pytest.MonkeyPatch) -> None:
    cost = {number: 10.0 + number for number in crowds.MOVER_COUNTS}
    monkeypatch.setattr(crowds, "crowd", lambda movers, frames, seed: movers)
    monkeypatch.setattr(
        crowds, "_frame_costs", lambda frames: {"ms": cost[frames], "ratio": cost[frames]}
    )
    figures = crowds.evaluate_crowds(20)
    assert figures["items"]["1"]["growth"] == 1
    assert figures["total"]["growth"] == pytest.approx(50 / 11)
    assert figures["total"]["growth"] > figures["total"]["bar"]
