"""Layout of a task's flow chart: rows of boxes from beginning to end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from visup.tasks.tools.diagram import BEGIN, END, Flow

WIDTH = 440.0
WIDEST = 250.0
NARROWEST = 120.0
GAP = 14.0
ROW_GAP = 26.0
LINE = 15.0
PAD = 8.0
DOT = 14.0
"""Size of the dots for beginning and end."""

MARGIN = 46.0
"""On both sides, for arrows that pass boxes."""

Edge = tuple[str, str]


@dataclass(frozen=True, slots=True)
class FlowBox:
    """Position of a box.

    Attributes:
        node: Number of the node in the flow, or its beginning or end.
        x: Left side.
        y: Top.
        width: Its width.
        height: Its height.
    """

    node: str
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class FlowLayout:
    """The layout of the flow chart.

    Attributes:
        boxes: Node -> box.
        back: Back edges.
        rank: Node -> number of its row.
        width: Total width.
        height: Total height.
    """

    boxes: Mapping[str, FlowBox]
    back: frozenset[Edge]
    rank: Mapping[str, int]
    width: float
    height: float


def layout_of(flow: Flow) -> FlowLayout:
    """Lay out a flow: each box is below its predecessors, except for back edges."""
    nodes = [BEGIN, *flow.nodes, END]
    back = _back_edges(nodes, flow.edges)
    rank = _ranks(nodes, [e for e in flow.edges if e not in back])
    last = 1 + max((rank[n] for n in flow.nodes), default=0)
    rank[END] = max(last, rank[END])
    rows = [[n for n in nodes if rank[n] == r] for r in sorted(set(rank.values()))]
    most = max(len(row) for row in rows)
    width = max(WIDTH, 2 * MARGIN + most * (NARROWEST + GAP) - GAP)
    boxes: dict[str, FlowBox] = {}
    y = PAD
    for row in rows:
        tall = max(_height(flow, n) for n in row)
        boxes |= {b.node: b for b in _row(flow, row, y, width)}
        y += tall + ROW_GAP
    return FlowLayout(boxes, back, rank, width, y - ROW_GAP + PAD)


def _row(flow: Flow, row: list[str], y: float, width: float) -> Iterable[FlowBox]:
    room = (width - 2 * MARGIN + GAP) / len(row)
    each = min(WIDEST, room - GAP)
    left = width / 2 - (each * len(row) + GAP * (len(row) - 1)) / 2
    for k, node in enumerate(row):
        wide = each if node in flow.nodes else DOT
        x = left + k * (each + GAP) + (each - wide) / 2
        yield FlowBox(node, x, y, wide, _height(flow, node))


def _height(flow: Flow, node: str) -> float:
    if node not in flow.nodes:
        return DOT
    return 2 * PAD + LINE * len(flow.nodes[node].lines) + 6


def _back_edges(nodes: list[str], edges: Iterable[Edge]) -> frozenset[Edge]:
    """Back edges: arrows to a box on the current path of a depth-first search."""
    after: dict[str, list[str]] = {n: [] for n in nodes}
    for a, b in edges:
        after[a].append(b)
    done: set[str] = set()
    back: set[Edge] = set()
    for first in nodes:
        way: list[tuple[str, list[str]]] = [] if first in done else [(first, list(after[first]))]
        while way:
            here, left = way[-1]
            if not left:
                done.add(here)
                way.pop()
                continue
            there = left.pop(0)
            if there in (n for n, _ in way):
                back.add((here, there))
            elif there not in done:
                way.append((there, list(after[there])))
    return frozenset(back)


def _ranks(nodes: list[str], edges: list[Edge]) -> dict[str, int]:
    """The length of the longest path to each box."""
    rank = dict.fromkeys(nodes, 0)
    for _ in nodes:
        changed = False
        for a, b in edges:
            if rank[b] <= rank[a]:
                rank[b], changed = rank[a] + 1, True
        if not changed:
            break
    return rank
