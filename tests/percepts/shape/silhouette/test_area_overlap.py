"""Areas laid on each other, islands joined, symmetries of meshes."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.percepts.shape.shapes import ZOO
from visup.percepts.shape.silhouette.area_overlap import (
    ANGLES,
    RINGS,
    AreaIndex,
    area_map,
    area_overlaps,
)
from visup.percepts.shape.silhouette.fragments import join_fragments

Mask = NDArray[np.bool_]
NAMES = sorted(ZOO)


def transformed(mask: Mask, degrees: float, mirrored: bool) -> Mask:
    """Mirrored left to right if so wanted, then turned clockwise."""
    side = int(np.hypot(*mask.shape)) + 4
    tone = np.ascontiguousarray(mask[:, ::-1] if mirrored else mask).astype(np.float32)
    height, width = mask.shape
    warp = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), -degrees, 1.0)
    warp[:, 2] += ((side - width) / 2, (side - height) / 2)
    return np.asarray(cv2.warpAffine(tone, warp, (side, side)) > 0.5)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(NAMES), st.floats(-179, 179), st.booleans())
def test_a_rotated_shape_overlaps_itself(name: str, degrees: float, mirrored: bool) -> None:
    own = area_map(ZOO[name])
    found = area_overlaps(area_map(transformed(ZOO[name], degrees, mirrored)), own[None])
    assert found.similarity[0, int(mirrored)] > 0.97


@settings(max_examples=30, deadline=None)
@given(st.floats(-179, 179), st.booleans())
def test_the_rotation_is_recovered(degrees: float, mirrored: bool) -> None:
    shape = np.zeros((90, 120), dtype=bool)
    shape[30:60, 10:110] = shape[60:85, 15:30] = shape[10:30, 70:80] = True
    found = area_overlaps(area_map(transformed(shape, degrees, mirrored)), area_map(shape)[None])
    off = np.degrees(found.rotation[0, int(mirrored)]) - degrees
    assert abs((off + 180) % 360 - 180) < 3
    assert found.similarity[0, int(mirrored)] > found.similarity[0, 1 - int(mirrored)]


def slow_overlap(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> tuple[float, float]:
    """The best over all rotations one by one, straight and mirrored, without smoothing away detail."""
    edges = np.concatenate([np.linspace(0.0, 1.2, 10), np.linspace(1.56, 3.0, 5)])
    weight = (np.diff(edges) * 0.5 * (edges[1:] + edges[:-1]))[:, None]
    one, other = a / 255.0, b / 255.0
    power = (weight * one**2).sum() + (weight * other**2).sum()
    best = []
    for ring in (other, other[:, -np.arange(ANGLES) % ANGLES]):
        common = [(weight * one * np.roll(ring, k, axis=1)).sum() for k in range(ANGLES)]
        best.append(2 * max(common) / power)
    return best[0], best[1]


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(NAMES), st.sampled_from(NAMES))
def test_overlaps_equal_those_of_a_brute_force_search(first: str, second: str) -> None:
    a, b = area_map(ZOO[first]), area_map(ZOO[second])
    assert a.shape == (RINGS, ANGLES)
    found = area_overlaps(a, b[None]).similarity[0]
    # Frequencies above the seventeenth are left out, which a blurred map hardly has.
    assert found == pytest.approx(slow_overlap(a, b), abs=0.01)


def test_an_index_of_many_equals_single_indices() -> None:
    maps = np.stack([area_map(ZOO[n]) for n in NAMES])
    index = AreaIndex(maps)
    every = index.overlaps(maps[2])
    some = index.overlaps(maps[2], np.array([0, 2]))
    assert len(index) == len(NAMES)
    assert some.similarity == pytest.approx(every.similarity[[0, 2]], abs=1e-6)
    assert every.similarity[2, 0] == pytest.approx(1.0, abs=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 12), st.integers(10, 40))
def test_only_a_narrow_gap_is_bridged(gap: int, thick: int) -> None:
    """Two blocks are one when the gap is at most a fifth of the square root of the area; and only then."""
    mask = np.zeros((60, 140), dtype=np.uint8)
    mask[10 : 10 + thick, 10:60] = mask[10 : 10 + thick, 60 + gap : 110 + gap] = 1
    side = float(mask.sum()) ** 0.5
    found = join_fragments(mask)
    both = bool(found[12, 30]) and bool(found[12, 100 + gap])
    if gap <= 0.18 * side:
        assert both
    if gap > 0.21 * side + 2:
        assert not both


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_joined_fragments_are_one_part_with_all_their_pixels(seed: int) -> None:
    noise = np.random.default_rng(seed).normal(size=(80, 80))
    mask = (cv2.GaussianBlur(noise, (0, 0), 3) > 0.02).astype(np.uint8)
    found = join_fragments(mask)
    count, _ = cv2.connectedComponents(found.astype(np.uint8), connectivity=8)
    assert count == (2 if mask.any() else 1)
    _, labels = cv2.connectedComponents(mask, connectivity=8)
    # An island is taken whole or not at all.
    for island in range(1, labels.max() + 1):
        assert found[labels == island].all() or not found[labels == island].any()


def test_a_connected_mask_is_unchanged() -> None:
    for mask in ZOO.values():
        assert (join_fragments(mask.astype(np.uint8)) == mask).all()


def test_an_empty_mask_stays_empty() -> None:
    assert not join_fragments(np.zeros((5, 5), dtype=np.uint8)).any()
