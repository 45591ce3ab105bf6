"""Bodies drawn as masks, over which another one sweeps: their speeds are their own throughout.

What covers them is no region, as a hand that nobody named; the image motion is what a camera measures on
the part of a body that it sees.
"""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import seen
from visup.agent import Mind, Region
from visup.agent.model.fast_replace import replace
from visup.rules.formula.truth import YES
from visup.rules.predicates.motion import moving_clearly
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.reasoner import kinematics
from visup.testing import region_of

SIZE = (480, 360)
FPS = 25.0
FRAMES = 100
SIGMA = 1.5
paces = st.floats(20.0, 150.0)
angles = st.floats(0.0, 6.28)
some = settings(max_examples=12, deadline=None)


def body(at: tuple[float, float], turn: float) -> np.ndarray:
    """A box of 120 x 70 pixels, turned."""
    picture = np.zeros(SIZE[::-1], np.uint8)
    corners = cv2.boxPoints(((float(at[0]), float(at[1])), (120.0, 70.0), float(np.degrees(turn))))
    cv2.fillPoly(picture, [np.rint(corners * 16).astype(np.int32)], (1,), shift=4)
    return picture > 0


def swept(
    velocity: tuple[float, float], pace: float, way: float, turn: float, image: bool
) -> Iterator[Region | None]:
    """A body that moves, and an edge that covers it from one side and draws back when it is half covered."""
    ys, xs = np.mgrid[: SIZE[1], : SIZE[0]]
    toward = np.array([np.cos(way), np.sin(way)])
    along = xs * toward[0] + ys * toward[1]
    for frame in range(FRAMES):
        time = frame / FPS
        at = np.array([240.0, 180.0]) + np.array(velocity) * (time - 2.0)
        reach = 100.0 - abs(pace * (time - 1.5) - 100.0)
        hidden = along < reach - 100.0 + at @ toward
        mask = body((at[0], at[1]), turn) & ~hidden
        region = region_of(mask, 1, velocity)
        yield replace(region, velocity_sigma=SIGMA if image else 0.0)


def minds(regions: Iterator[Region | None]) -> list[Mind]:
    return [t.mind for t in reason(seen(i, [r], FPS) for i, r in enumerate(regions))]


def known(mind: Mind) -> Kinematics:
    found: Kinematics = kinematics(mind)
    return found


@some
@given(paces, angles, angles)
def test_a_body_at_rest_rests_while_another_one_sweeps_over_it(
    pace: float, way: float, turn: float
) -> None:
    for mind in minds(swept((0.0, 0.0), pace, way, turn, image=True))[40:]:
        assert known(mind).speed[0] < 6.0


@some
@given(paces, angles, angles)
def test_without_image_motion_it_does_not_clearly_move_for_long(
    pace: float, way: float, turn: float
) -> None:
    facts = [Snapshot(m) for m in minds(swept((0.0, 0.0), pace, way, turn, image=False))[40:]]
    fast = [moving_clearly(f)[0] == YES and f.one("speed")[0] > 25.0 for f in facts]
    assert not any(all(fast[k : k + 6]) for k in range(len(fast) - 6))


@some
@given(st.floats(15.0, 60.0), angles, paces, angles, angles)
def test_a_body_that_moves_keeps_its_speed_while_it_is_covered(
    speed: float, heading: float, pace: float, way: float, turn: float
) -> None:
    velocity = speed * np.cos(heading), speed * np.sin(heading)
    for mind in minds(swept(velocity, pace, way, turn, image=True))[40:]:
        assert known(mind).velocity[0] == pytest.approx(velocity, abs=6.0 + 0.2 * speed)
