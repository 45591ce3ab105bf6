"""Shock graphs: a silhouette as a rooted graph of parts, from thick to thin.

After Siddiqi et al. (1999): every shock is a node; where two meet, the one of greater radius (which formed
later as the fire burned inwards) is the parent. A symbolic root is the parent of shocks without one. In the
resulting grammar seeds are children of the root only, necks are leaves, and a bend or protrusion has at most
two parents, one for each end. Each node carries its own shape (radii along it, length) and the shape as seen
from it, so that nodes can be compared without looking at edges.

Read next: `topological_signature.py`, then `graph_matching.py`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NotRequired, TypedDict, Unpack

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.shocks.shock_labels import ShockKind, label_branch
from visup.percepts.shape.shocks.skeletal_context import (
    SkeletonPlaces,
    SkeletonTree,
    directed_contexts,
    whole_context,
)
from visup.percepts.shape.shocks.skeleton import Skeleton, skeletonise
from visup.percepts.shape.shocks.topological_signature import descendants
from visup.percepts.shape.shocks.topological_signature import signatures as topological_signatures
from visup.percepts.shape.silhouette.silhouette import Silhouette

if TYPE_CHECKING:
    import networkx as nx

PROFILE = 8
"""Radii sampled along each node."""

MAX_NODES = 120
"""Most nodes; a silhouette with more significant parts loses its smallest ones."""

POINT_LENGTH = 0.05
"""Length added to every node, so that necks and seeds count too; units."""

OUTLOOK = 0.15
"""Length of skeleton on both sides of a node's middle that defines its direction; units."""

AREA_STEP = 1 / 25
"""Distance between the points at which the area is sampled, units."""


@dataclass(frozen=True, slots=True, eq=False)
class ShockGraph:
    """A shape as a rooted directed acyclic graph; node 0 is the root, parents come before children.

    Lengths are in units of the square root of the silhouette's area, about its centroid, y down.

    Attributes:
        kinds: (N,) int8, `ShockKind` of each node.
        edges: (M, 2) int16, (parent, child), sorted.
        weights: (N,) float32, share of the skeleton's length, each node extended by `POINT_LENGTH`; they
            sum to 1, and the root's is 0.
        lengths: (N,) float32, length along the skeleton; 0 for necks, seeds and the root.
        profiles: (N, PROFILE) float32, radius from the node's thicker end to its thinner end.
        contexts: (N, CONTEXT) float32, distribution of the shape's area by distance and direction from the
            node, see `skeletal_context.py`; rows but the root's sum to 1.
        positions: (N, 2) float32, (x, y) of the node's middle.
        directions: (N, 2) float32, unit vector along the node at its middle, away from the greater
            part of the shape; 0 for points.
        signatures: (N, topological_signature.LENGTH) float32, topological signature vectors.
        below: (N, N) bool, row u marks u and its descendants.
        key: Digest of the content; gives graphs a canonical order.
    """

    kinds: NDArray[np.int8]
    edges: NDArray[np.int16]
    weights: NDArray[np.float32]
    lengths: NDArray[np.float32]
    profiles: NDArray[np.float32]
    contexts: NDArray[np.float32]
    positions: NDArray[np.float32]
    directions: NDArray[np.float32]
    signatures: NDArray[np.float32]
    below: NDArray[np.bool_]
    key: bytes

    def __len__(self) -> int:
        return len(self.kinds)

    def to_networkx(self) -> nx.DiGraph[int]:
        """The graph for drawing, export (GraphML, DOT) and algorithms; edges lead from parent to child.

        Example:
            >>> from visup.percepts.shape.silhouette.silhouette import normalise
            >>> y, x = np.mgrid[-40:41, -40:41]
            >>> ellipse = shock_graph(normalise(np.hypot(x, 2 * y) < 36)).to_networkx()
            >>> list(ellipse.edges), ellipse.nodes[1]["kind"]
            ([(0, 1), (1, 2), (1, 3)], 'seed')
        """
        import networkx as nx

        graph: nx.DiGraph[int] = nx.DiGraph()
        for n in range(len(self)):
            graph.add_node(
                n,
                kind=ShockKind(int(self.kinds[n])).name.lower(),
                weight=float(self.weights[n]),
                length=float(self.lengths[n]),
                radius=float(self.profiles[n].mean()),
                x=float(self.positions[n, 0]),
                y=float(self.positions[n, 1]),
            )
        graph.add_edges_from(self.edges.tolist())
        return graph


@dataclass(frozen=True, slots=True)
class _PlacedShock:
    """A shock and its position: branch and offsets, thicker end first."""

    kind: ShockKind
    branch: int
    thick: float
    thin: float
    ends: tuple[int, int]
    """Skeleton points of both ends, the same for a neck or seed."""
    mean: float
    """Mean radius."""

    @property
    def length(self) -> float:
        return abs(self.thin - self.thick)


def shock_graph(silhouette: Silhouette) -> ShockGraph:
    """The shock graph of a silhouette.

    Args:
        silhouette: In normal form.

    Returns:
        A graph of at least two nodes, the root and one shock.

    Example:
        >>> from visup.percepts.shape.silhouette.silhouette import normalise
        >>> y, x = np.mgrid[-40:41, -40:41]
        >>> disc = shock_graph(normalise(np.hypot(x, y) < 30))
        >>> [ShockKind(k).name for k in disc.kinds]
        ['ROOT', 'SEED']
        >>> ellipse = shock_graph(normalise(np.hypot(x, 2 * y) < 36))
        >>> [ShockKind(k).name for k in ellipse.kinds]
        ['ROOT', 'SEED', 'PROTRUSION', 'PROTRUSION']
        >>> ellipse.edges.tolist()
        [[0, 1], [1, 2], [1, 3]]
    """
    skeleton = skeletonise(silhouette.contour)
    tree = SkeletonTree(skeleton)
    parts, links = _parts_and_links(skeleton, tree)
    return _assemble(silhouette, tree, *_ordered(parts, links))


def _parts_and_links(
    skeleton: Skeleton, tree: SkeletonTree
) -> tuple[list[_PlacedShock], list[tuple[int, int]]]:
    """Shocks of the whole skeleton and (parent, child) pairs, without the root."""
    if not skeleton.branches:
        return [_PlacedShock(ShockKind.SEED, 0, 0.0, 0.0, (0, 0), float(skeleton.radii[0]))], []
    parts: list[_PlacedShock] = []
    meets: dict[int, list[int]] = {}
    for number, branch in enumerate(skeleton.branches):
        for part in _parts_of_branch(skeleton, branch, number, tree.offsets(number)):
            for end in dict.fromkeys(part.ends):
                meets.setdefault(end, []).append(len(parts))
            parts.append(part)
    links: list[tuple[int, int]] = []
    for point in sorted(meets):
        links.extend(_link(point, meets[point], parts))
    return parts, links


def _parts_of_branch(
    skeleton: Skeleton, branch: NDArray[np.intp], number: int, along: NDArray[np.float64]
) -> list[_PlacedShock]:
    radii = skeleton.radii[branch]
    parts = []
    for shock in label_branch(radii, along):
        a, b = shock.start, shock.stop
        thick, thin = (a, b) if radii[a] >= radii[b] else (b, a)
        ends = (int(branch[thick]), int(branch[thin]))
        mean = float(radii[a : b + 1].mean())
        parts.append(
            _PlacedShock(shock.kind, number, float(along[thick]), float(along[thin]), ends, mean)
        )
    return parts


def _link(point: int, meeting: Sequence[int], parts: list[_PlacedShock]) -> list[tuple[int, int]]:
    """Parent and children among the parts that meet at one skeleton point."""
    spots = [p for p in meeting if parts[p].kind in (ShockKind.NECK, ShockKind.SEED)]
    runs = [p for p in meeting if p not in spots]
    if spots:
        node = spots[0]
        is_seed = parts[node].kind is ShockKind.SEED
        return [(node, r) if is_seed else (r, node) for r in runs]
    if all(parts[r].kind is ShockKind.PROTRUSION and parts[r].ends[0] == point for r in runs):
        first = parts[runs[0]]
        at, radius = first.thick, max(parts[r].mean for r in runs)
        parts.append(_PlacedShock(ShockKind.SEED, first.branch, at, at, (point, point), radius))
        return [(len(parts) - 1, r) for r in runs]
    if len(runs) < 2:
        return []
    parent = runs[int(np.argmax([parts[r].mean for r in runs]))]
    return [(parent, r) for r in runs if r != parent]


def _ordered(
    parts: list[_PlacedShock], links: list[tuple[int, int]]
) -> tuple[list[_PlacedShock], NDArray[np.int16]]:
    """Parts in the order of their node numbers, and all edges, including those from the root."""
    order = _order(parts, links)
    number = {p: n + 1 for n, p in enumerate(order)}
    pairs = [(number[a], number[b]) for a, b in links if a in number and b in number]
    without_parent = set(number.values()) - {b for _, b in pairs}
    edges = sorted(pairs + [(0, n) for n in without_parent])
    return [parts[p] for p in order], np.array(edges, dtype=np.int16).reshape(-1, 2)


def _order(parts: list[_PlacedShock], links: list[tuple[int, int]]) -> list[int]:
    """Part numbers in topological order, longer first; the shortest are dropped when too many."""
    lengths = np.array([p.length for p in parts])
    kept = set(np.argsort(-lengths, kind="stable")[:MAX_NODES].tolist())
    parents_left = {p: {a for a, b in links if b == p and a in kept} for p in kept}
    order: list[int] = []
    # networkx's lexicographical topological sort gives the same order; for the 8 to 40 nodes of a silhouette
    # it takes 0.6 to 2.5 ms, this 0.04 to 0.45 ms, of some 3 ms for the whole shape.
    while parents_left:
        ready = [p for p, parents in parents_left.items() if not parents]
        best = max(ready, key=lambda p: (lengths[p], -p))
        order.append(best)
        del parents_left[best]
        for parents in parents_left.values():
            parents.discard(best)
    return order


def _assemble(
    silhouette: Silhouette, tree: SkeletonTree, parts: list[_PlacedShock], edges: NDArray[np.int16]
) -> ShockGraph:
    """Measure the nodes and build the arrays."""
    branch = np.array([p.branch for p in parts])
    thick, thin = np.array([(p.thick, p.thin) for p in parts]).T
    middle = SkeletonPlaces(branch, 0.5 * (thick + thin))
    positions = tree.points_at(branch, middle.offset)
    area = _sample_area(silhouette)
    nearest_places, thickness = _nearest_skeleton_places(area, tree)
    path_lengths, towards_end = tree.paths(middle, nearest_places)
    directions = _directions(tree, middle, np.abs(thick - thin), towards_end.mean(axis=1))
    contexts = directed_contexts(area, thickness, path_lengths, positions, directions)
    at = thick[:, None] + (thin - thick)[:, None] * np.linspace(0.0, 1.0, PROFILE)
    lengths = np.concatenate([[0.0], np.abs(thick - thin)])
    counted = np.concatenate([[0.0], lengths[1:] + POINT_LENGTH])
    profiles = [np.full(PROFILE, tree.radii.max()), tree.radii_at(branch[:, None], at)]
    return frozen_graph(
        kinds=np.array([0, *(int(p.kind) for p in parts)], dtype=np.int8),
        edges=edges,
        weights=(counted / counted.sum()).astype(np.float32),
        lengths=lengths.astype(np.float32),
        profiles=np.vstack(profiles).astype(np.float32),
        contexts=np.vstack([whole_context(area), contexts]).astype(np.float32),
        positions=np.vstack([np.zeros(2), positions]).astype(np.float32),
        directions=np.vstack([np.zeros(2), directions]).astype(np.float32),
    )


def _directions(
    tree: SkeletonTree,
    middle: SkeletonPlaces,
    lengths: NDArray[np.float64],
    towards_end: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Unit vectors (N, 2) along the nodes, away from the greater part of the shape.

    Args:
        tree: The skeleton.
        middle: The middles of the nodes.
        lengths: (N,) lengths of the nodes.
        towards_end: (N,) share of the area towards the end of each node's branch.
    """
    reach = np.minimum(OUTLOOK, 0.5 * lengths)
    ahead = tree.points_at(middle.branch, middle.offset + reach)
    vector = ahead - tree.points_at(middle.branch, middle.offset - reach)
    vector *= np.where(towards_end > 0.5, -1.0, 1.0)[:, None]
    length = np.hypot(*vector.T)[:, None]
    return np.where(length > 1e-9, vector / np.maximum(length, 1e-9), 0.0)


class NodeArrays(TypedDict):
    """The arrays of `ShockGraph` with one row per node."""

    kinds: NDArray[np.int8]
    weights: NDArray[np.float32]
    lengths: NDArray[np.float32]
    profiles: NDArray[np.float32]
    contexts: NDArray[np.float32]
    positions: NDArray[np.float32]
    directions: NDArray[np.float32]
    signatures: NotRequired[NDArray[np.float32]]


def frozen_graph(edges: NDArray[np.int16], **nodes: Unpack[NodeArrays]) -> ShockGraph:
    """A graph from its stored arrays; derived arrays are computed. See `ShockGraph`."""
    digest = hashlib.blake2b(digest_size=12)
    parts = (nodes["weights"], nodes["profiles"], nodes["contexts"], nodes["positions"])
    for array in (nodes["kinds"], edges, *parts):
        digest.update(np.ascontiguousarray(array).tobytes())
    size = len(nodes["kinds"])
    if "signatures" not in nodes:
        nodes["signatures"] = topological_signatures(edges, size)
    return ShockGraph(edges=edges, below=descendants(edges, size), key=digest.digest(), **nodes)


def _sample_area(silhouette: Silhouette) -> NDArray[np.float64]:
    """Some hundred points (P, 2) evenly spread over the silhouette."""
    low = silhouette.contour.min(axis=0) - AREA_STEP
    grid = np.round((silhouette.contour - low) / AREA_STEP * 16).astype(np.int32)
    extent = np.ceil(np.ptp(silhouette.contour, axis=0) / AREA_STEP).astype(int) + 3
    canvas = np.zeros((extent[1], extent[0]), dtype=np.uint8)
    cv2.fillPoly(canvas, [grid], 1, lineType=cv2.LINE_8, shift=4)
    rows, columns = np.nonzero(canvas)
    return np.asarray(np.stack([columns, rows], axis=1) * AREA_STEP + low, dtype=np.float64)


def _nearest_skeleton_places(
    area: NDArray[np.float64], tree: SkeletonTree
) -> tuple[SkeletonPlaces, NDArray[np.float64]]:
    """For each point of the area, the skeleton point whose disc contains it deepest, and the radius."""
    power = -2 * area @ tree.points.T
    power += (tree.points**2).sum(axis=1) - tree.radii**2
    best = power.argmin(axis=1)
    return SkeletonPlaces(tree.places.branch[best], tree.places.offset[best]), tree.radii[best]
