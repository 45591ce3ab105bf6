"""Signatures by hand; matching against a dumb twin that tries everything."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.shape.shapes import ZOO, shape
from visup.percepts.shape.index import ViewIndex
from visup.percepts.shape.match import WEIGHTS, correspond, in_plane_rotation, match
from visup.percepts.shape.signature import adjacency, descendants, signatures

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
def test_signatures_worked_out_by_hand(edges: np.ndarray, size: int, root: list[float]) -> None:
    np.testing.assert_allclose(signatures(edges, size, 2)[0], root, atol=1e-6)


def test_signatures_do_not_depend_on_the_order_of_children() -> None:
    one = np.array([[0, 1], [0, 2], [1, 3], [1, 4], [2, 5]], dtype=np.int16)
    two = np.array([[0, 1], [0, 2], [1, 3], [2, 4], [2, 5]], dtype=np.int16)
    np.testing.assert_allclose(signatures(one, 6)[0], signatures(two, 6)[0], atol=1e-6)


def random_tree(parents: list[int]) -> np.ndarray:
    edges = [(p % (k + 1), k + 1) for k, p in enumerate(parents)]
    return np.array(edges, dtype=np.int16).reshape(-1, 2)


def best_next(
    below_a: np.ndarray, below_b: np.ndarray, value: np.ndarray, fixed: list[tuple[int, int]]
) -> tuple[float, tuple[tuple[int, int], ...]]:
    """The dumb twin: the best matching of what is left, by trying all."""
    free_a = [u for u in range(1, len(below_a)) if u not in {f for f, _ in fixed}]
    free_b = [v for v in range(1, len(below_b)) if v not in {f for _, f in fixed}]
    allowed = {
        (u, v)
        for u in free_a
        for v in free_b
        if all(below_a[x, u] == below_b[y, v] for x, y in fixed)
    }
    best: tuple[float, tuple[tuple[int, int], ...]] = (0.0, ())
    for size in range(1, min(len(free_a), len(free_b)) + 1):
        for us in itertools.combinations(free_a, size):
            for vs in itertools.permutations(free_b, size):
                pairs = tuple(zip(us, vs, strict=True))
                total = float(sum(value[p] for p in pairs))
                if total > best[0] + 1e-12 and allowed.issuperset(pairs):
                    best = (total, pairs)
    return best


def by_brute_force(below_a: np.ndarray, below_b: np.ndarray, value: np.ndarray) -> float:
    fixed: list[tuple[int, int]] = []
    while True:
        _, pairs = best_next(below_a, below_b, value, fixed)
        if not pairs:
            return float(sum(value[p] for p in fixed))
        fixed.append(max(pairs, key=lambda p: value[p]))


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
    pairs = correspond(below_a, below_b, value.astype(np.float32))
    assert len({u for u, _ in pairs}) == len({v for _, v in pairs}) == len(pairs)
    total = float(sum(value.astype(np.float32)[p] for p in pairs))
    assert total == pytest.approx(by_brute_force(below_a, below_b, value), abs=1e-5)


def test_a_match_never_crosses_the_hierarchy() -> None:
    a, b = shape(ZOO["walker"]).graph, shape(ZOO["star"]).graph
    pairs = [(u, v) for u, v, _ in match(a, b).pairs]
    for (u, v), (x, y) in itertools.permutations(pairs, 2):
        assert a.below[u, x] == b.below[v, y]


def test_a_graph_corresponds_to_itself_node_by_node() -> None:
    graph = shape(ZOO["walker"]).graph
    assert all(u == v for u, v, _ in match(graph, graph).pairs)


def test_the_index_bounds_what_matching_finds() -> None:
    shapes = [shape(m) for m in ZOO.values()]
    for query in shapes:
        bounds, _ = ViewIndex(shapes).bounds(query.graph, np.arange(len(shapes)))
        found = [match(query.graph, s.graph).similarity for s in shapes]
        assert (bounds >= np.array(found) - 1e-5).all()


def test_the_index_finds_the_same_shape_first() -> None:
    shapes = [shape(m) for m in ZOO.values()]
    index = ViewIndex(shapes, WEIGHTS)
    for k, query in enumerate(shapes):
        assert index.candidates(query, None, 1).numbers.tolist() == [k]


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_rotation_in_the_plane_is_found(quarters: int) -> None:
    mask = ZOO["walker"]
    a, b = shape(mask).graph, shape(np.rot90(mask, -quarters)).graph
    turn = in_plane_rotation(a, b, match(b, a))
    assert turn is not None
    # rot90 by -1 turns the picture clockwise, which is from x towards y with y down.
    off = (turn - quarters * np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
    assert abs(off) < 0.1
