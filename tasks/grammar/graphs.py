"""Graphs of names: what is reached, in which order to look at them, which lie on cycles.

Most graphs of stages have no cycle, which `graphlib` tells at once; networkx, which takes a fifth of a
second to import, is asked about the others only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import networkx

Graph = Mapping[str, tuple[str, ...]]
"""Name -> the names that it leads to, all of them keys."""


def reachable(graph: Graph, starts: Iterable[str]) -> frozenset[str]:
    """All that can be come to from some nodes, themselves with them."""
    seen: set[str] = set()
    todo = list(starts)
    while todo:
        node = todo.pop()
        if node not in seen:
            seen.add(node)
            todo += graph[node]
    return frozenset(seen)


def dependencies_first(graph: Graph) -> list[str]:
    """All nodes, each after those that it leads to, as far as there are no cycles."""
    try:
        return list(TopologicalSorter(graph).static_order())
    except CycleError:
        import networkx as nx

        return list(nx.dfs_postorder_nodes(_directed(graph)))


def cycles(graph: Graph) -> list[list[str]]:
    """The strongly connected components of a graph that hold a cycle."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError:
        import networkx as nx

        components = nx.strongly_connected_components(_directed(graph))
        return [[*c] for c in components if len(c) > 1 or not c.isdisjoint(graph[next(iter(c))])]
    return []


def _directed(graph: Graph) -> networkx.DiGraph:
    import networkx as nx

    return nx.DiGraph(graph)
