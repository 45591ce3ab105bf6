"""Topological signature vectors: the structure of a graph, described by eigenvalues.

After Shokoufandeh, Macrini, Dickinson, Siddiqi and Zucker, Indexing Hierarchical Structures Using Graph
Spectra (2005): each child of a node represents the subgraph rooted at it, and contributes the sum of the
greatest eigenvalue magnitudes of that subgraph's antisymmetric {0, 1, -1} adjacency matrix, as many as the
child has children. The sums, greatest first, are the node's vector: its length is the breadth of the graph at
the node and its entries describe what is below.

Read next: `view_index.py`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LENGTH = 6
"""Entries of each vector; smaller ones are dropped."""


def adjacency(edges: NDArray[np.int16], size: int) -> NDArray[np.float64]:
    """The antisymmetric adjacency matrix of a graph: 1 from parent to child, -1 back.

    Args:
        edges: (M, 2) int16, (parent, child).
        size: Number of nodes.

    Returns:
        (size, size) float64.
    """
    matrix = np.zeros((size, size))
    matrix[edges[:, 0], edges[:, 1]] = 1.0
    matrix[edges[:, 1], edges[:, 0]] = -1.0
    return matrix


def descendants(edges: NDArray[np.int16], size: int) -> NDArray[np.bool_]:
    """Which nodes are below which.

    Args:
        edges: (M, 2) int16, (parent, child); no cycles.
        size: Number of nodes.

    Returns:
        (size, size) bool; row u marks u and its descendants.
    """
    below = np.eye(size, dtype=bool)
    below[edges[:, 0], edges[:, 1]] = True
    for _ in range(max(1, size).bit_length()):
        below = (below.astype(np.float32) @ below.astype(np.float32)) > 0
    return below


def signatures(edges: NDArray[np.int16], size: int, length: int = LENGTH) -> NDArray[np.float32]:
    """The topological signature vector of every node.

    Args:
        edges: (M, 2) int16, (parent, child); no cycles.
        size: Number of nodes, at least 1.
        length: Entries of each vector.

    Returns:
        (size, length) float32, entries descending, zero for leaves.

    Example:
        A root with two children, of which the first has one leaf. The first child's subgraph is a
        single edge, with eigenvalues i and -i, and it has one child: it counts 1. The second has no
        child: it counts 0.

        >>> signatures(np.array([[0, 1], [0, 2], [1, 3]], dtype=np.int16), 4, 2).tolist()
        [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    """
    matrix = adjacency(edges, size)
    below = descendants(edges, size)
    fanout = np.bincount(edges[:, 0], minlength=size) if len(edges) else np.zeros(size, dtype=int)
    sums = np.zeros(size)
    parents = np.flatnonzero(fanout)
    # The root's own sum enters no vector.
    for u in parents[1:]:
        if below[u].sum() == fanout[u] + 1:
            sums[u] = _star(int(fanout[u]))
            continue
        # A real antisymmetric matrix is normal: its singular values are its eigenvalues' magnitudes.
        part = matrix[np.ix_(below[u], below[u])]
        sums[u] = np.linalg.svd(part, compute_uv=False)[: fanout[u]].sum()
    out = np.zeros((size, length), dtype=np.float32)
    for u in parents:
        values = np.sort(sums[edges[edges[:, 0] == u, 1]])[::-1][:length]
        out[u, : len(values)] = values
    return out


def _star(leaves: int) -> float:
    """The sum for a node whose children are all leaves: its eigenvalues are +-i sqrt(leaves) and 0."""
    return float(min(leaves, 2) * leaves**0.5)
