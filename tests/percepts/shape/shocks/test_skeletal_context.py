"""What a shape looks like from its skeleton: ways against a dumb twin, and what must not matter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from tests.percepts.shape.shapes import LIMBS, limbs, shape
from visup.percepts.shape.shocks.skeletal_context import (
    CONTEXT,
    SkeletonPlaces,
    SkeletonTree,
    directed_contexts,
    whole_context,
)
from visup.percepts.shape.shocks.skeleton import Skeleton, skeletonise

FEW = settings(max_examples=15, deadline=None)
BLOB = np.random.default_rng(3).normal(0, 0.4, (200, 2)) * (1.0, 0.6)


def skeleton_of(angles: tuple[float, ...]) -> Skeleton:
    return skeletonise(shape(limbs(angles)).contour.astype(float))


def by_dijkstra(skeleton: Skeleton) -> np.ndarray:
    """The dumb twin: shortest ways between all points of a skeleton."""
    a, b = np.concatenate([np.stack([r[:-1], r[1:]]) for r in skeleton.branches], axis=1)
    steps = np.hypot(*(skeleton.points[a] - skeleton.points[b]).T)
    size = len(skeleton.points)
    return np.asarray(dijkstra(coo_matrix((steps, (a, b)), shape=(size, size)), directed=False))


@FEW
@given(LIMBS)
def test_paths_along_the_skeleton_are_the_shortest(angles: tuple[float, ...]) -> None:
    skeleton = skeleton_of(angles)
    tree = SkeletonTree(skeleton)
    numbers = np.concatenate(skeleton.branches)
    found, _ = tree.paths(tree.places, tree.places)
    np.testing.assert_allclose(found, by_dijkstra(skeleton)[np.ix_(numbers, numbers)], atol=1e-9)


@FEW
@given(LIMBS)
def test_a_path_starts_towards_the_nearer_end(angles: tuple[float, ...]) -> None:
    tree = SkeletonTree(skeleton_of(angles))
    branches = np.arange(len(tree.lengths))
    middle = SkeletonPlaces(branches, 0.5 * tree.lengths)
    ahead = SkeletonPlaces(branches, 0.5 * tree.lengths + 1e-6)
    way, onwards = tree.paths(middle, tree.places)
    from_ahead, _ = tree.paths(ahead, tree.places)
    np.testing.assert_array_equal(from_ahead < way, onwards)


def test_a_single_point_is_a_skeleton() -> None:
    tree = SkeletonTree(Skeleton(np.array([[0.5, 0.25]]), np.array([0.5]), ()))
    way, _ = tree.paths(tree.places, tree.places)
    assert way.tolist() == [[0.0]]
    assert tree.points_at(np.array([0]), np.array([0.0])).tolist() == [[0.5, 0.25]]


def seen(area: np.ndarray, direction: np.ndarray) -> np.ndarray:
    paths = np.hypot(*area.T)[None]
    thickness = np.full(len(area), 0.2)
    return directed_contexts(area, thickness, paths, np.zeros((1, 2)), direction[None])


@FEW
@given(st.floats(0, 2 * np.pi), st.booleans())
def test_contexts_are_invariant_to_rotation_and_mirroring(turn: float, mirrored: bool) -> None:
    way = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    if mirrored:
        way = np.diag([1.0, -1.0]) @ way
    start = np.array([1.0, 0.0])
    before, after = seen(BLOB, start), seen(BLOB @ way, start @ way)
    assert before.shape == (1, CONTEXT)
    assert before.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(after, before, atol=1e-9)
    np.testing.assert_allclose(whole_context(BLOB @ way), whole_context(BLOB), atol=1e-9)


def test_contexts_distinguish_ahead_from_behind() -> None:
    lopsided = BLOB + np.array([0.4, 0.0])
    ahead, back = seen(lopsided, np.array([1.0, 0.0])), seen(lopsided, np.array([-1.0, 0.0]))
    assert np.abs(ahead - back).sum() > 0.5
