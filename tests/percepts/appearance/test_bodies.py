"""Laws of recognising what moves by its colours, whatever its posture."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.appearance.scenes import (
    HEIGHT,
    WIDTH,
    Image,
    Mask,
    picture,
    shown,
    table,
    thing,
)
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.moving_body import (
    MovingBody,
    colour_similarity,
)
from visup.percepts.appearance.models.scene import Scene, prepare_scene
from visup.percepts.appearance.tracking.redetection import candidates_at_bodies

VIEWS = view_models(shown({"tool": (100, 60), "tray": (20, 20)}, "tool", "tray"))
TOOL, TRAY = VIEWS


def turned(degrees: float, x: int = 120, y: int = 90) -> tuple[Image, Mask]:
    """The tool on the table, turned about its centre; and its mask."""
    part = thing("tool")
    h, w = part.shape[:2]
    matrix = cv2.getRotationMatrix2D(((w - 1) / 2, (h - 1) / 2), degrees, 1.0)
    matrix[:, 2] += (x - w / 2, y - h / 2)
    size = (WIDTH, HEIGHT)
    mask = cv2.warpAffine(np.ones((h, w), np.float32), matrix, size) > 0.5
    image = table()
    image[mask] = cv2.warpAffine(part, matrix, size, borderMode=cv2.BORDER_REPLICATE)[mask]
    return image, np.asarray(mask)


def blob(mask: Mask) -> Blob:
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    return Blob((x, y, x + w, y + h), mask[y : y + h, x : x + w])


def scene(image: Image) -> Scene:
    return prepare_scene(image, 0.0)


@settings(max_examples=25, deadline=None)
@given(st.floats(-180, 180), st.integers(60, 180), st.integers(50, 130))
def test_a_moving_thing_is_found_however_it_is_turned(degrees: float, x: int, y: int) -> None:
    image, mask = turned(degrees, x, y)
    (place,) = candidates_at_bodies(scene(image), TOOL, 0, [MovingBody(7, blob(mask), cut=False)])
    rows, cols = np.nonzero(mask)
    assert (place.name, place.appearance) == ("tool", TOOL.appearance)
    assert (place.match.pose.x, place.match.pose.y) == pytest.approx(
        (cols.mean(), rows.mean()), abs=1.5
    )


@pytest.mark.parametrize("degrees", [0, 40, 90])
def test_a_moving_thing_is_no_other_one(degrees: float) -> None:
    image, mask = turned(degrees)
    assert candidates_at_bodies(scene(image), TRAY, 1, [MovingBody(7, blob(mask), cut=False)]) == []


def test_a_shadow_on_the_table_is_nothing() -> None:
    mask = np.zeros((HEIGHT, WIDTH), dtype=bool)
    mask[60:110, 90:130] = True
    image = table()
    image[mask] = image[mask] * 0.6
    bodies = [MovingBody(7, blob(mask), cut=False)]
    assert all(not candidates_at_bodies(scene(image), v, 0, bodies) for v in VIEWS)


@pytest.mark.parametrize(("by", "cut", "found"), [(1.0, False, 1), (0.3, False, 0), (0.3, True, 1)])
def test_a_body_is_about_as_large_as_the_thing_unless_the_border_cuts_it(
    by: float, cut: bool, found: int
) -> None:
    image, mask = turned(0)
    rows = np.flatnonzero(mask.any(axis=1))
    mask[rows[0] + round(by * by * len(rows)) :] = False
    image[~mask] = table()[~mask]
    assert (
        len(candidates_at_bodies(scene(image), TOOL, 0, [MovingBody(7, blob(mask), cut)])) == found
    )


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 210), st.integers(0, 150), st.integers(1, 30), st.integers(1, 30))
def test_colours_are_shares(x: int, y: int, w: int, h: int) -> None:
    image, _ = picture({"tool": (100, 60)})
    excess, alike = colour_similarity(
        scene(image), TOOL.appearance, Blob((x, y, x + w, y + h), np.ones((h, w), dtype=bool))
    )
    assert -1 <= excess <= 1
    assert -1e-5 <= alike <= 1 + 1e-5
