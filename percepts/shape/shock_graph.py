"""Shock graphs: a silhouette as a rooted graph of parts, from the thickest to the thinnest.

After Siddiqi et al. (1999): every shock is a node; where two meet, the one of the greater radius (the
one that formed later as the fire burned inwards) is the parent. A symbolic root stands above the
shocks that have no parent. The grammar that follows: seeds hang only below the root; necks are leaves;
a bend or protrusion has at most two parents, one for each of its ends. Each node carries what it
looks like (radii along it, length, mass) and what the shape looks like from it (how much of the shape,
and how thick, lies how far away), so that nodes can be compared without looking at edges.

Read next: `signature.py`, then `match.py`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.shocks import Kind, Shock, label_branch
from visup.percepts.shape.signature import descendants
from visup.percepts.shape.signature import signatures as topological_signatures
from visup.percepts.shape.silhouette import Silhouette
from visup.percepts.shape.skeleton import Skeleton, skeletonise

PROFILE = 8
"""Radii sampled along each node."""

RINGS = 8
THICKNESSES = 4
CONTEXT = RINGS * THICKNESSES
"""Cells of a node's context: rings of distance times grades of thickness."""

MOST_NODES = 120
"""Nodes kept; a silhouette with more significant parts than this loses its smallest ones."""

_RING_EDGES = np.array([0.18, 0.32, 0.48, 0.66, 0.9, 1.2, 1.7])
_THICKNESS_EDGES = np.array([0.1, 0.18, 0.3])


@dataclass(frozen=True, slots=True, eq=False)
class ShockGraph:
    """A shape as a rooted directed acyclic graph; node 0 is the root, parents come before children.

    Lengths are in units of the square root of the silhouette's area, about its centroid, y down.

    Attributes:
        kinds: (N,) int8, `Kind` of each node.
        edges: (M, 2) int16, (parent, child), sorted.
        weights: (N,) float32, share of the silhouette's area that each node explains; they sum to 1,
            and the root's is 0.
        lengths: (N,) float32, length along the skeleton; 0 for necks, seeds and the root.
        profiles: (N, PROFILE) float32, radius from the node's thicker end to its thinner.
        contexts: (N, CONTEXT) float32, share of the silhouette in each cell of distance and thickness
            around the node; rows sum to 1.
        positions: (N, 2) float32, (x, y) of the node's middle.
        directions: (N, 2) float32, unit vector from the thicker end to the thinner; 0 for points.
        signatures: (N, signature.LENGTH) float32, topological signature vectors.
        below: (N, N) bool, row u marks u and its descendants.
        key: Digest of the content; orders graphs where an order must not depend on the caller.
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


@dataclass(frozen=True, slots=True)
class _Part:
    """A shock with its skeleton points, thicker end first."""

    kind: Kind
    points: NDArray[np.intp]


def shock_graph(silhouette: Silhouette) -> ShockGraph:
    """The shock graph of a silhouette.

    Args:
        silhouette: In normal form.

    Returns:
        A graph of at least two nodes, the root and one shock.

    Example:
        >>> from visup.percepts.shape.silhouette import normalise
        >>> y, x = np.mgrid[-40:41, -40:41]
        >>> disc = shock_graph(normalise(np.hypot(x, y) < 30))
        >>> [Kind(k).name for k in disc.kinds]
        ['ROOT', 'SEED']
        >>> ellipse = shock_graph(normalise(np.hypot(x, 2 * y) < 36))
        >>> [Kind(k).name for k in ellipse.kinds]
        ['ROOT', 'SEED', 'PROTRUSION', 'PROTRUSION']
        >>> ellipse.edges.tolist()
        [[0, 1], [1, 2], [1, 3]]
    """
    skeleton = skeletonise(silhouette.contour)
    parts, links = _parts_and_links(skeleton)
    return _assemble(silhouette, skeleton, parts, links)


def _parts_and_links(skeleton: Skeleton) -> tuple[list[_Part], list[tuple[int, int]]]:
    """Shocks of the whole skeleton and (parent, child) pairs between them, without the root."""
    if not skeleton.branches:
        return [_Part(Kind.SEED, np.zeros(1, dtype=np.intp))], []
    parts: list[_Part] = []
    meets: dict[int, list[int]] = {}
    for branch in skeleton.branches:
        for shock in label_branch(skeleton.radii[branch], _along(skeleton, branch)):
            _add_part(skeleton, branch, shock, parts, meets)
    links: list[tuple[int, int]] = []
    for point in sorted(meets):
        links.extend(_link(skeleton, point, meets[point], parts))
    return parts, links


def _along(skeleton: Skeleton, branch: NDArray[np.intp]) -> NDArray[np.float64]:
    steps = np.hypot(*np.diff(skeleton.points[branch], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _add_part(
    skeleton: Skeleton,
    branch: NDArray[np.intp],
    shock: Shock,
    parts: list[_Part],
    meets: dict[int, list[int]],
) -> None:
    points = branch[shock.start : shock.stop + 1]
    if skeleton.radii[points[0]] < skeleton.radii[points[-1]]:
        points = points[::-1]
    for end in {int(points[0]), int(points[-1])}:
        meets.setdefault(end, []).append(len(parts))
    parts.append(_Part(shock.kind, points))


def _link(
    skeleton: Skeleton, point: int, meeting: Sequence[int], parts: list[_Part]
) -> list[tuple[int, int]]:
    """Parent and children among the parts that meet at one skeleton point."""
    points = [p for p in meeting if len(parts[p].points) == 1]
    runs = [p for p in meeting if len(parts[p].points) > 1]
    if points:
        node = points[0]
        is_seed = parts[node].kind is Kind.SEED
        return [(node, r) if is_seed else (r, node) for r in runs]
    if all(parts[r].kind is Kind.PROTRUSION and parts[r].points[0] == point for r in runs):
        parts.append(_Part(Kind.SEED, np.array([point], dtype=np.intp)))
        return [(len(parts) - 1, r) for r in runs]
    if len(runs) < 2:
        return []
    thickness = [float(skeleton.radii[parts[r].points].mean()) for r in runs]
    parent = runs[int(np.argmax(thickness))]
    return [(parent, r) for r in runs if r != parent]


def _assemble(
    silhouette: Silhouette,
    skeleton: Skeleton,
    parts: list[_Part],
    links: list[tuple[int, int]],
) -> ShockGraph:
    """Number the nodes, measure them, and freeze the arrays."""
    pixels = _sample_area(silhouette)
    owner, thickness = _explain_area(pixels, skeleton, parts)
    order = _order(parts, links, np.bincount(owner, minlength=len(parts)))
    number = {p: n + 1 for n, p in enumerate(order)}
    pairs = [(number[a], number[b]) for a, b in links if a in number and b in number]
    size = len(order) + 1
    headless = set(range(1, size)) - {b for _, b in pairs}
    edges = np.array(sorted(pairs + [(0, n) for n in headless]), dtype=np.int16).reshape(-1, 2)
    chosen = [parts[p] for p in order]
    mass = np.bincount(owner, minlength=len(parts))[order].astype(np.float64)
    positions = np.vstack([np.zeros(2), *(_middle(skeleton, p) for p in chosen)])
    return frozen_graph(
        kinds=np.array([0, *(int(p.kind) for p in chosen)], dtype=np.int8),
        edges=edges,
        weights=np.concatenate([[0.0], mass / max(mass.sum(), 1.0)]).astype(np.float32),
        lengths=np.array([0.0, *(_length(skeleton, p) for p in chosen)], dtype=np.float32),
        profiles=np.vstack(
            [np.full(PROFILE, skeleton.radii.max()), *(_profile(skeleton, p) for p in chosen)]
        ).astype(np.float32),
        contexts=_contexts(pixels, thickness, positions),
        positions=positions.astype(np.float32),
        directions=np.vstack([np.zeros(2), *(_direction(skeleton, p) for p in chosen)]).astype(
            np.float32
        ),
    )


def frozen_graph(
    *,
    kinds: NDArray[np.int8],
    edges: NDArray[np.int16],
    weights: NDArray[np.float32],
    lengths: NDArray[np.float32],
    profiles: NDArray[np.float32],
    contexts: NDArray[np.float32],
    positions: NDArray[np.float32],
    directions: NDArray[np.float32],
    signatures: NDArray[np.float32] | None = None,
) -> ShockGraph:
    """A graph from its stored arrays; what follows from them is computed. See `ShockGraph`."""
    digest = hashlib.blake2b(digest_size=12)
    for array in (kinds, edges, weights, profiles, contexts, positions):
        digest.update(np.ascontiguousarray(array).tobytes())
    size = len(kinds)
    arrays = (kinds, edges, weights, lengths, profiles, contexts, positions, directions)
    vectors = topological_signatures(edges, size) if signatures is None else signatures
    return ShockGraph(*arrays, vectors, descendants(edges, size), digest.digest())


def _order(parts: list[_Part], links: list[tuple[int, int]], mass: NDArray[np.intp]) -> list[int]:
    """Part numbers, parents before children, heavier first; the lightest dropped when too many."""
    kept = set(np.argsort(-mass, kind="stable")[:MOST_NODES].tolist())
    waiting = {p: {a for a, b in links if b == p and a in kept} for p in kept}
    order: list[int] = []
    while waiting:
        free = [p for p, parents in waiting.items() if not parents]
        best = max(free, key=lambda p: (mass[p], -p))
        order.append(best)
        del waiting[best]
        for parents in waiting.values():
            parents.discard(best)
    return order


def _sample_area(silhouette: Silhouette) -> NDArray[np.float64]:
    """About a thousand points (K, 2) evenly spread over the silhouette's inside."""
    step = 1 / 32
    low = silhouette.contour.min(axis=0) - step
    grid = np.round((silhouette.contour - low) / step * 16).astype(np.int32)
    extent = np.ceil(np.ptp(silhouette.contour, axis=0) / step).astype(int) + 3
    canvas = np.zeros((extent[1], extent[0]), dtype=np.uint8)
    cv2.fillPoly(canvas, [grid], 1, lineType=cv2.LINE_8, shift=4)
    rows, columns = np.nonzero(canvas)
    return np.asarray(np.stack([columns, rows], axis=1) * step + low, dtype=np.float64)


def _explain_area(
    pixels: NDArray[np.float64], skeleton: Skeleton, parts: list[_Part]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Which part each point of the area belongs to, and how thick the shape is there.

    A point belongs to the skeleton point whose disc holds it deepest. What lies in a seed's disc
    belongs to the seed: a body is one part, however many limbs start from its middle.
    """
    spots = np.concatenate([p.points for p in parts])
    owners = np.repeat(np.arange(len(parts)), [len(p.points) for p in parts])
    centres, radii = skeleton.points[spots], skeleton.radii[spots]
    seeds = np.array([p.kind is Kind.SEED for p in parts])[owners]
    squares = (
        (pixels**2).sum(axis=1)[:, None] - 2 * pixels @ centres.T + (centres**2).sum(axis=1)[None]
    )
    power = squares - (radii**2)[None]
    if seeds.any():
        in_seed = power[:, seeds].min(axis=1) < 0
        power[np.ix_(in_seed, ~seeds)] = np.inf
    best = power.argmin(axis=1)
    return owners[best], radii[best]


def _contexts(
    pixels: NDArray[np.float64], thickness: NDArray[np.float64], positions: NDArray[np.float64]
) -> NDArray[np.float32]:
    """How much of the shape, and how thick, lies how far from each position."""
    grade = np.searchsorted(_THICKNESS_EDGES, thickness)
    squares = (
        (positions**2).sum(axis=1)[:, None] - 2 * positions @ pixels.T + (pixels**2).sum(axis=1)
    )
    ring = np.searchsorted(_RING_EDGES**2, squares)
    cell = ring * THICKNESSES + grade[None] + np.arange(len(positions))[:, None] * CONTEXT
    counts = np.bincount(cell.ravel(), minlength=len(positions) * CONTEXT)
    return (counts.reshape(len(positions), CONTEXT) / max(1, len(pixels))).astype(np.float32)


def _middle(skeleton: Skeleton, part: _Part) -> NDArray[np.float64]:
    along = _along(skeleton, part.points)
    points = skeleton.points[part.points]
    return np.array([np.interp(along[-1] / 2, along, points[:, k]) for k in (0, 1)])


def _length(skeleton: Skeleton, part: _Part) -> float:
    return float(_along(skeleton, part.points)[-1])


def _profile(skeleton: Skeleton, part: _Part) -> NDArray[np.float64]:
    along = _along(skeleton, part.points)
    at = np.linspace(0.0, along[-1], PROFILE)
    return np.asarray(np.interp(at, along, skeleton.radii[part.points]))


def _direction(skeleton: Skeleton, part: _Part) -> NDArray[np.float64]:
    way = skeleton.points[part.points[-1]] - skeleton.points[part.points[0]]
    length = float(np.hypot(*way))
    return way / length if length > 1e-9 else np.zeros(2)
