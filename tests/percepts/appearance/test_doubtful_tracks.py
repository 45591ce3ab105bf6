"""An object that is followed though it looks otherwise is sought elsewhere, and found where it clearly is."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.percepts.appearance.scenes import picture, shown
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene, prepare_scene
from visup.percepts.appearance.tracking.redetection import taught_pose
from visup.percepts.appearance.tracking.track import DOUBT_S, TaughtObjectTrack, TrackState
from visup.percepts.appearance.tracking.tracker import SEARCH_INTERVAL, TaughtObjectTracker

FPS = 15.0
TAUGHT_AT, ELSEWHERE, WRONG = (40, 40), (190, 100), (90, 120)
VIEWS = view_models(shown({"tool": TAUGHT_AT}, "tool"))


def scene(number: int, place: tuple[int, int] | None) -> Scene:
    places = {"tool": place} if place else {}
    return prepare_scene(picture(places, seed=number)[0], number / FPS)


def pose_at(place: tuple[int, int]) -> PatchPose:
    """The pose of the tool at a place."""
    home = taught_pose(scene(0, None), VIEWS[0])
    return replace(home, x=home.x + place[0] - TAUGHT_AT[0], y=home.y + place[1] - TAUGHT_AT[1])


def followed_wrongly(since_s: float, place: tuple[int, int] | None) -> TaughtObjectTrack:
    """The tool after a few frames in which it is at `place`, followed elsewhere until then."""
    tracker = TaughtObjectTracker(VIEWS)
    tracker.step(scene(0, ELSEWHERE), lambda _: 1)
    first = tracker.tracks[0]
    assert first.pose is not None
    assert first.pose.apart(pose_at(ELSEWHERE), 0) < 2.0
    now = 10.0 / FPS
    wrong = replace(
        first,
        state=TrackState.MOVING,
        pose=pose_at(WRONG),
        peak=0.2,
        explained_share=0.1,
        rest=None,
        path=(),
        last_seen=now,
        last_matched=now - since_s,
    )
    tracker.tracks = (wrong,)
    for number in range(11, 11 + SEARCH_INTERVAL):
        tracker.step(scene(number, place), lambda _: 2)
    return tracker.tracks[0]


@pytest.mark.parametrize(("since_s", "found"), [(DOUBT_S, True), (0.0, False)])
def test_it_is_found_where_it_is_once_it_has_looked_otherwise_for_long(
    since_s: float, found: bool
) -> None:
    after = followed_wrongly(since_s, ELSEWHERE)
    assert after.pose is not None
    assert after.id == 1  # it is still the same object
    assert (after.pose.apart(pose_at(ELSEWHERE), 0) < 2.0) is found


def test_it_is_followed_as_before_where_it_is_nowhere() -> None:
    after = followed_wrongly(1.0, None)
    assert after.state is TrackState.MOVING
    assert after.pose is not None
    assert after.pose.apart(pose_at(WRONG), 0) < 10.0
