"""The index: which views of the database are worth a full comparison.

All nodes of all views lie in one matrix of node features, the topological signatures among them
(Shokoufandeh et al. 2005). The roots alone, one vector for each view, leave the likeliest views; of
these, one product with all of a query's nodes gives a bound: every node takes its best partner,
whoever else wants it and whatever hangs below. The matching of `match.py` can only do worse, so that
views can be matched best bound first until no bound left can change the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.match import WEIGHTS, MatchWeights, embed, node_similarities
from visup.percepts.shape.shock_graph import ShockGraph

ROOTS = 400
"""Views whose nodes are looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Views worth a full comparison.

    Attributes:
        numbers: (C,) numbers of the views, rising.
        bounds: (C,) what the similarity of the graphs cannot exceed.
        similar: For each view the (N, M) similarities of the query's nodes with the view's.
    """

    numbers: NDArray[np.intp]
    bounds: NDArray[np.float64]
    similar: list[NDArray[np.float32]]


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
        empty = np.empty((0, 1), np.float32)
        self._features = np.vstack([embed(g, weights) for g in graphs]) if graphs else empty
        self._roots = np.ascontiguousarray(self._features[self._starts[:-1]])
        self._shares = np.concatenate([g.weights for g in graphs]) if graphs else empty[:, 0]

    def __len__(self) -> int:
        return len(self._starts) - 1

    def likeliest(self, query: ShockGraph, among: NDArray[np.intp], most: int) -> NDArray[np.intp]:
        """The views whose roots (their shapes as a whole) are nearest to the query's.

        Args:
            query: A shock graph.
            among: Numbers of views, rising.
            most: How many are wanted.

        Returns:
            At most so many of the numbers, rising.
        """
        if len(among) <= most:
            return among
        root = embed(query, self.weights)[:1]
        similar = node_similarities(root, self._roots[among])[0]
        nearest = np.argsort(-similar, kind="stable")[:most]
        return np.sort(among[nearest])

    def candidates(
        self,
        query: ShockGraph,
        among: NDArray[np.intp],
        most: int,
        favoured: NDArray[np.intp] | None = None,
    ) -> Candidates:
        """The views that are worth a full comparison.

        Args:
            query: A shock graph.
            among: Numbers of views, rising.
            most: How many are wanted.
            favoured: Numbers of views of which as many come along, whatever their bounds.
        """
        likely = self.likeliest(query, among, ROOTS)
        extra = among[:0] if favoured is None else self.likeliest(query, favoured, most)
        likely = np.union1d(likely, extra).astype(np.intp)
        bounds, similar = self.bounds(query, likely)
        chosen = np.zeros(len(likely), dtype=bool)
        chosen[np.argsort(-bounds, kind="stable")[:most]] = True
        kept = np.flatnonzero(chosen | np.isin(likely, extra))
        return Candidates(likely[kept], bounds[kept], [similar[k] for k in kept])

    def bounds(
        self, query: ShockGraph, among: NDArray[np.intp], *, part: bool = False
    ) -> tuple[NDArray[np.float64], list[NDArray[np.float32]]]:
        """Bound the similarity of a query with views.

        Args:
            query: A shock graph of N nodes.
            among: Numbers of the views to look at, rising.
            part: Whether the query is a part only, so that the views' other nodes do not count.

        Returns:
            (V,) float64, for each view a number that `match_nodes` cannot exceed; and for each view the
            (N, M) similarities of the query's nodes with the view's.
        """
        if not len(among):
            return np.empty(0), []
        rows, starts = self._rows(among)
        similar = node_similarities(embed(query, self.weights), self._features[rows])
        roots = similar[0, starts].astype(np.float64)
        inner = similar[1:].copy()
        inner[:, starts] = 0.0
        forth = query.weights[1:] @ np.maximum.reduceat(inner, starts, axis=1)
        back = np.add.reduceat(inner.max(axis=0) * self._shares[rows], starts)
        nodes = forth if part else 0.5 * (forth + back)
        bounds = self.weights.root * roots + (1 - self.weights.root) * nodes
        return bounds, np.split(similar, starts[1:], axis=1)

    def _rows(self, views: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Numbers of the views' nodes, and where each view starts among them."""
        sizes = self._starts[views + 1] - self._starts[views]
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.intp)
        rows = np.repeat(self._starts[views] - starts, sizes) + np.arange(sizes.sum())
        return rows, starts
