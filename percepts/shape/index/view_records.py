"""Records of a database: views, shapes, and their exact byte layout.

A shape is three arrays of raw little-endian bytes: the nodes of its shock graph (one record each), the edges,
and the outline. The file states the layout once, as text (`LAYOUT`), and data that does not fit it is refused
before anything is allocated.

Read next: `file_format.py` in `database/`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.index.outline_sketch import HEIGHTS, POINTS
from visup.percepts.shape.matching.shape_similarity import Shape
from visup.percepts.shape.shocks.shock_graph import MAX_NODES, PROFILE, ShockGraph, frozen_graph
from visup.percepts.shape.shocks.skeletal_context import CONTEXT
from visup.percepts.shape.shocks.topological_signature import LENGTH
from visup.percepts.shape.silhouette.area_overlap import ANGLES, RINGS
from visup.percepts.shape.silhouette.silhouette import SMOOTHING

MAX_POINTS = 640
"""Most points of a stored outline."""

Records = NDArray[Any]
"""An array of records, such as of `NODE` or `VIEW`."""

Direction = tuple[float, float, float]
"""Unit vector from the object to the viewer, in the model's frame."""

# Half precision where it far exceeds a silhouette's accuracy: 0.0005 for an outline of unit area.
NODE = np.dtype(
    [
        ("kinds", "|i1"),
        ("weights", "<f4"),
        ("lengths", "<f4"),
        ("profiles", "<f2", (PROFILE,)),
        ("contexts", "<f2", (CONTEXT,)),
        ("positions", "<f4", (2,)),
        ("directions", "<f2", (2,)),
        ("signatures", "<f4", (LENGTH,)),
    ]
)
"""A node of a shock graph: the arrays of `ShockGraph` that have a row for each node."""

EDGE = np.dtype(("<i2", (2,)))
POINT = np.dtype(("<f2", (2,)))

VIEW = np.dtype(
    [
        ("model", "<u4"),
        ("number", "<u4"),
        ("direction", "<f8", (3,)),
        ("area", "<f8"),
        ("smoothing", "<f4"),
        ("cut", "|u1"),
        ("border", "<f4"),
        ("areas", "|u1", (RINGS, ANGLES)),
        ("root", NODE),
        ("sketch", "|i1", (POINTS, HEIGHTS)),
    ]
)
"""A view without its shape; NaN for unknown values."""

ALSO = np.dtype([("view", "<u4"), ("direction", "<f8", (3,))])
"""A further direction that shows a view's silhouette."""

LAYOUT = {
    name: str(np.dtype(dtype).descr if np.dtype(dtype).names else np.dtype(dtype))
    for name, dtype in (
        ("view", VIEW),
        ("also", ALSO),
        ("node", NODE),
        ("edge", EDGE),
        ("point", POINT),
    )
}
"""The meaning of all bytes, as text; a file with a different layout is refused."""

_POSITIVE = ("weights", "lengths", "profiles", "contexts")


@dataclass(frozen=True, slots=True)
class ModelView:
    """One silhouette of a model.

    Attributes:
        id: Number within the database, from 1.
        name: Name of the model.
        number: Number of the view within the model, from 0.
        direction: Unit vector from the object to the viewer in the model's frame (roll: the model's +z
            is up in the image, +y when looking along z), or None when unknown.
        area: Area of the silhouette in model units squared, or None when unknown.
        cut: Whether the image's border cuts the silhouette.
        also: Further directions from which the model shows this silhouette, rotated in the plane:
            symmetric views are stored once.
        smoothing: Standard deviation of the Gaussian that smoothed it, in square roots of its area.
    """

    id: int
    name: str
    number: int
    direction: Direction | None
    area: float | None
    cut: bool
    also: tuple[Direction, ...] = ()
    smoothing: float = SMOOTHING

    @property
    def seen_from(self) -> tuple[Direction, ...]:
        """All directions from which the model shows this silhouette; none when unknown."""
        return () if self.direction is None else (self.direction, *self.also)


@dataclass(frozen=True, slots=True, eq=False)
class NewView:
    """A view to store; fields as in `ModelView`, with its shape.

    Attributes:
        name: Name of the model.
        direction: Unit vector from the object to the viewer, or None.
        area: Model units squared, or None.
        shape: Its shape.
        also: Further directions that show the same silhouette.
        smoothing: Smoothing of the silhouette, in square roots of its area.
    """

    name: str
    direction: Direction | None
    area: float | None
    shape: Shape
    also: tuple[Direction, ...] = ()
    smoothing: float = SMOOTHING


@dataclass(frozen=True, slots=True)
class ShapeBytes:
    """A shape in its stored form."""

    nodes: bytes
    edges: bytes
    contour: bytes


class InvalidRecordError(Exception):
    """Bytes that are not a valid record; the message says what was found."""


def node_records(graph: ShockGraph) -> Records:
    """The nodes of a graph as records, (N,) of `NODE`."""
    out = np.zeros(len(graph), dtype=NODE)
    for field in NODE.names or ():
        out[field] = getattr(graph, field)
    return out


def encode(shape: Shape) -> ShapeBytes:
    """A shape as bytes."""
    return ShapeBytes(
        node_records(shape.graph).tobytes(),
        np.ascontiguousarray(shape.graph.edges, dtype=EDGE.base).tobytes(),
        np.ascontiguousarray(shape.contour, dtype=POINT.base).tobytes(),
    )


def decode(stored: ShapeBytes, view: np.void) -> Shape:
    """Decode and validate a shape.

    Args:
        stored: The bytes.
        view: The record of its view, of `VIEW`.

    Raises:
        InvalidRecordError: The bytes are not a valid shape of this view.
    """
    nodes = records(stored.nodes, NODE, 2, MAX_NODES + 1, "nodes")
    if nodes[0].tobytes() != view["root"].tobytes():
        raise InvalidRecordError("the root of another")
    edges = records(stored.edges, EDGE, 1, 2 * (MAX_NODES + 1), "edges")
    contour = records(stored.contour, POINT, 8, MAX_POINTS, "points of the outline")
    check_nodes(nodes)
    # Parents precede children, so the graph has no cycle.
    if not bool(((edges[:, 0] >= 0) & (edges[:, 0] < edges[:, 1])).all()) or edges.max() >= len(
        nodes
    ):
        raise InvalidRecordError("edges of a graph that is none")
    outline = contour.astype(np.float32)
    if not (np.abs(outline) < 1e3).all() or not np.ptp(outline, axis=0).min() > 0:
        raise InvalidRecordError("an outline that is none")
    graph = frozen_graph(edges=edges, **graph_arrays(nodes))
    border = None if np.isnan(view["border"]) else float(view["border"])
    return Shape(outline, graph, view["areas"], bool(view["cut"]), border)


def records(data: object, dtype: np.dtype[Any], least: int, most: int, what: str) -> Records:
    """Bytes as records, validating their number.

    Raises:
        InvalidRecordError: They are not bytes, not whole records, too few or too many.
    """
    if not isinstance(data, bytes) or len(data) % dtype.itemsize:
        raise InvalidRecordError(f"{what} of a length that cannot be")
    count = len(data) // dtype.itemsize
    if not least <= count <= most:
        raise InvalidRecordError(f"{count} {what}")
    return np.frombuffer(data, dtype=dtype)


def check_nodes(nodes: Records) -> None:
    """Reject nodes with impossible values.

    Raises:
        InvalidRecordError: A value is impossible.
    """
    kinds = nodes["kinds"]
    if not bool(((kinds >= 0) & (kinds <= 4)).all()):
        raise InvalidRecordError("a node of no known kind")
    for field in NODE.names or ():
        values = nodes[field]
        # A comparison with NaN is false.
        if values.dtype.kind == "f" and not bool((np.abs(values) < 1e4).all()):
            raise InvalidRecordError(f"{field} that cannot be")
        if field in _POSITIVE and not bool((values >= 0).all()):
            raise InvalidRecordError(f"negative {field}")


def graph_arrays(nodes: Records) -> dict[str, NDArray[Any]]:
    """The arrays of a graph from its nodes' records: by field, floats in single precision."""
    return {
        field: np.ascontiguousarray(
            nodes[field], dtype=np.float32 if nodes[field].dtype.kind == "f" else None
        )
        for field in NODE.names or ()
    }
