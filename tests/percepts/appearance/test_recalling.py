"""What passes for a taught thing is given up for a place that clearly shows it."""

from __future__ import annotations

import pytest

from tests.percepts.appearance.scenes import picture, shown
from visup.percepts.appearance.looks.pose import PatchPose
from visup.percepts.appearance.looks.scene import Scene, prepare_scene
from visup.percepts.appearance.looks.thing_model import view_models
from visup.percepts.appearance.tracking.finding import home_of
from visup.percepts.appearance.tracking.recalling import recalled
from visup.percepts.appearance.tracking.track import State, ThingTrack

TAUGHT_AT, ELSEWHERE = (40, 40), (190, 120)
VIEWS = view_models(shown({"tool": TAUGHT_AT}, "tool"))


def scene(place: tuple[int, int] | None = None) -> Scene:
    """The table with a tool at some place, or nowhere."""
    return prepare_scene(picture({"tool": place} if place else {})[0], 1.0)


def track(proven: bool) -> ThingTrack:
    """A track of the tool that follows something else, where it was taught."""
    (view,) = VIEWS
    pose = home_of(scene(), view)
    return ThingTrack(
        "tool", 0, 1, State.MOVING, pose, view.appearance, seen=0.0, since=0.0, proven=proven
    )


def at(found: ThingTrack) -> PatchPose:
    assert found.pose is not None
    return found.pose


@pytest.mark.parametrize("proven", [False, True])
def test_a_track_that_was_never_proven_goes_to_where_the_thing_is_however_far(proven: bool) -> None:
    before = track(proven)
    after = recalled(before, VIEWS, scene(ELSEWHERE), [])
    moved = at(after).x - at(before).x, at(after).y - at(before).y
    way = ELSEWHERE[0] - TAUGHT_AT[0], ELSEWHERE[1] - TAUGHT_AT[1]
    assert moved == ((0.0, 0.0) if proven else pytest.approx(way, abs=2.0))


def test_a_track_that_was_never_proven_stays_where_the_thing_is_nowhere() -> None:
    before = track(False)
    assert at(recalled(before, VIEWS, scene(), [])) == at(before)
