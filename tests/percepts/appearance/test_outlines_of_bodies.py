"""An object of which only a part is followed gets the outline of the moving body that it is, and no other."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.percepts.appearance.scenes import picture, shown
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.moving_body import MovingBody
from visup.percepts.appearance.models.scene import prepare_scene
from visup.percepts.appearance.tracking.adaptation import with_outlines_of_bodies
from visup.percepts.appearance.tracking.redetection import taught_pose
from visup.percepts.appearance.tracking.track import TaughtObjectTrack, TrackState

PLACES = {"tray": (100, 50), "tool": (40, 40), "part": (40, 120), "twin": (70, 120)}
IMAGE, MASKS = picture(PLACES)
SCENE = prepare_scene(IMAGE, 1.0)
VIEWS = view_models(shown(PLACES, "tool", "tray", "part"))
TOOL = MASKS["tool"]
COLUMNS = np.arange(TOOL.shape[1])
LEFT = TOOL & (COLUMNS < 58)

Mask = NDArray[np.bool_]


def blob(mask: Mask) -> Blob:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    left, top, right, bottom = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
    return Blob((left, top, right, bottom), mask[top:bottom, left:right].copy())


def track(name: str, mask: Mask, state: TrackState = TrackState.MOVING) -> TaughtObjectTrack:
    number = [v.name for v in VIEWS].index(name)
    view = VIEWS[number]
    pose = taught_pose(SCENE, view)
    return TaughtObjectTrack(
        name, number, 1 + number, state, pose, view.appearance, blob(mask), last_seen=1.0
    )


def corrected(
    body: Mask, *others: TaughtObjectTrack, followed: TaughtObjectTrack | None = None
) -> TaughtObjectTrack:
    """The tool, of which the left part is followed, or another track, with a moving body in the picture."""
    tracks = (followed or track("tool", LEFT), *others)
    bodies = [MovingBody(7, blob(body), cut=False)]
    return with_outlines_of_bodies(tracks, bodies, VIEWS, SCENE)[0]


def pixels(found: TaughtObjectTrack) -> Mask:
    assert found.visible is not None
    out = np.zeros_like(TOOL)
    left, top, right, bottom = found.visible.window
    out[top:bottom, left:right] = found.visible.mask
    return out


def test_the_whole_body_is_the_object_and_is_followed_as_such() -> None:
    found = corrected(TOOL)
    assert np.array_equal(pixels(found), TOOL)
    assert found.id == track("tool", LEFT).id
    assert found.pose is not None
    centre = np.argwhere(TOOL).mean(axis=0)[::-1]
    assert (found.pose.x, found.pose.y) == pytest.approx(tuple(centre), abs=1.0)
    assert found.appearance is not None
    covered = found.appearance.area * found.pose.scale**2
    assert covered == pytest.approx(TOOL.sum(), rel=0.15)


def wider(mask: Mask, pixels: int) -> Mask:
    """The mask and as many pixels to its right, which show the table."""
    out = mask.copy()
    for k in range(1, pixels + 1):
        out[:, k:] |= mask[:, :-k]
    return out


@pytest.mark.parametrize(
    "body",
    [
        pytest.param(LEFT, id="no larger than what is followed"),
        pytest.param(TOOL & (COLUMNS < 60), id="hardly larger"),
        pytest.param(TOOL & ~LEFT, id="elsewhere"),
        pytest.param(wider(TOOL, 11), id="largely of other colours"),
        pytest.param(wider(TOOL, 60), id="too large"),
    ],
)
def test_another_body_is_not_it(body: Mask) -> None:
    assert np.array_equal(pixels(corrected(body)), LEFT)


def test_a_body_of_several_objects_is_none_of_them() -> None:
    inner = TOOL & (COLUMNS > 58)
    assert np.array_equal(pixels(corrected(TOOL, track("tray", inner))), LEFT)
    assert np.array_equal(pixels(corrected(TOOL, track("tray", MASKS["tray"]))), TOOL)


def test_a_body_beside_what_is_followed_is_not_it() -> None:
    rim = TOOL & (COLUMNS < 50)
    found = corrected(TOOL & (COLUMNS >= 48), followed=track("tool", rim))
    assert np.array_equal(pixels(found), rim)


def test_two_equal_objects_that_move_together_are_not_one() -> None:
    found = corrected(MASKS["part"] | MASKS["twin"], followed=track("part", MASKS["part"]))
    assert np.array_equal(pixels(found), MASKS["part"])


def test_what_rests_keeps_its_outline() -> None:
    resting = track("tool", LEFT, TrackState.RESTING)
    assert np.array_equal(pixels(corrected(TOOL, followed=resting)), LEFT)
