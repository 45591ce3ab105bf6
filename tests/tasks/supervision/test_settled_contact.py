"""A stage of contact waits until one has slowed down at the other."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from tests.tasks.supervision.drawn import Mask, drawn, first, watched

BOAT, PIER = 1, 2
MEETS_S, STOPS_S, UNTIL_S = 3.0, 5.0, 8.0
SPEED = 60.0  # pixels a second

BERTH = """
<berth>     ::= <approach> <alongside>
<approach>  ::= converging(boat, pier)
<alongside> ::= touching(boat, pier) for 1 s
"""


def berthing(now: float, stops_s: float) -> Mask:
    """A boat that comes from the left, passes before a pier from `MEETS_S` on, and stops there.

    Seen from above: its outline meets the pier's while it is still under way."""
    right = 260 + SPEED * (min(now, stops_s) - MEETS_S)
    return drawn({PIER: (260, 80, 180, 60), BOAT: (right - 70, 120, 70, 50)})


@pytest.mark.parametrize("stops_s", [STOPS_S, 4.0])
def test_a_contact_stage_begins_when_the_boat_stops(tmp_path: Path, stops_s: float) -> None:
    mask = partial(berthing, stops_s=stops_s)
    events = watched(tmp_path, BERTH, mask, {"boat": BOAT, "pier": PIER}, UNTIL_S)
    approach, alongside = (first(events, "stage_started", s) for s in ("approach", "alongside"))
    assert approach is not None
    assert approach < MEETS_S
    assert alongside is not None
    assert stops_s - 0.2 <= alongside <= stops_s + 0.7
