"""Skeletons, shocks, and the grammar of the graphs that they form."""

from __future__ import annotations

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings

from tests.percepts.shape.shapes import FLOWERS, LIMBS, flower, limbs, shape
from visup.percepts.shape.shocks.shock_graph import ShockGraph
from visup.percepts.shape.shocks.shock_labels import ShockKind
from visup.percepts.shape.shocks.skeleton import skeletonise

Y, X = np.mgrid[-80:81, -80:81]
DISC = np.hypot(X, Y) < 40
ELLIPSE = np.hypot(X, 2 * Y) < 70
RECTANGLE = (abs(X) < 70) & (abs(Y) < 20)
PEANUT = np.hypot(abs(X) - 25, Y) < 32
BONE = (np.hypot(abs(X) - 50, Y) < 22) | ((abs(X) < 50) & (abs(Y) < 8))
CLOVER = np.hypot(X, Y) < 35 + 25 * np.cos(3 * np.arctan2(Y, X))

KINDS = [
    ("disc", DISC, {ShockKind.SEED: 1}),
    ("ellipse", ELLIPSE, {ShockKind.SEED: 1, ShockKind.PROTRUSION: 2}),
    ("rectangle", RECTANGLE, {ShockKind.BEND: 1, ShockKind.PROTRUSION: 4}),
    ("peanut", PEANUT, {ShockKind.SEED: 2, ShockKind.PROTRUSION: 2, ShockKind.NECK: 1}),
    ("bone", BONE, {ShockKind.SEED: 2, ShockKind.PROTRUSION: 2, ShockKind.BEND: 1}),
]


@pytest.mark.parametrize(("name", "mask", "kinds"), KINDS, ids=[k[0] for k in KINDS])
def test_simple_shapes_have_the_shocks_of_the_paper(
    name: str, mask: np.ndarray, kinds: dict[ShockKind, int]
) -> None:
    found = shape(mask).graph.kinds[1:].tolist()
    assert {ShockKind(k): found.count(k) for k in set(found)} == kinds


def assert_grammar(graph: ShockGraph) -> None:
    parents = [graph.edges[graph.edges[:, 1] == n, 0].tolist() for n in range(len(graph))]
    assert graph.kinds[0] == ShockKind.ROOT
    assert not parents[0]
    for node in range(1, len(graph)):
        children = graph.edges[graph.edges[:, 0] == node, 1]
        assert parents[node], "every shock hangs below something"
        assert max(parents[node]) < node, "parents come before children"
        if graph.kinds[node] == ShockKind.SEED:
            assert parents[node] == [0]
        if graph.kinds[node] == ShockKind.NECK:
            assert not len(children)
            assert len(parents[node]) == 2
        assert len(parents[node]) <= 2


@settings(max_examples=25, deadline=None)
@given(FLOWERS)
def test_graphs_of_blobs_obey_the_grammar(lobes: tuple[tuple[int, float], ...]) -> None:
    assert_grammar(shape(flower(lobes)).graph)


@settings(max_examples=25, deadline=None)
@given(LIMBS)
def test_graphs_of_limbed_bodies_obey_the_grammar(angles: tuple[float, ...]) -> None:
    graph = shape(limbs(angles)).graph
    assert_grammar(graph)
    assert graph.weights.sum() == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_allclose(graph.contexts[1:].sum(axis=1), 1.0, atol=1e-4)


def test_each_lobe_of_a_clover_is_a_branch() -> None:
    skeleton = skeletonise(shape(CLOVER).contour.astype(float))
    assert len(skeleton.branches) == 3


@settings(max_examples=25, deadline=None)
@given(LIMBS)
def test_a_skeleton_is_one_tree_inside_its_shape(angles: tuple[float, ...]) -> None:
    skeleton = skeletonise(shape(limbs(angles)).contour.astype(float))
    edges = {
        (int(min(a, b)), int(max(a, b)))
        for run in skeleton.branches
        for a, b in itertools.pairwise(run)
    }
    reached, todo = {0}, [0]
    while todo:
        here = todo.pop()
        near = {a + b - here for a, b in edges if here in (a, b)} - reached
        reached |= near
        todo += near
    assert reached == set(range(len(skeleton.points)))
    assert len(edges) == len(skeleton.points) - 1
    assert (skeleton.radii > 0).all()


def test_radii_are_accurate_to_less_than_a_pixel() -> None:
    skeleton = skeletonise(shape(RECTANGLE).contour.astype(float))
    unit = np.sqrt(139 * 39)
    assert np.median(skeleton.radii) * unit == pytest.approx(19.5, abs=0.4)


@settings(max_examples=10, deadline=None)
@given(LIMBS)
def test_the_exported_graph_is_the_same_rooted_graph(angles: tuple[float, ...]) -> None:
    graph = shape(limbs(angles)).graph
    exported = graph.to_networkx()
    assert nx.is_directed_acyclic_graph(exported)
    assert sorted(exported.edges) == sorted(map(tuple, graph.edges.tolist()))
    assert {0, *nx.descendants(exported, 0)} == set(exported.nodes) == set(range(len(graph)))
    for node in exported:
        below = {node, *nx.descendants(exported, node)}
        assert below == set(np.flatnonzero(graph.below[node]).tolist())
    assert sum(w for _, w in exported.nodes(data="weight")) == pytest.approx(1.0, abs=1e-4)
