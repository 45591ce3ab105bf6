"""A taught view holds the outlined pixels and their surroundings, and says where they were."""

import numpy as np
import pytest

from visup.agent.model.errors import SettingsError
from visup.percepts.taught.taught_view import taught_view


def test_the_outline_is_where_it_was_drawn() -> None:
    picture = np.zeros((100, 200, 3), np.uint8)
    picture[20:41, 60:91] = (0, 0, 255)
    view = taught_view("part", picture, [(60, 20), (90, 20), (90, 40), (60, 40)])
    assert view.bbox == (60, 20, 31, 21)
    assert (view.image[view.mask] == (0, 0, 255)).all()
    assert not view.image[~view.mask].any()
    assert view.image.shape[:2] == view.mask.shape


@pytest.mark.parametrize(
    "outline",
    [
        [],
        [(1, 1), (5, 5)],
        [(1, 1), (2, 2), (3, 3)],
        [(500, 500), (600, 500), (600, 600)],
        [(0, 0), (float("nan"), 4), (9, 9)],
        [(0, 0), (1e9, 4), (9, 9)],
    ],
)
def test_an_outline_of_nothing_is_refused(outline: list[tuple[float, float]]) -> None:
    with pytest.raises(SettingsError):
        taught_view("part", np.zeros((100, 200, 3), np.uint8), outline)
