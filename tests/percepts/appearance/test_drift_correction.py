"""What passes for a taught thing is given up for a place that clearly shows it."""

from __future__ import annotations

import pytest

from tests.percepts.appearance.scenes import picture, shown
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene, prepare_scene
from visup.percepts.appearance.tracking.drift_correction import correct_drift
from visup.percepts.appearance.tracking.redetection import taught_pose
from visup.percepts.appearance.tracking.track import TaughtObjectTrack, TrackState

TAUGHT_AT, ELSEWHERE = (40, 40), (190, 120)
VIEWS = view_models(shown({"tool": TAUGHT_AT}, "tool"))


def scene(place: tuple[int, int] | None = None) -> Scene:
    """The table with a tool at some place, or nowhere."""
    return prepare_scene(picture({"tool": place} if place else {})[0], 1.0)


def track(proven: bool) -> TaughtObjectTrack:
    """A track of the tool that follows something else, where it was taught."""
    (view,) = VIEWS
    pose = taught_pose(scene(), view)
    return TaughtObjectTrack(
        "tool",
        0,
        1,
        TrackState.MOVING,
        pose,
        view.appearance,
        last_seen=0.0,
        first_seen=0.0,
        confirmed=proven,
    )


def at(found: TaughtObjectTrack) -> PatchPose:
    assert found.pose is not None
    return found.pose


@pytest.mark.parametrize("proven", [False, True])
def test_a_track_that_was_never_proven_goes_to_where_the_thing_is_however_far(proven: bool) -> None:
    before = track(proven)
    after = correct_drift(before, VIEWS, scene(ELSEWHERE), [])
    moved = at(after).x - at(before).x, at(after).y - at(before).y
    way = ELSEWHERE[0] - TAUGHT_AT[0], ELSEWHERE[1] - TAUGHT_AT[1]
    assert moved == ((0.0, 0.0) if proven else pytest.approx(way, abs=2.0))


def test_a_track_that_was_never_proven_stays_where_the_thing_is_nowhere() -> None:
    before = track(False)
    assert at(correct_drift(before, VIEWS, scene(), [])) == at(before)
