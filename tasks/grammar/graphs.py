"""Graph algorithms on names: reachability, topological order, cycles.

Most graphs of stages are acyclic, for which `graphlib` suffices; networkx, which takes 0.2 s to import, is
used only for the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import networkx

Graph = Mapping[str, tuple[str, ...]]
"""Name -> its successors, all of which are keys."""


def reachable(graph: Graph, starts: Iterable[str]) -> frozenset[str]:
    """All nodes reachable from some nodes, including these."""
    seen: set[str] = set()
    todo = list(starts)
    while todo:
        node = todo.pop()
        if node not in seen:
            seen.add(node)
            todo += graph[node]
    return frozenset(seen)


def dependencies_first(graph: Graph) -> list[str]:
    """All nodes in reverse topological order, apart from cycles."""
    try:
        return list(TopologicalSorter(graph).static_order())
    except CycleError:
        import networkx as nx

        return list(nx.dfs_postorder_nodes(_directed(graph)))


def cycles(graph: Graph) -> list[list[str]]:
    """The strongly connected components that contain a cycle."""
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
