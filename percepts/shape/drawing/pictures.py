"""Images that explain why a silhouette matches a view.

Colours follow the kinds of shock: protrusions orange, necks red, bends green, seeds blue.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.database.model_database import ModelDatabase, Ranking, ViewMatch
from visup.percepts.shape.drawing.sheet import (
    BODY,
    COLOURS,
    INK,
    OUTLINE,
    PALE,
    RULE,
    Colour,
    Point,
    Sheet,
    legend,
)
from visup.percepts.shape.matching.shape_similarity import Shape, shape_of
from visup.percepts.shape.shocks.shock_graph import ShockGraph, shock_graph
from visup.percepts.shape.shocks.shock_labels import ShockKind, label_branch
from visup.percepts.shape.shocks.skeleton import skeletonise
from visup.percepts.shape.silhouette.silhouette import Silhouette

_HEAD = 44
_ROW = 172
_MARGIN = 18

Place = Callable[[NDArray[np.floating]], list[Point]]


def placement(
    contour: NDArray[np.floating],
    centre: Point,
    side: float,
    turn: NDArray[np.float64] | None = None,
) -> Place:
    """The mapping of a shape's points into a square of this side, rotated or mirrored."""
    matrix = np.eye(2) if turn is None else turn
    turned = contour @ matrix.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    zoom = side / max(float((high - low).max()), 1e-6)

    def place(points: NDArray[np.floating]) -> list[Point]:
        moved = (points @ matrix.T - 0.5 * (low + high)) * zoom + np.array(centre)
        return [(float(x), float(y)) for x, y in moved]

    return place


def draw_shape(sheet: Sheet, contour: NDArray[np.floating], place: Place) -> None:
    """Draw a shape's body with its outline, positioned by `place`."""
    sheet.polygon(place(contour), BODY, OUTLINE)


def draw_graph(sheet: Sheet, graph: ShockGraph, place: Place, radius: float = 3.0) -> None:
    """Draw the nodes of a shock graph in their colours, and its edges."""
    at = place(graph.positions)
    for parent, child in graph.edges:
        if parent > 0:
            sheet.line([at[parent], at[child]], PALE, 1.0)
    # Small parts first, so that the most important lie on top.
    for node in sorted(range(1, len(graph)), key=lambda n: float(graph.weights[n])):
        size = radius * (0.7 + 1.2 * float(graph.weights[node]) ** 0.5)
        sheet.dot(at[node], size, _colour(graph, node))


def _colour(graph: ShockGraph, node: int) -> Colour:
    return COLOURS.get(ShockKind(int(graph.kinds[node])), INK)


@dataclass(frozen=True, slots=True)
class _Panel:
    """A shape and its position on the sheet."""

    shape: Shape
    place: Place


def match_picture(
    database: ModelDatabase, silhouette: Silhouette, ranking: Ranking, title: str, best: int = 5
) -> NDArray[np.uint8]:
    """Explain a ranking: the silhouette's labelled shock graph, and the best views beside it.

    Args:
        database: The searched database.
        silhouette: The query.
        ranking: Its result.
        title: Title above the image.
        best: Number of views to show.

    Returns:
        (H, W, 3) uint8, BGR: to the left the silhouette with its skeleton and numbered nodes; to the
        right a row for each view, rotated like the silhouette, with lines between corresponding
        nodes.
    """
    shown = ranking.matches[:best]
    height = _HEAD + max(3, len(shown)) * _ROW
    sheet = Sheet(1120, height)
    sheet.fitted((_MARGIN, 28), title, 480, 16)
    legend(sheet, (700, 28), 104)
    sheet.line([(0, _HEAD), (1120, _HEAD)], RULE)
    query = shape_of(silhouette)
    _draw_query(sheet, silhouette, query, height)
    for row, match in enumerate(shown):
        _draw_match(sheet, database, query, match, row)
    if not shown:
        sheet.text((520, _HEAD + 60), "It looks like no view above the threshold.", 15, PALE)
    return sheet.picture()


def _draw_query(sheet: Sheet, silhouette: Silhouette, query: Shape, height: int) -> None:
    """The silhouette, its skeleton by kind of shock, and its nodes with their numbers."""
    place = placement(query.contour, (250, _HEAD + 0.5 * min(height - _HEAD, 500)), 420)
    draw_shape(sheet, query.contour, place)
    for point, kind in _labelled_points(silhouette)[::4]:
        (x, y) = place(point[None])[0]
        sheet.box((x - 1.2, y - 1.2), (x + 1.2, y + 1.2), COLOURS[kind])
    _draw_numbers(sheet, query.graph, place)
    counts = [
        f"{count} {kind.name.lower()}" + ("s" if count > 1 else "")
        for kind in COLOURS
        if (count := int((query.graph.kinds == kind).sum()))
    ]
    lines = [
        "Shock graph: " + ", ".join(counts),
        "The greater a node, the more of the skeleton it has.",
    ]
    if query.cut:
        lines.append("Cut by the border of the picture.")
    for k, line in enumerate(lines):
        sheet.text((_MARGIN, _HEAD + 490 + 18 * k), line, 13, PALE)
    if height - _HEAD > 640:
        _draw_levels(sheet, query.graph, (_MARGIN, _HEAD + 550), (470, height - 24))


def _draw_numbers(sheet: Sheet, graph: ShockGraph, place: Place) -> None:
    at = place(graph.positions)
    for parent, child in graph.edges:
        if parent > 0:
            sheet.line([at[parent], at[child]], PALE, 1.2)
    for node in sorted(range(1, len(graph)), key=lambda n: float(graph.weights[n])):
        sheet.dot(at[node], 7.0 + 6.0 * float(graph.weights[node]) ** 0.5, _colour(graph, node))
        sheet.text(at[node], str(node), 11, (255, 255, 255), "mm")


def _draw_levels(sheet: Sheet, graph: ShockGraph, corner: Point, other: Point) -> None:
    """The graph as a tree of levels, each node below all its parents."""
    import networkx as nx

    tree = graph.to_networkx()
    levels = list(nx.topological_generations(tree))
    across = np.full(len(graph), 0.5)
    at: dict[int, Point] = {}
    for level, nodes in enumerate(levels):
        parents = {n: across[sorted(tree.predecessors(n))] for n in nodes}
        order = sorted(nodes, key=lambda n: (float(parents[n].mean()) if n else 0.5, n))
        for k, node in enumerate(order):
            across[node] = (k + 0.5) / len(order)
            down = level / max(1, len(levels) - 1)
            x = corner[0] + across[node] * (other[0] - corner[0])
            at[node] = (x, corner[1] + down * (other[1] - corner[1]))
    for parent, child in graph.edges.tolist():
        sheet.line([at[parent], at[child]], RULE if parent == 0 else PALE, 1.0)
    size = 9.0 if len(graph) < 30 else 6.0
    sheet.text(at[0], "root", 12, PALE, "mm")
    for node in range(1, len(graph)):
        sheet.dot(at[node], size, _colour(graph, node))
        sheet.text(at[node], str(node), 11 if size > 8 else 8, (255, 255, 255), "mm")


def _draw_match(
    sheet: Sheet, database: ModelDatabase, query: Shape, match: ViewMatch, row: int
) -> None:
    """Draw one view: its similarity and the corresponding parts."""
    top = _HEAD + row * _ROW
    middle = top + _ROW / 2
    sheet.line([(500, top), (1120, top)], RULE)
    own = _Panel(query, placement(query.contour, (600, middle), 140))
    shape = database.shapes[match.view.id - 1]
    other = _Panel(shape, placement(shape.contour, (830, middle), 140, _turn(match)))
    for panel in (own, other):
        draw_shape(sheet, panel.shape.contour, panel.place)
    _draw_pairs(sheet, own, other, match)
    x = 928
    sheet.fitted((x, top + 42), f"{row + 1}. {match.view.name}", 180, 15)
    sheet.box((x, top + 52), (x + 170, top + 60), RULE, 4)
    sheet.box((x, top + 52), (x + max(8.0, 170 * match.similarity), top + 60), (38, 108, 214), 4)
    for k, line in enumerate(_caption(match)):
        sheet.text((x, top + 80 + 17 * k), line, 12, INK if k == 0 else PALE)


def _caption(match: ViewMatch) -> list[str]:
    turn = f"turned by {math.degrees(match.rotation):.0f}°"
    terms = match.terms
    of_graph, of_outline, of_area = (
        f"{value:.2f}"
        for value in (terms.graph_similarity, terms.outline_similarity, terms.area_similarity)
    )
    return [
        f"similarity {match.similarity:.3f}",
        f"view {match.view.number}, {turn}" + (", mirrored" if terms.mirrored else ""),
        f"graph {of_graph}, outline {of_outline}, area {of_area}",
        f"{len(terms.match.pairs) - 1} corresponding nodes",
    ]


def _turn(match: ViewMatch) -> NDArray[np.float64]:
    """The transform from the view to the silhouette: mirrored if it is, then rotated."""
    angle = match.rotation
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return turn @ np.diag([-1.0, 1.0]) if match.terms.mirrored else turn


def _draw_pairs(sheet: Sheet, own: _Panel, other: _Panel, match: ViewMatch) -> None:
    """Lines between corresponding nodes, stronger for more similar pairs; other nodes pale."""
    own_points = own.place(own.shape.graph.positions)
    other_points = other.place(other.shape.graph.positions)
    for panel, at in ((own, own_points), (other, other_points)):
        for node in range(1, len(panel.shape.graph)):
            sheet.dot(at[node], 2.5, (190, 196, 205))
    for u, v, similar in sorted(match.terms.match.pairs, key=lambda p: p[2]):
        if u == 0:
            continue
        colour = _colour(own.shape.graph, u)
        sheet.line([own_points[u], other_points[v]], _faded(colour, similar), 0.6 + 1.6 * similar)
    for u, v, _ in match.terms.match.pairs:
        if u == 0:
            continue
        weight = float(own.shape.graph.weights[u]) ** 0.5
        sheet.dot(own_points[u], 3.0 + 3.5 * weight, _colour(own.shape.graph, u))
        sheet.dot(other_points[v], 3.0 + 3.5 * weight, _colour(other.shape.graph, v))


def _faded(colour: Colour, strength: float) -> Colour:
    """A colour blended towards white as strength falls."""
    share = 0.3 + 0.6 * min(1.0, max(0.0, strength))
    red, green, blue = (round(255 + (c - 255) * share) for c in colour)
    return (red, green, blue)


def ascii_shocks(silhouette: Silhouette, columns: int = 40) -> str:
    """A silhouette as text: ':' inside, and the number of each skeleton point's kind of shock.

    Args:
        silhouette: In normal form.
        columns: Width of the text; characters are assumed twice as high as wide.

    Returns:
        Lines without trailing blanks.

    Example:
        A rectangle is a bend (3) with a protrusion (1) to each corner; two overlapping discs are two
        seeds (4) with a neck (2) between them.

        >>> from visup.percepts.shape.silhouette.silhouette import normalise
        >>> y, x = np.mgrid[-40:41, -60:61]
        >>> print(ascii_shocks(normalise((abs(x) < 50) & (abs(y) < 28)), 30))
        ::::::::::::::::::::::::::::::
        ::::::::::::::::::::::::::::::
        ::::11::::::::::::::::::11::::
        ::::::11:::::::::::::1111:::::
        ::::::113333333333333311::::::
        ::::111::::::::::::::::111::::
        ::::1::::::::::::::::::::1::::
        ::::::::::::::::::::::::::::::
        <BLANKLINE>
        >>> print(ascii_shocks(normalise(np.hypot(abs(x) - 20, y) < 25), 30))
            ::::::::      ::::::::
          ::::::::::::::::::::::::::
         ::::::::::::::::::::::::::::
        ::::::::::::::::::::::::::::::
        ::::::::41111112111114::::::::
        ::::::::::::::::::::::::::::::
         ::::::::::::::::::::::::::::
           ::::::::::    ::::::::::
        <BLANKLINE>
    """
    contour = silhouette.contour
    low, extent = contour.min(axis=0), np.ptp(contour, axis=0)
    cell = float(extent[0]) / columns
    lines = int(np.ceil(extent[1] / cell / 2))
    ys, xs = np.mgrid[0:lines, 0:columns]
    spots = np.stack([xs + 0.5, 2 * ys + 1.0], axis=-1).reshape(-1, 2) * cell + low
    outline = contour.astype(np.float32).reshape(-1, 1, 2)
    text = np.array(
        [":" if cv2.pointPolygonTest(outline, p, False) > 0 else " " for p in spots.tolist()]
    ).reshape(lines, columns)
    for point, kind in _labelled_points(silhouette):
        column = min(columns - 1, int((point[0] - low[0]) / cell))
        text[min(lines - 1, int((point[1] - low[1]) / cell / 2)), column] = str(int(kind))
    return "\n".join("".join(line).rstrip() for line in text)


def _labelled_points(silhouette: Silhouette) -> list[tuple[NDArray[np.float64], ShockKind]]:
    """Points along the skeleton with their kinds; necks and seeds last, to be drawn on top."""
    skeleton = skeletonise(silhouette.contour)
    found: list[tuple[NDArray[np.float64], ShockKind]] = []
    for branch in skeleton.branches:
        points = skeleton.points[branch]
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        for shock in label_branch(skeleton.radii[branch], along):
            at = np.linspace(along[shock.start], along[shock.stop], 200)
            dense = np.stack([np.interp(at, along, points[:, k]) for k in (0, 1)], axis=1)
            found += [(p, shock.kind) for p in dense]
    graph = shock_graph(silhouette)
    spots = [n for n in range(1, len(graph)) if graph.kinds[n] in (ShockKind.NECK, ShockKind.SEED)]
    return found + [
        (graph.positions[n].astype(float), ShockKind(int(graph.kinds[n]))) for n in spots
    ]
