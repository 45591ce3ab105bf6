"""Laws of finding what rests by its colours alone, where no taught view matches."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.appearance.scenes import (
    HEIGHT,
    SIZES,
    WIDTH,
    Image,
    picture,
    shown,
    table,
    thing,
)
from tests.percepts.appearance.test_bodies import TOOL, TRAY, scene, turned
from visup.agent import Frame, Observation
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.tracking.redetection import candidates_by_colour, is_unique_by_colour
from visup.percepts.taught.taught_view import taught_view_from_mask

WIDE, HIGH = SIZES["tool"]
SIZE = WIDTH, HEIGHT


@settings(max_examples=25, deadline=None)
@given(st.floats(-180, 180), st.integers(60, 180), st.integers(50, 130))
def test_what_rests_is_found_however_it_is_turned(degrees: float, x: int, y: int) -> None:
    image, mask = turned(degrees, x, y)
    (place,) = candidates_by_colour(scene(image), TOOL, 0)
    rows, cols = np.nonzero(mask)
    middle = (cols.min() + cols.max()) / 2, (rows.min() + rows.max()) / 2
    assert (place.match.pose.x, place.match.pose.y) == pytest.approx(middle, abs=2.5)


@settings(max_examples=15, deadline=None)
@given(st.integers(8, WIDE - 8), st.booleans())
def test_what_the_border_cuts_is_where_its_free_side_is(hidden: int, left: bool) -> None:
    x = -hidden if left else WIDTH - WIDE + hidden
    (place,) = candidates_by_colour(scene(picture({"tool": (x, 60)})[0]), TOOL, 0)
    assert place.match.pose.x == pytest.approx(x + (WIDE - 1) / 2, abs=2.5)
    assert place.match.pose.y == pytest.approx(60 + (HIGH - 1) / 2, abs=2.5)


def test_an_empty_table_and_another_thing_are_nothing() -> None:
    assert candidates_by_colour(scene(table()), TOOL, 0) == []
    assert candidates_by_colour(scene(picture({"tray": (90, 60)})[0]), TOOL, 0) == []
    assert candidates_by_colour(scene(picture({"tool": (90, 60)})[0]), TRAY, 1) == []


def test_of_two_patches_neither_is_it() -> None:
    """Whichever of them it is, colours do not tell."""
    image, masks = picture({"tool": (30, 60)})
    image[60 : 60 + HIGH, 150 : 150 + WIDE] = image[masks["tool"]].reshape(HIGH, WIDE, 3)
    assert candidates_by_colour(scene(image), TOOL, 0) == []


@pytest.mark.parametrize("by", [0.3, 2.2])
def test_what_is_much_smaller_or_larger_is_something_else(by: float) -> None:
    image, masks = picture({"tool": (90, 60)})
    tool = image[masks["tool"]].reshape(HIGH, WIDE, 3)
    part = cv2.resize(tool, (round(WIDE * by), round(HIGH * by)))
    canvas = table()
    canvas[10 : 10 + part.shape[0], 90 : 90 + part.shape[1]] = part
    assert candidates_by_colour(scene(canvas), TOOL, 0) == []


@pytest.mark.parametrize("alone", [True, False])
def test_colours_are_distinctive_where_they_find_the_thing_where_it_was_taught(
    alone: bool,
) -> None:
    """A patch of the same colours beside the thing that is shown: elsewhere, it may be the patch."""
    taught, masks = picture({"tool": (60, 80)})
    if not alone:
        taught[80 : 80 + HIGH, 160 : 160 + WIDE] = taught[masks["tool"]].reshape(HIGH, WIDE, 3)
    view = taught_view_from_mask("tool", taught, masks["tool"])
    assert is_unique_by_colour(view_models([view])[0]) is alone
    behaviour = AppearanceBehaviour([view])
    found = behaviour.perceive(Frame(0, 0.0, turned(90)[0]), Observation(0, 0.0, SIZE), ())
    assert bool([p for p in found if p.kind == "hypothesis"]) is alone


def test_colours_that_find_something_else_where_it_was_taught_are_not_distinctive() -> None:
    """The thing was shown behind a fence, and another one like it, whole, beside it."""
    taught, masks = picture({"tool": (60, 80)})
    whole = taught[masks["tool"]].reshape(HIGH, WIDE, 3)
    taught[80 : 80 + HIGH, 160 : 160 + WIDE] = whole
    for rail in range(80, 80 + HIGH, 14):
        taught[rail : rail + 6, 60 : 60 + WIDE] = table()[rail : rail + 6, 60 : 60 + WIDE]
    (view,) = view_models([taught_view_from_mask("tool", taught, masks["tool"])])
    (other,) = candidates_by_colour(scene(view.scene), view, 0)
    assert other.match.pose.x == pytest.approx(160 + (WIDE - 1) / 2, abs=2.0)
    assert not is_unique_by_colour(view)


def resting(image: Image, frames: int) -> list[set[str]]:
    """The names told of a picture that does not change, frame by frame."""
    behaviour = AppearanceBehaviour(shown({"tool": (100, 60)}, "tool"))
    told = []
    for k in range(frames):
        found = behaviour.perceive(Frame(k, k / 15, image), Observation(k, k / 15, SIZE), ())
        told.append({p.value.name for p in found if p.kind == "hypothesis"})
    return told


def test_it_is_told_from_the_first_picture_on_and_stays_while_it_rests() -> None:
    """After two seconds at rest it is compared with its views, which it does not match."""
    told = resting(turned(90)[0], 50)
    assert told[0] == told[-1] == {"tool"}


@pytest.mark.parametrize("equal", [True, False])
def test_colours_do_not_tell_equal_things_apart(equal: bool) -> None:
    """A thing seen from another side, striped the other way, is one of the two equal ones."""
    places = {"part": (30, 60)} | ({"twin": (170, 60)} if equal else {})
    behaviour = AppearanceBehaviour(shown(places, *places))
    pixels = thing("part").reshape(-1, 3)
    canvas = table()
    canvas[80:110, 100:124] = np.random.default_rng(3).permutation(pixels).reshape(30, 24, 3)
    found = behaviour.perceive(Frame(0, 0.0, canvas), Observation(0, 0.0, SIZE), ())
    assert bool([p for p in found if p.kind == "hypothesis"]) is not equal
