"""Layout of a task's flow chart: rows of boxes from beginning to end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from visup.tasks.tools.diagram import BEGIN, END, Flow

MIN_CHART_WIDTH = 440.0
MAX_BOX_WIDTH = 250.0
MIN_BOX_WIDTH = 120.0
COLUMN_GAP = 14.0
ROW_GAP = 26.0
LINE_HEIGHT = 15.0
PADDING = 8.0
DOT_SIZE = 14.0
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
        back_edges: Back edges.
        rank: Node -> number of its row.
        width: Total width.
        height: Total height.
    """

    boxes: Mapping[str, FlowBox]
    back_edges: frozenset[Edge]
    rank: Mapping[str, int]
    width: float
    height: float


def layout_of(flow: Flow) -> FlowLayout:
    """Lay out a flow: each box is below its predecessors, except for back edges."""
    nodes = [BEGIN, *flow.nodes, END]
    back_edges = _back_edges(nodes, flow.edges)
    rank = _ranks(nodes, [e for e in flow.edges if e not in back_edges])
    last = 1 + max((rank[n] for n in flow.nodes), default=0)
    rank[END] = max(last, rank[END])
    rows = [[n for n in nodes if rank[n] == r] for r in sorted(set(rank.values()))]
    most_columns = max(len(row) for row in rows)
    width = max(
        MIN_CHART_WIDTH, 2 * MARGIN + most_columns * (MIN_BOX_WIDTH + COLUMN_GAP) - COLUMN_GAP
    )
    boxes: dict[str, FlowBox] = {}
    y = PADDING
    for row in rows:
        height = max(_height(flow, n) for n in row)
        boxes |= {b.node: b for b in _row(flow, row, y, width)}
        y += height + ROW_GAP
    return FlowLayout(boxes, back_edges, rank, width, y - ROW_GAP + PADDING)


def _row(flow: Flow, row: list[str], y: float, width: float) -> Iterable[FlowBox]:
    slot_width = (width - 2 * MARGIN + COLUMN_GAP) / len(row)
    box_width = min(MAX_BOX_WIDTH, slot_width - COLUMN_GAP)
    left = width / 2 - (box_width * len(row) + COLUMN_GAP * (len(row) - 1)) / 2
    for k, node in enumerate(row):
        node_width = box_width if node in flow.nodes else DOT_SIZE
        x = left + k * (box_width + COLUMN_GAP) + (box_width - node_width) / 2
        yield FlowBox(node, x, y, node_width, _height(flow, node))


def _height(flow: Flow, node: str) -> float:
    if node not in flow.nodes:
        return DOT_SIZE
    return 2 * PADDING + LINE_HEIGHT * len(flow.nodes[node].lines) + 6


def _back_edges(nodes: list[str], edges: Iterable[Edge]) -> frozenset[Edge]:
    """Back edges: arrows to a box on the current path of a depth-first search."""
    successors: dict[str, list[str]] = {n: [] for n in nodes}
    for a, b in edges:
        successors[a].append(b)
    done: set[str] = set()
    back: set[Edge] = set()
    for start in nodes:
        path: list[tuple[str, list[str]]] = (
            [] if start in done else [(start, list(successors[start]))]
        )
        while path:
            node, remaining = path[-1]
            if not remaining:
                done.add(node)
                path.pop()
                continue
            successor = remaining.pop(0)
            if successor in (n for n, _ in path):
                back.add((node, successor))
            elif successor not in done:
                path.append((successor, list(successors[successor])))
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
