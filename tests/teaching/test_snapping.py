"""A roughly drawn outline follows the edges near it, and stays where there are none."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from visup.teaching.outlines import DrawnOutline
from visup.teaching.snapping import snapped


def scene(centre: tuple[int, int], radius: int) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    rng = np.random.default_rng(3)
    picture = rng.normal((120, 110, 100), 6, (240, 320, 3)).clip(0, 255).astype(np.uint8)
    disc = np.zeros((240, 320), np.uint8)
    cv2.circle(disc, centre, radius, (1,), -1)
    picture[disc > 0] = rng.normal((40, 60, 210), 6, (int(disc.sum()), 3)).clip(0, 255)
    return picture, disc > 0


def overlap(outline: DrawnOutline, truth: NDArray[np.bool_]) -> float:
    mask = np.zeros(truth.shape, np.uint8)
    cv2.fillPoly(mask, [np.round(outline.corners).astype(np.int32)], (1,))
    return float((truth & (mask > 0)).sum() / (truth | (mask > 0)).sum())


@pytest.mark.parametrize(("centre", "radius"), [((160, 120), 50), ((30, 120), 40), ((90, 60), 25)])
def test_a_rough_outline_comes_closer(centre: tuple[int, int], radius: int) -> None:
    picture, truth = scene(centre, radius)
    turns = np.arange(6) * np.pi / 3
    rough = np.column_stack([np.cos(turns), np.sin(turns)]) * radius + centre
    drawn = DrawnOutline("disc", tuple((float(x), float(y)) for x, y in rough.clip(0, 319)))
    found = snapped(picture, drawn)
    assert found.name == "disc"
    assert overlap(found, truth) > max(0.93, overlap(drawn, truth))
    assert snapped(picture, drawn) == found


def test_without_edges_the_outline_is_unchanged() -> None:
    flat = np.full((100, 100, 3), 128, np.uint8)
    drawn = DrawnOutline("none", ((20.0, 20.0), (60.0, 20.0), (60.0, 60.0), (20.0, 60.0)))
    assert overlap(snapped(flat, drawn), overlap_mask(drawn)) > 0.5


def overlap_mask(outline: DrawnOutline) -> NDArray[np.bool_]:
    mask = np.zeros((100, 100), np.uint8)
    cv2.fillPoly(mask, [np.round(outline.corners).astype(np.int32)], (1,))
    return mask > 0


def test_a_sliver_is_unchanged() -> None:
    picture, _ = scene((160, 120), 50)
    drawn = DrawnOutline("line", ((10.0, 10.0), (200.0, 10.0), (200.0, 11.0)))
    assert snapped(picture, drawn) == drawn
