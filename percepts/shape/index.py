"""The index: which views of the database are worth a full comparison.

All nodes of all views lie in one matrix of node features, the topological signatures among them
(Shokoufandeh et al. 2005). One product with a query's nodes gives each view a bound: every node takes
its best partner, whoever else wants it and whatever hangs below. The matching of `match.py` can only do
worse, so views are compared best bound first, and the search ends when no bound left can change the
result. What is pruned so is not lost, unless the caller sets a budget.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.match import WEIGHTS, MatchWeights, embed, node_similarities
from visup.percepts.shape.shock_graph import ShockGraph


class ViewIndex:
    """Node features of many views, kept together.

    Args:
        graphs: The views' shock graphs.
        weights: How much each node feature counts.
    """

    def __init__(self, graphs: Sequence[ShockGraph], weights: MatchWeights = WEIGHTS) -> None:
        self.weights = weights
        sizes = np.array([len(g) for g in graphs], dtype=np.intp)
        self._starts = np.concatenate([[0], np.cumsum(sizes)]).astype(np.intp)
        self._features = (
            np.vstack([embed(g, weights) for g in graphs])
            if graphs
            else np.empty((0, 0), np.float32)
        )
        self._shares = (
            np.concatenate([g.weights for g in graphs]) if graphs else np.empty(0, np.float32)
        )

    def __len__(self) -> int:
        return len(self._starts) - 1

    def compare(
        self, query: ShockGraph, among: NDArray[np.intp] | None = None
    ) -> tuple[NDArray[np.float64], list[NDArray[np.float32]]]:
        """Bound the similarity of a query with views.

        Args:
            query: A shock graph of N nodes.
            among: Numbers of the views to look at, rising; all when None.

        Returns:
            (V,) float64, for each view a number that its similarity cannot exceed; and for each view
            the (N, M) similarities of the query's nodes with the view's.
        """
        views = np.arange(len(self)) if among is None else among
        if not len(views):
            return np.empty(0), []
        rows, starts = self._rows(views)
        features = self._features if among is None else self._features[rows]
        shares = self._shares if among is None else self._shares[rows]
        similar = node_similarities(embed(query, self.weights), features)
        inner = similar.copy()
        inner[0] = 0.0
        inner[:, starts] = 0.0
        forth = query.weights @ np.maximum.reduceat(inner, starts, axis=1)
        back = np.add.reduceat(inner.max(axis=0) * shares, starts)
        root = self.weights.root
        bounds = root * similar[0, starts] + (1 - root) * 0.5 * (forth + back)
        return bounds.astype(np.float64), np.split(similar, starts[1:], axis=1)

    def _rows(self, views: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Numbers of the views' nodes, and where each view starts among them."""
        sizes = self._starts[views + 1] - self._starts[views]
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.intp)
        rows = np.repeat(self._starts[views] - starts, sizes) + np.arange(sizes.sum())
        return rows, starts
