"""Equal things are told apart by where they belong."""

from __future__ import annotations

from functools import cache

import pytest

from tests.percepts.appearance.scenes import shown
from tests.percepts.appearance.test_behaviour import Places, look, watch
from visup.agent.storage.checkpoint import dump_state, load_state
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.tracking.look_alikes import look_alikes

AWAY = (9, 10, 11, 12, 13, 14)
PLACES: Places = {"part": (30, 60), "twin": (170, 60), "tray": (90, 120)}


def test_equal_things_look_alike_and_others_do_not() -> None:
    alike = look_alikes(view_models(shown(PLACES, "part", "twin", "tray")))
    assert alike == {0: {1}, 1: {0}, 2: set()}


@cache
def both_taken_away() -> tuple[bytes, ...]:
    """The states of a behaviour that saw both for four frames, after each frame without them."""
    behaviour = AppearanceBehaviour(shown(PLACES, "part", "twin"))
    assert set(watch(behaviour, [PLACES] * 4)[-1]) == {"part", "twin"}
    states = []
    for n in range(max(AWAY)):
        seen = look(behaviour, 4 + n, {"tray": (90, 120)})
        assert n + 1 < min(AWAY) or not seen
        states.append(dump_state(behaviour.save()))
    return tuple(states)


def without_both(frames: int) -> AppearanceBehaviour:
    """A behaviour that saw both, and has not for some frames: it was watched once for all tests."""
    behaviour = AppearanceBehaviour(shown(PLACES, "part", "twin"))
    behaviour.load(load_state(both_taken_away()[frames - 1]))
    return behaviour


@pytest.mark.parametrize("away", AWAY)
@pytest.mark.parametrize("back", ["part", "twin"])
def test_of_equal_things_the_one_that_belongs_there_comes_back(back: str, away: int) -> None:
    behaviour = without_both(away)
    x, y = PLACES[back]
    inwards = 40 if back == "part" else -40
    there: Places = {"tray": (90, 120), back: (x + inwards, y - 20)}
    last = [look(behaviour, 4 + away + n, there) for n in range(12)][-1]
    assert set(last) == {back}
