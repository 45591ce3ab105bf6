"""Pictures of shapes: outlines with their labelled shock graphs, for people.

Colours follow the kinds of shock: protrusions orange, necks red, bends green, seeds blue.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.database import ModelDatabase
from visup.percepts.shape.shock_graph import ShockGraph, shock_graph
from visup.percepts.shape.shocks import Kind, label_branch
from visup.percepts.shape.silhouette import Silhouette
from visup.percepts.shape.skeleton import skeletonise

TILE = 96
"""Side of one view on a contact sheet, pixels."""

COLOURS = {
    Kind.PROTRUSION: (40, 140, 240),
    Kind.NECK: (60, 60, 230),
    Kind.BEND: (90, 190, 60),
    Kind.SEED: (230, 150, 40),
}
"""Colour of each kind of shock, BGR."""

_VIEWS_SHOWN = 12
_LABEL = 150


def draw_shape(
    contour: NDArray[np.floating], graph: ShockGraph | None = None, tile: int = TILE
) -> NDArray[np.uint8]:
    """A silhouette in normal form, with the nodes of its shock graph.

    Args:
        contour: (N, 2) outline, unit area, y down.
        graph: Its shock graph; nodes are drawn as dots, edges as lines.
        tile: Side of the picture, pixels.

    Returns:
        (tile, tile, 3) uint8, BGR.
    """
    canvas = np.full((tile, tile, 3), 255, dtype=np.uint8)
    low, high = contour.min(axis=0), contour.max(axis=0)
    zoom = (tile - 8) / max(float((high - low).max()), 1e-6)

    def place(points: NDArray[np.floating]) -> NDArray[np.int32]:
        moved = (points - 0.5 * (low + high)) * zoom + tile / 2
        return np.asarray(np.round(moved * 16), dtype=np.int32)

    cv2.fillPoly(canvas, [place(contour)], (215, 215, 215), lineType=cv2.LINE_AA, shift=4)
    if graph is not None:
        _draw_graph(canvas, graph, place(graph.positions))
    return canvas


def _draw_graph(canvas: NDArray[np.uint8], graph: ShockGraph, at: NDArray[np.int32]) -> None:
    for parent, child in graph.edges:
        if parent > 0:
            a, b = at[parent].tolist(), at[child].tolist()
            cv2.line(canvas, a, b, (120, 120, 120), 1, cv2.LINE_AA, shift=4)
    for node in range(1, len(graph)):
        colour = COLOURS[Kind(int(graph.kinds[node]))]
        cv2.circle(canvas, at[node].tolist(), 40, colour, -1, cv2.LINE_AA, shift=4)


def contact_sheet(database: ModelDatabase, names: Sequence[str] | None = None) -> NDArray[np.uint8]:
    """A row for each model: its name, how many views it has, and up to twelve of them.

    Args:
        database: The models.
        names: Models to show; all when None.

    Returns:
        (H, W, 3) uint8, BGR.
    """
    rows = [_row(database, n) for n in (database.names() if names is None else names)]
    empty = np.full((TILE, _LABEL + _VIEWS_SHOWN * TILE, 3), 255, dtype=np.uint8)
    return np.vstack(rows) if rows else empty


def _row(database: ModelDatabase, name: str) -> NDArray[np.uint8]:
    own = [k for k, v in enumerate(database.views) if v.name == name]
    label = np.full((TILE, _LABEL, 3), 255, dtype=np.uint8)
    for line, text in enumerate((name[:20], f"{len(own)} views")):
        where = (6, 44 + 18 * line)
        cv2.putText(label, text, where, cv2.FONT_HERSHEY_SIMPLEX, 0.42, (0, 0, 0), 1, cv2.LINE_AA)
    spread = [own[i * len(own) // _VIEWS_SHOWN] for i in range(_VIEWS_SHOWN)]
    shown = list(dict.fromkeys(spread))
    tiles = [draw_shape(database.shapes[k].contour, database.shapes[k].graph) for k in shown]
    blank = np.full((TILE, TILE, 3), 255, dtype=np.uint8)
    return np.hstack([label, *tiles, *[blank] * (_VIEWS_SHOWN - len(tiles))])


def ascii_shocks(silhouette: Silhouette, columns: int = 40) -> str:
    """A silhouette as text: ':' inside, and each skeleton point's kind of shock by number.

    Args:
        silhouette: In normal form.
        columns: Width of the text; a character is taken to be twice as high as wide.

    Returns:
        Lines without trailing blanks.

    Example:
        A rectangle is a bend (3) with a protrusion (1) to each corner; two overlapping discs are two
        seeds (4) with a neck (2) between them.

        >>> from visup.percepts.shape.silhouette import normalise
        >>> y, x = np.mgrid[-40:41, -60:61]
        >>> print(ascii_shocks(normalise((abs(x) < 50) & (abs(y) < 17)), 30))
        ::::::::::::::::::::::::::::::
        :::1::::::::::::::::::::::1:::
        :::133333333333333333333331:::
        ::::::::::::::::::::::::::1:::
        ::::::::::::::::::::::::::::::
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


def _labelled_points(silhouette: Silhouette) -> list[tuple[NDArray[np.float64], Kind]]:
    """Points along the skeleton with their kinds; necks and seeds last, so that they show on top."""
    skeleton = skeletonise(silhouette.contour)
    found: list[tuple[NDArray[np.float64], Kind]] = []
    for branch in skeleton.branches:
        points = skeleton.points[branch]
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        for shock in label_branch(skeleton.radii[branch], along):
            at = np.linspace(along[shock.start], along[shock.stop], 200)
            dense = np.stack([np.interp(at, along, points[:, k]) for k in (0, 1)], axis=1)
            found += [(p, shock.kind) for p in dense]
    graph = shock_graph(silhouette)
    spots = [n for n in range(1, len(graph)) if graph.kinds[n] in (Kind.NECK, Kind.SEED)]
    return found + [(graph.positions[n].astype(float), Kind(int(graph.kinds[n]))) for n in spots]
