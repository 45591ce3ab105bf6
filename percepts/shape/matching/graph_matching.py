"""Matching of two shock graphs by recursive bipartite matching.

After figure 3 of the paper (Shokoufandeh et al. 2005): every node of one graph is compared with every node of
the other, by its features and its topological signature; a maximum-cardinality, best-weight bipartite
matching is found; its best pair is accepted; the graphs are split at that pair, so that what is below one
node should match what is below the other; and so on. Where two limbs are about equally thick, noise decides
which is below the other. Therefore, unlike in the paper, a pair that contradicts a better one is not
forbidden but worth less.

Node features are embedded so that the similarity of two nodes is exp(-|a - b|^2): one matrix product compares
a silhouette with a whole database.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from visup.percepts.shape.shocks.shock_graph import ShockGraph

HIERARCHY_PENALTY = 0.9
"""Factor of a pair's value for each better pair whose hierarchy it contradicts."""


@dataclass(frozen=True, slots=True)
class MatchWeights:
    """Weight of each node feature in the comparison of two nodes.

    Attributes:
        kind: Different kinds of shock.
        length: Square root of the length along the skeleton.
        profile: Square roots of the radii along the node.
        context: The shape as seen from the node.
        signature: Topology of the subgraph below.
        root: Share of the root, the shape as a whole, in the similarity.
    """

    kind: float = 0.15
    length: float = 0.25
    profile: float = 3.0
    context: float = 1.9
    signature: float = 0.05
    root: float = 0.15


WEIGHTS = MatchWeights()


@dataclass(frozen=True, slots=True)
class GraphMatch:
    """The result of matching two graphs.

    Attributes:
        similarity: 0 to 1; 1 for equal graphs.
        pairs: (node of the first, node of the second, similarity of the two) in the order found.
    """

    similarity: float
    pairs: tuple[tuple[int, int, float], ...]

    def swapped(self) -> GraphMatch:
        """The same match with the graphs exchanged."""
        return GraphMatch(self.similarity, tuple((v, u, s) for u, v, s in self.pairs))


def embed(graph: ShockGraph, weights: MatchWeights = WEIGHTS) -> NDArray[np.float32]:
    """Nodes as points: their similarity is exp(-squared distance).

    Returns:
        (N, D) float32.
    """
    kind = np.eye(5, dtype=np.float32)[graph.kinds] * weights.kind
    length = np.sqrt(graph.lengths)[:, None] * weights.length
    scale = weights.profile / graph.profiles.shape[1] ** 0.5
    profile = np.sqrt(graph.profiles) * scale
    context = np.sqrt(graph.contexts) * weights.context
    signature = graph.signatures * weights.signature
    return np.hstack([kind, length, profile, context, signature]).astype(np.float32)


def node_similarities(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float32]:
    """Similarity of every node of one embedding with every node of another; (N, M) in (0, 1]."""
    squares = (a**2).sum(axis=1)[:, None] - 2 * (a @ b.T) + (b**2).sum(axis=1)[None]
    return np.asarray(np.exp(-np.maximum(squares, 0.0)), dtype=np.float32)


def match_graphs(a: ShockGraph, b: ShockGraph, weights: MatchWeights = WEIGHTS) -> GraphMatch:
    """Match two graphs.

    Args:
        a: The first graph.
        b: The second graph.
        weights: How much each feature counts.

    Returns:
        The similarity, which is symmetric, and the corresponding nodes.
    """
    if b.key < a.key:
        return match_graphs(b, a, weights).swapped()
    similarities = node_similarities(embed(a, weights), embed(b, weights))
    return match_nodes(a, b, similarities, weights.root)


def match_nodes(
    a: ShockGraph,
    b: ShockGraph,
    similarities: NDArray[np.float32],
    root: float,
    *,
    part: bool = False,
) -> GraphMatch:
    """Match two graphs, given the similarities of their nodes.

    Args:
        a: The first graph, N nodes.
        b: The second graph, M nodes.
        similarities: (N, M), similarity of each pair of nodes.
        root: Share of the root in the similarity.
        part: Whether the first is a part only; nodes of the second without a partner then cost nothing.

    Returns:
        The match. Each pair counts by the mean of its two nodes' shares of the area, or by the first's
        when it is a part.
    """
    weights_b = a.weights[:, None] if part else b.weights[None]
    shares = 0.5 * (a.weights[:, None] + weights_b) * similarities
    pairs = corresponding_nodes(a.below, b.below, shares)
    root_similarity = float(similarities[0, 0])
    total = sum(value for _, _, value in pairs)
    found = ((0, 0, root_similarity), *((u, v, float(similarities[u, v])) for u, v, _ in pairs))
    return GraphMatch(min(1.0, root * root_similarity + (1 - root) * total), found)


def match_upper_bound(
    a: ShockGraph, b: ShockGraph, similarities: NDArray[np.float32], root: float
) -> float:
    """An upper bound of `match_nodes`: the best matching, ignoring hierarchy.

    Args:
        a: The first graph, N nodes.
        b: The second graph, M nodes.
        similarities: (N, M), similarity of each pair of nodes.
        root: Share of the root in the similarity.
    """
    values = (0.5 * (a.weights[:, None] + b.weights[None]) * similarities)[1:, 1:]
    rows, columns = linear_sum_assignment(values, maximize=True)
    return float(root * similarities[0, 0] + (1 - root) * values[rows, columns].sum())


def corresponding_nodes(
    below_a: NDArray[np.bool_], below_b: NDArray[np.bool_], value: NDArray[np.floating]
) -> list[tuple[int, int, float]]:
    """Corresponding nodes by recursive bipartite matching; roots (node 0) are left out.

    The best pair of a best matching is accepted; every pair that contradicts it, with one node below its
    node and the other not, is from then on worth `HIERARCHY_PENALTY` of its value; and so on with the rest.
    The matching is solved again only when one of its pairs lost value: the rest of a best matching whose
    pairs keep their value is a best matching of the rest.

    Args:
        below_a: (N, N) bool, row u marks u and its descendants.
        below_b: (M, M) bool, the same for the second graph.
        value: (N, M), value of each pair, 0 or more.

    Returns:
        Pairs of nodes with their final values, in the order found.
    """
    values = np.array(value, dtype=np.float64)[1:, 1:]
    rows, columns = linear_sum_assignment(values, maximize=True)
    pairs: list[tuple[int, int, float]] = []
    while len(rows):
        pair_values = values[rows, columns]
        best = int(np.argmax(pair_values))
        u, v = int(rows[best]) + 1, int(columns[best]) + 1
        if pair_values[best] <= 0.0:
            break
        pairs.append((u, v, float(pair_values[best])))
        contradicts = below_a[u, 1:, None] != below_b[v, None, 1:]
        contradicts |= below_a[1:, u, None] != below_b[None, 1:, v]
        values[contradicts] *= HIERARCHY_PENALTY
        values[u - 1, :] = values[:, v - 1] = 0.0
        others = np.arange(len(rows)) != best
        rows, columns = rows[others], columns[others]
        if contradicts[rows, columns].any():
            rows, columns = linear_sum_assignment(values, maximize=True)
    return pairs
