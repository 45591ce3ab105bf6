"""Equal things are told apart by where they belong."""

from __future__ import annotations

import pytest

from tests.percepts.appearance.scenes import shown
from tests.percepts.appearance.test_behaviour import Places, watch
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.appearance.looks.thing_model import view_models
from visup.percepts.appearance.tracking.look_alikes import look_alikes

PLACES: Places = {"part": (30, 60), "twin": (170, 60), "tray": (90, 120)}


def test_equal_things_look_alike_and_others_do_not() -> None:
    alike = look_alikes(view_models(shown(PLACES, "part", "twin", "tray")))
    assert alike == {0: {1}, 1: {0}, 2: set()}


@pytest.mark.parametrize("away", [9, 10, 11, 12, 13, 14])
@pytest.mark.parametrize("back", ["part", "twin"])
def test_of_equal_things_the_one_that_belongs_there_comes_back(back: str, away: int) -> None:
    behaviour = AppearanceBehaviour(shown(PLACES, "part", "twin"))
    x, y = PLACES[back]
    inwards = 40 if back == "part" else -40
    there: Places = {"tray": (90, 120), back: (x + inwards, y - 20)}
    seen = watch(behaviour, [PLACES] * 4 + [{"tray": (90, 120)}] * away + [there] * 12)
    assert set(seen[3]) == {"part", "twin"}
    assert set(seen[3 + away]) == set()
    assert set(seen[-1]) == {back}
