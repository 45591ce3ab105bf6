"""Silhouettes made for tests, and a small database of them."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.index.view_records import NewView
from visup.percepts.shape.matching.shape_similarity import Shape, shape_of
from visup.percepts.shape.silhouette.silhouette import normalise

Mask = NDArray[np.bool_]


def flower(lobes: tuple[tuple[int, float], ...], size: float = 60.0, turn: float = 0.0) -> Mask:
    """A blob whose radius varies with the angle; `lobes` holds (how many, how deep)."""
    half = int(2.2 * size)
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    angle = np.arctan2(y, x) - turn
    radius = size * (1 + sum(d * np.cos(k * angle + k) for k, d in lobes))
    return np.asarray(np.hypot(x, y) < radius)


def limbs(angles: tuple[float, ...], size: float = 60.0, turn: float = 0.0) -> Mask:
    """A body with limbs in these directions, each a little shorter than the one before."""
    half = int(3.2 * size)
    canvas = np.zeros((2 * half, 2 * half), np.uint8)
    cv2.ellipse(
        canvas, (half, half), (int(size), int(0.6 * size)), np.degrees(turn), 0, 360, 255, -1
    )
    for k, angle in enumerate(angles):
        reach = size * (2.4 - 0.25 * k)
        end = (half + reach * np.cos(angle + turn), half + reach * np.sin(angle + turn))
        to = (round(end[0]), round(end[1]))
        cv2.line(canvas, (half, half), to, 255, max(3, int(0.35 * size)))
    return np.asarray(canvas > 0)


def shape(mask: Mask, cut: bool = False) -> Shape:
    silhouette = normalise(mask, cut=cut)
    assert silhouette is not None
    return shape_of(silhouette)


FLOWERS = st.lists(
    st.tuples(st.integers(2, 6), st.floats(0.05, 0.3)),
    min_size=1,
    max_size=3,
    unique_by=lambda t: t[0],
).map(tuple)

LIMBS = st.lists(st.integers(0, 11), min_size=1, max_size=5, unique=True).map(
    lambda steps: tuple(np.pi / 6 * s for s in sorted(steps))
)

ZOO: dict[str, Mask] = {
    "clover": flower(((3, 0.4),)),
    "pear": flower(((1, 0.3), (2, 0.2))),
    "star": flower(((5, 0.35),)),
    "walker": limbs((0.3, 1.2, 2.0, 4.0)),
    "stick": limbs((0.0, np.pi)),
}


def small_database(path: Path) -> ModelDatabase:
    """One view of each shape in the zoo, one square unit of area each."""
    views = [NewView(name, (0.0, 0.0, 1.0), 1.0, shape(mask)) for name, mask in ZOO.items()]
    return ModelDatabase.create(path, views)
