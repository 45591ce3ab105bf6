"""Graphs of names: what is reached, in which order to look at them, which lie on circles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

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
    """All nodes, each after those that it leads to, as far as there are no circles."""
    done: dict[str, None] = {}
    entered: set[str] = set()
    for start in graph:
        stack: list[tuple[str, Iterator[str]]] = []
        if start not in entered:
            entered.add(start)
            stack.append((start, iter(graph[start])))
        while stack:
            node, rest = stack[-1]
            following = next((n for n in rest if n not in entered), None)
            if following is None:
                done[node] = None
                stack.pop()
            else:
                entered.add(following)
                stack.append((following, iter(graph[following])))
    return list(done)


def cycles(graph: Graph) -> list[list[str]]:
    """The strongly connected parts of a graph that hold a circle (by Kosaraju)."""
    back: dict[str, list[str]] = {n: [] for n in graph}
    for node, following in graph.items():
        for other in following:
            back[other].append(node)
    found: list[list[str]] = []
    told: set[str] = set()
    for start in reversed(dependencies_first(graph)):
        part, todo = [], [start]
        while todo:
            node = todo.pop()
            if node not in told:
                told.add(node)
                part.append(node)
                todo += back[node]
        if len(part) > 1 or (part and part[0] in graph[part[0]]):
            found.append(part)
    return found
