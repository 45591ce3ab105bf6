"""Objects that look the same are each found, tracked by themselves, and named alike."""

from __future__ import annotations

import numpy as np
import pytest

from tests.percepts.appearance.scenes import HEIGHT, WIDTH, picture, shown
from tests.percepts.appearance.test_behaviour import FPS, Places
from visup.agent import Frame, Hypothesis, Observation, Region
from visup.agent.storage.checkpoint import dump_state, load_state
from visup.percepts.appearance.behaviour import AppearanceBehaviour

TAUGHT: Places = {"part": (100, 20), "tray": (20, 20)}
TWO: Places = {"tray": (90, 120), "part": (40, 60), "twin": (170, 50)}


def look(behaviour: AppearanceBehaviour, number: int, places: Places) -> dict[int, Region]:
    """The regions that are named 'part' in one frame, by id."""
    frame = Frame(number, number / FPS, picture(places, seed=number)[0])
    percepts = behaviour.perceive(frame, Observation(number, frame.time, frame.size, ()), ())
    values = [p.value for p in percepts]
    parts = {v.region_id for v in values if isinstance(v, Hypothesis) and v.name == "part"}
    return {v.id: v for v in values if isinstance(v, Region) and v.id in parts}


def taught_part() -> AppearanceBehaviour:
    return AppearanceBehaviour(shown(TAUGHT, "part", "tray"))


def object_at(regions: dict[int, Region], places: Places, name: str) -> int | None:
    """The id of the region that covers an object, if any does."""
    true = picture(places)[1][name]
    for number, region in regions.items():
        mask = region.full_mask((WIDTH, HEIGHT))
        if np.count_nonzero(mask & true) > 0.7 * np.count_nonzero(mask | true):
            return number
    return None


@pytest.mark.parametrize("names", [("part",), ("part", "twin")])
def test_as_many_are_found_as_there_are(names: tuple[str, ...]) -> None:
    places = {n: p for n, p in TWO.items() if n in (*names, "tray")}
    behaviour = taught_part()
    seen = [look(behaviour, n, places) for n in range(4)][-1]
    assert len(seen) == len(names)
    assert len({object_at(seen, places, n) for n in names} - {None}) == len(names)


@pytest.mark.parametrize("moved", ["part", "twin"])
def test_one_is_carried_away_while_the_other_keeps_its_number(moved: str) -> None:
    behaviour = taught_part()
    seen = [look(behaviour, n, TWO) for n in range(4)][-1]
    before = {n: object_at(seen, TWO, n) for n in ("part", "twin")}
    for k in range(12):
        x, y = TWO[moved]
        places = {**TWO, moved: (x, y + 2 * k)}
        seen = look(behaviour, 4 + k, places)
    assert {n: object_at(seen, places, n) for n in ("part", "twin")} == before


def test_a_behaviour_that_goes_on_knows_both() -> None:
    behaviour, other = taught_part(), taught_part()
    for n in range(4):
        seen = look(behaviour, n, TWO)
    other.load(load_state(dump_state(behaviour.save())))
    assert set(look(other, 4, TWO)) == set(seen)


def test_of_two_that_were_both_taught_each_is_found_once() -> None:
    behaviour = AppearanceBehaviour(shown(TWO, "part", "twin"))
    assert [len(look(behaviour, n, TWO)) for n in range(4)][-1] == 1
