"""Which stage fails when one goes past its goal, turns back before it, or puts a part down elsewhere."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from tests.tasks.supervision.drawn import Mask, drawn, first, watched
from visup.agent import Event

VEHICLE, CHARGER = 1, 2
GRIPPER, PART, FIXTURE = 1, 2, 3

CHARGE = """
<charge>   ::= <approach> <docked>
<approach> ::= converging(vehicle, charger)
<docked>   ::= touching(vehicle, charger) for 1 s
"""

PUT = """
<put>   ::= <reach> <grasp> <carry> <place>
<reach> ::= converging(gripper, part)
<grasp> ::= coupled(gripper, part)
<carry> ::= moving_together(gripper, part) & converging(part, fixture)
<place> ::= touching(part, fixture) & coupled(gripper, part)
"""


def eased(now: float, *keys: tuple[float, float]) -> float:
    """A value between (seconds, value) keys; constant outside."""
    for (a, x), (b, y) in pairwise(keys):
        if now < b:
            return x + (y - x) * max(0.0, now - a) / (b - a)
    return keys[-1][1]


def charged(folder: Path, text: str, *, turns_back: bool) -> list[Event]:
    """The events of a task of charging."""
    roles = {"vehicle": VEHICLE, "charger": CHARGER}
    return watched(folder, text, lambda now: driving(now, turns_back=turns_back), roles, 7.0)


def driving(now: float, *, turns_back: bool) -> Mask:
    """A vehicle that drives past a charger below it, or back again before it."""
    turning_point = 170.0 if turns_back else 400.0
    x = eased(
        now,
        (0.5, 20.0),
        (3.5, turning_point),
        (3.6, turning_point),
        (6.0, 40.0 if turns_back else turning_point),
    )
    return drawn({CHARGER: (240, 140, 50, 70), VEHICLE: (x, 80, 60, 45)})


@pytest.mark.parametrize(
    ("turns_back", "fails", "not_fails"),
    [(False, "docked", "approach"), (True, "approach", "docked")],
)
def test_driving_past_fails_docking_and_turning_back_fails_the_approach(
    tmp_path: Path, turns_back: bool, fails: str, not_fails: str
) -> None:
    events = charged(tmp_path, CHARGE, turns_back=turns_back)
    assert first(events, "stage_failing", fails) is not None
    assert first(events, "stage_failing", not_fails) is None


def alongside(now: float) -> Mask:
    """A vehicle that passes along a long charger without reaching it, and bears off slowly."""
    x = eased(now, (0.5, 10.0), (9.0, 440.0))
    y = eased(now, (0.5, 40.0), (4.0, 80.0), (7.5, 50.0))
    return drawn({CHARGER: (120, 150, 240, 40), VEHICLE: (x, y, 50, 40)})


def test_passing_along_the_goal_begins_docking_and_fails_it(
    tmp_path: Path,
) -> None:
    roles = {"vehicle": VEHICLE, "charger": CHARGER}
    events = watched(tmp_path, CHARGE, alongside, roles, 9.0)
    begun = first(events, "stage_started", "docked")
    assert begun == pytest.approx(4.5, abs=0.7)  # it is nearest at 4 s
    assert first(events, "stage_done", "approach") == begun
    fails = first(events, "stage_failing", "docked")
    assert fails is not None
    assert begun is not None
    assert fails >= begun
    assert first(events, "stage_failing", "approach") is None


def test_driving_past_too_soon_fails_an_approach_with_a_duration(tmp_path: Path) -> None:
    text = CHARGE.replace("converging(vehicle, charger)", "converging(vehicle, charger) for 4 s")
    events = charged(tmp_path, text, turns_back=False)
    assert first(events, "stage_started", "docked") is None
    assert first(events, "stage_failing", "approach") is not None


def carrying(now: float, *, drops: bool) -> Mask:
    """A gripper that takes a part along, and stops with it before the fixture, or drops it on the way."""
    x = eased(now, (0.5, 60.0), (2.0, 120.0), (3.0, 120.0), (5.5, 240.0))
    y = eased(now, (2.9, 100.0), (3.0, 100.0), (7.0, 100.0), (8.0, 20.0))
    part = 120.0 if now < 3.0 else min(x, 190.0) if drops else x
    fall = eased(now, (4.5, 0.0), (4.8, 60.0)) if drops else 0.0
    return drawn(
        {
            FIXTURE: (400, 130, 60, 60),
            PART: (part + 5, 140 + fall, 30, 30),
            GRIPPER: (x, y, 40, 45),
        }
    )


@pytest.mark.parametrize(
    ("drops", "fails", "not_fails"), [(False, "place", "carry"), (True, "carry", "place")]
)
def test_putting_down_elsewhere_fails_placing_and_dropping_fails_carrying(
    tmp_path: Path, drops: bool, fails: str, not_fails: str
) -> None:
    events = watched(
        tmp_path,
        PUT,
        lambda now: carrying(now, drops=drops),
        {"gripper": GRIPPER, "part": PART, "fixture": FIXTURE},
        10.0,
    )
    assert first(events, "stage_failing", fails) is not None
    assert first(events, "stage_failing", not_fails) is None


SORT = """
<sort>   ::= <ride> <binned>
<ride>   ::= converging(parcel, bin)
<binned> ::= touching(parcel, bin) for 1 s
"""


def riding(now: float, *, stops: bool) -> Mask:
    """A parcel that falls into a bin, in which it is hidden; or rests beside it, and is taken away."""
    x, y = (200.0 if stops else 290.0), eased(now, (0.5, 10.0), (3.0, 150.0))
    parcel = {1: (x, y, 40.0, 30.0)} if now < 5.0 else {}
    return drawn({**parcel, 2: (250, 125, 120, 80)})


@pytest.mark.parametrize(("stops", "binned"), [(False, True), (True, False)])
def test_an_object_that_vanishes_into_its_goal_has_reached_it(
    tmp_path: Path, stops: bool, binned: bool
) -> None:
    roles = {"parcel": 1, "bin": 2}
    events = watched(tmp_path, SORT, lambda now: riding(now, stops=stops), roles, 8.0)
    assert (first(events, "stage_started", "binned") is not None) is binned
    assert any(e.kind == "verdict" and "succeeded" in e.text for e in events) is binned
