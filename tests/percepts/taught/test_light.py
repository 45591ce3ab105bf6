"""Other light: what it does to pictures can be undone, whatever moves in them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.percepts.appearance.scenes import Image, picture, shown
from visup.percepts.taught.lighting import light_change, relit_views

START = {"tray": (150, 110), "part": (40, 60)}
MOVED = {"tray": (150, 110), "part": (170, 20), "tool": (100, 90)}


def dimmed(image: Image, light: tuple[float, ...]) -> Image:
    return np.asarray(np.clip(image * np.asarray(light), 0, 255), dtype=np.uint8)


@given(st.tuples(*[st.floats(0.3, 1.2)] * 3))
def test_the_change_of_light_is_found_though_things_move(light: tuple[float, ...]) -> None:
    found = light_change(picture(START)[0], dimmed(picture(MOVED, seed=7)[0], light))
    assert found == pytest.approx(light, rel=0.06)


def test_what_fills_a_third_of_the_picture_changes_no_light() -> None:
    image = picture(START)[0].copy()
    image[:, :70] = 5
    assert light_change(picture(START)[0], image) == pytest.approx((1.0, 1.0, 1.0), abs=0.05)


@pytest.mark.parametrize("light", [(1.0, 1.0, 1.0), (0.9, 0.95, 1.0)])
def test_in_almost_the_same_light_there_is_no_other_view(light: tuple[float, ...]) -> None:
    assert not list(relit_views(shown(START, "part", "tray"), dimmed(picture(MOVED)[0], light)))


def test_views_look_as_things_look_in_that_light() -> None:
    light = (0.5, 0.6, 0.7)
    views = shown(START, "part", "tray")
    found = dict(relit_views(views, dimmed(picture(MOVED)[0], light)))
    assert list(found) == [0, 1]
    for number, view in found.items():
        assert view.name == views[number].name
        assert np.array_equal(view.mask, views[number].mask)
        for lit, taught in ((view.image, views[number].image), (view.scene, views[number].scene)):
            assert abs(lit - dimmed(taught, light).astype(float)).mean() < 4


def test_a_picture_without_colours_tells_how_light_it_is() -> None:
    grey = picture(START)[0].mean(axis=2).astype(np.uint8)
    views = shown(START, "part")
    for image in (grey // 2, (grey // 2)[..., None]):
        ((number, _),) = relit_views(views, image)
        assert number == 0


@pytest.mark.parametrize(("light", "views"), [(0.4, 1), (0.2, 0), (0.0, 0)])
def test_a_picture_in_the_dark_tells_nothing_of_the_light(light: float, views: int) -> None:
    assert (
        len(list(relit_views(shown(START, "part"), dimmed(picture(START)[0], (light,) * 3))))
        == views
    )
