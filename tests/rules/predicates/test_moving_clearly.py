"""What clearly moves, and what only seems to, where it is covered in part."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import Mind, Region
from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.predicates.motion import CLEAR_MOTION_SIGMA, moving, moving_clearly
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.relations.kinematics import RelationSettings

FRAMES = 40
SIZE = (480, 360)
MOTIONS = st.tuples(st.one_of(st.just(np.nan), st.floats(0.0, 300.0)), st.floats(0.0, 30.0))


def pushed_box(speed: float) -> Mind:
    """A box that is pushed by so many pixels a frame from the twentieth frame on."""

    def box(frame: int) -> tuple[float, float, float, float]:
        return (300 + speed * max(0, frame - FRAMES // 2), 200, 200, 80)

    return list(reason(seen(i, [box_region(1, box(i))]) for i in range(FRAMES)))[-1].mind


def occluded_box(pace: float) -> list[Mind]:
    """A box at rest before which another one passes, up to its middle."""

    def boxes(frame: int) -> list[Region | None]:
        edge = min(400.0, 200 + pace * max(0, frame - 15))
        left = max(300.0, edge)
        return [
            box_region(1, (left, 200, 500 - left, 80)),
            box_region(2, (edge - 90, 150, 90, 200)),
        ]

    return [r.mind for r in reason(seen(i, boxes(i)) for i in range(60))]


@pytest.mark.parametrize("speed", [3.0, -5.0])
def test_a_pushed_body_clearly_moves(speed: float) -> None:
    assert moving_clearly(Snapshot(pushed_box(speed))).tolist() == [YES]


@pytest.mark.parametrize("pace", [4.0, 9.0])
def test_an_occluded_resting_body_does_not_clearly_move_for_long(pace: float) -> None:
    facts = [f for f in map(Snapshot, occluded_box(pace)) if 1 in f.row]
    assert len(facts) > 40
    clearly = [moving_clearly(f)[f.row[1]] == YES and f.one("speed")[f.row[1]] > 25 for f in facts]
    assert not any(all(clearly[k : k + 5]) for k in range(len(clearly) - 5))


@given(st.lists(MOTIONS, min_size=1, max_size=5))
def test_clear_motion_is_motion_of_well_known_velocity(
    motions: list[tuple[float, float]],
) -> None:
    speed, sigma = np.array(motions).T
    columns = {"speed": speed, "velocity_sigma": sigma}
    facts: Any = SimpleNamespace(
        mind=SimpleNamespace(frame_size=SIZE),
        one=columns.__getitem__,
        relation_settings=RelationSettings(),
    )
    wide = sigma > CLEAR_MOTION_SIGMA * np.hypot(*SIZE)
    expected = np.where((moving(facts) == YES) & wide, NO, moving(facts))
    assert moving_clearly(facts).tolist() == expected.tolist()
    assert np.all((moving_clearly(facts) == MAYBE) == np.isnan(speed))
