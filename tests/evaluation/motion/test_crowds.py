"""Frames of crowds: the same from the same seed, and as crowded as asked for."""

import numpy as np
import pytest

from visup.evaluation.motion import crowds


def test_frames_follow_from_the_seed() -> None:
    one, same, other = (list(crowds.crowd(5, 2, seed)) for seed in (3, 3, 4))
    assert all(np.array_equal(a.image, b.image) for a, b in zip(one, same, strict=True))
    assert not np.array_equal(one[1].image, other[1].image)
    assert one[0].size == crowds.SIZE[::-1]


@pytest.mark.parametrize("way", [0.0, 30.0, 80.0, 81.0, 1e4])
def test_a_place_stays_in_its_room(way: float) -> None:
    room = np.array([80.0, 50.0])
    at = crowds._there_and_back(np.array([way, way]), room)
    assert ((at >= 0) & (at <= room)).all()


def test_movers_turn_at_the_border_and_never_jump() -> None:
    room = np.array([80.0, 50.0])
    places = [crowds._there_and_back(np.array([3.0, 2.0]) * n, room) for n in range(200)]
    assert np.abs(np.diff(places, axis=0)).max() <= 3.0


def test_growth_is_beside_one_mover(monkeypatch: pytest.MonkeyPatch) -> None:
    cost = {number: 10.0 + number for number in crowds.MOVERS}
    monkeypatch.setattr(crowds, "crowd", lambda movers, frames, seed: movers)
    monkeypatch.setattr(crowds, "_timed", lambda shown: {"ms": cost[shown], "ratio": cost[shown]})
    figures = crowds.evaluate_crowds(20)
    assert figures["items"]["1"]["growth"] == 1
    assert figures["total"]["growth"] == pytest.approx(50 / 11)
    assert figures["total"]["growth"] > figures["total"]["bar"]
