"""Signatures by hand; matching against a dumb twin that tries everything."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.shape.shapes import ZOO, shape
from visup.percepts.shape.index.view_index import ViewIndex
from visup.percepts.shape.matching.graph_matching import (
    HIERARCHY_PENALTY,
    WEIGHTS,
    corresponding_nodes,
    match_graphs,
)
from visup.percepts.shape.matching.shape_similarity import compare_shapes
from visup.percepts.shape.shocks.topological_signature import adjacency, descendants, signatures

PATH = np.array([[0, 1], [1, 2]], dtype=np.int16)
FAN = np.array([[0, 1], [0, 2], [0, 3]], dtype=np.int16)
FORK = np.array([[0, 1], [1, 2], [1, 3]], dtype=np.int16)


def test_adjacency_is_antisymmetric() -> None:
    expected = [[0, 1, 0], [-1, 0, 1], [0, -1, 0]]
    np.testing.assert_array_equal(adjacency(PATH, 3), expected)


def test_descendants_of_a_fork() -> None:
    expected = np.array([[1, 1, 1, 1], [0, 1, 1, 1], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=bool)
    np.testing.assert_array_equal(descendants(FORK, 4), expected)


@pytest.mark.parametrize(
    ("edges", "size", "root"),
    [
        # The child has one child: eigenvalues of an edge are +-i, the greatest counts 1.
        (PATH, 3, [1.0, 0.0]),
        # Three leaves count nothing.
        (FAN, 4, [0.0, 0.0]),
        # The child has two leaves: eigenvalues 0, +-i sqrt 2; the greatest two count 2 sqrt 2.
        (FORK, 4, [2 * 2**0.5, 0.0]),
    ],
    ids=["path", "fan", "fork"],
)
def test_signatures_equal_hand_computed_values(
    edges: np.ndarray, size: int, root: list[float]
) -> None:
    np.testing.assert_allclose(signatures(edges, size, 2)[0], root, atol=1e-6)


def test_signatures_do_not_depend_on_the_order_of_children() -> None:
    one = np.array([[0, 1], [0, 2], [1, 3], [1, 4], [2, 5]], dtype=np.int16)
    two = np.array([[0, 1], [0, 2], [1, 3], [2, 4], [2, 5]], dtype=np.int16)
    np.testing.assert_allclose(signatures(one, 6)[0], signatures(two, 6)[0], atol=1e-6)


def random_tree(parents: list[int]) -> np.ndarray:
    edges = [(p % (k + 1), k + 1) for k, p in enumerate(parents)]
    return np.array(edges, dtype=np.int16).reshape(-1, 2)


def hierarchy_factor(
    below_a: np.ndarray, below_b: np.ndarray, pair: tuple[int, int], taken: list[tuple[int, int]]
) -> float:
    """By how much a pair's value falls for the pairs that were taken before it."""
    u, v = pair
    broken = [below_a[x, u] != below_b[y, v] or below_a[u, x] != below_b[v, y] for x, y in taken]
    return float(HIERARCHY_PENALTY ** sum(broken))


def by_brute_force(below_a: np.ndarray, below_b: np.ndarray, value: np.ndarray) -> float:
    """The dumb twin: the best matching of what is left, by trying all, again for every pair."""
    taken: list[tuple[int, int]] = []
    total = 0.0
    while True:
        free_a = [u for u in range(1, len(below_a)) if u not in {x for x, _ in taken}]
        free_b = [v for v in range(1, len(below_b)) if v not in {y for _, y in taken}]
        size = min(len(free_a), len(free_b))
        if not size:
            return total
        left = {
            p: float(value[p]) * hierarchy_factor(below_a, below_b, p, taken)
            for p in itertools.product(free_a, free_b)
        }
        matchings = [
            list(zip(us, vs, strict=True))
            for us in itertools.combinations(free_a, size)
            for vs in itertools.permutations(free_b, size)
        ]
        best = max(matchings, key=lambda pairs: sum(left[p] for p in pairs))
        pair = max(best, key=lambda p: left[p])
        total += left[pair]
        taken.append(pair)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.integers(0, 4), min_size=1, max_size=3),
    st.lists(st.integers(0, 4), min_size=1, max_size=4),
    st.integers(0, 10_000),
)
def test_matching_agrees_with_brute_force(a: list[int], b: list[int], seed: int) -> None:
    below_a = descendants(random_tree(a), len(a) + 1)
    below_b = descendants(random_tree(b), len(b) + 1)
    value = np.random.default_rng(seed).uniform(0.05, 1, (len(a) + 1, len(b) + 1))
    value = value.astype(np.float32)
    pairs = corresponding_nodes(below_a, below_b, value)
    assert len({u for u, _, _ in pairs}) == len({v for _, v, _ in pairs}) == len(pairs)
    taken: list[tuple[int, int]] = []
    for u, v, left in pairs:
        share = hierarchy_factor(below_a, below_b, (u, v), taken)
        assert left == pytest.approx(float(value[u, v]) * share, abs=1e-6)
        taken.append((u, v))
    total = sum(left for _, _, left in pairs)
    assert total == pytest.approx(by_brute_force(below_a, below_b, value), abs=1e-5)


def test_a_pair_that_contradicts_the_hierarchy_counts_less() -> None:
    chain, fan = descendants(PATH, 3), descendants(np.array([[0, 1], [0, 2]], dtype=np.int16), 3)
    value = np.full((3, 3), 0.25, dtype=np.float32)
    value[1, 1] = 0.5
    assert sum(w for _, _, w in corresponding_nodes(chain, chain, value)) == pytest.approx(0.75)
    assert sum(w for _, _, w in corresponding_nodes(chain, fan, value)) == pytest.approx(
        0.5 + HIERARCHY_PENALTY * 0.25
    )


def test_a_graph_corresponds_to_itself_node_by_node() -> None:
    graph = shape(ZOO["walker"]).graph
    assert all(u == v for u, v, _ in match_graphs(graph, graph).pairs)


def test_index_bounds_are_upper_bounds_of_matching() -> None:
    shapes = [shape(m) for m in ZOO.values()]
    for query in shapes:
        bounds, _ = ViewIndex(shapes).bounds(query.graph, np.arange(len(shapes)))
        found = [match_graphs(query.graph, s.graph).similarity for s in shapes]
        assert (bounds >= np.array(found) - 1e-5).all()


def test_the_index_finds_the_same_shape_first() -> None:
    shapes = [shape(m) for m in ZOO.values()]
    index = ViewIndex(shapes, WEIGHTS)
    for k, query in enumerate(shapes):
        assert index.candidates(query, None, 1).numbers.tolist() == [k]


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_rotation_in_the_plane_is_found(quarters: int) -> None:
    mask = ZOO["walker"]
    turn = compare_shapes(shape(np.rot90(mask, -quarters)), shape(mask)).rotation
    assert turn is not None
    # rot90 by -1 turns the picture clockwise, which is from x towards y with y down.
    off = (turn - quarters * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
    assert abs(off) < 0.1
