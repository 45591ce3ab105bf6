"""Who goes round another to stay near it does not come nearer; others may, meanwhile."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tasks.supervision.drawn import Mask, drawn, first, watched

BASE, BLOCK, CAP = 1, 2, 3
COMES_S, TURNS_S = 3.0, 4.8

LID = """
<lid>   ::= <rests> <bring>
<rests> ::= touching(block, base) for 1 s
<bring> ::= converging(cap, base)
"""


def brought(now: float, slant: bool) -> Mask:
    """A block rests on a base, and a cap comes: first mostly across, as an arm swings it in, or straight."""
    swung, straight = max(0.0, min(now, TURNS_S) - COMES_S), max(0.0, now - TURNS_S)
    across = 50 * swung if slant else 0.0
    near = (20 if slant else 54) * swung + 54 * straight
    cap = (430 - near, 190 - across, 40, 30)
    return drawn({BASE: (160, 130, 120, 60), BLOCK: (190, 90, 50, 40), CAP: cap})


@pytest.mark.parametrize("slant", [False, True])
def test_objects_at_rest_do_not_delay_the_approach_of_another(tmp_path: Path, slant: bool) -> None:
    roles = {"base": BASE, "block": BLOCK, "cap": CAP}
    events = watched(tmp_path, LID, lambda now: brought(now, slant), roles, 7.0)
    begun = first(events, "stage_started", "bring")
    assert begun is not None
    assert COMES_S < begun < COMES_S + 1.2
