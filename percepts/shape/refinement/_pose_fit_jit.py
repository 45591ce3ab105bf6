"""Compiled loops of `pose_fit.py`: rendering a mesh with a depth buffer, and scoring the fit.

The rendering is moved and scaled to the centroid and area of the observed region, so that only the
orientation is searched. Within both outlines, grey values are regressed on the normals of the rendered
surface, through the nine spherical harmonics of second order, which cover any distant light on a matt surface
(Basri and Jacobs, Lambertian Reflectance and Linear Subspaces, 2003).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

HARMONICS = 8
"""Without the constant, which the mean removes."""

_RIDGE = 2e-3
_FEWEST = 30


@compiled
def _project(
    vertices: NDArray[np.float32],
    turn: NDArray[np.float64],
    distance: float,
    place: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Project vertices (V, 3) into the square, (V, 3): x, y, depth; `place` is x, y and scale."""
    for i in range(len(vertices)):
        p = vertices[i]
        x = turn[0, 0] * p[0] + turn[0, 1] * p[1] + turn[0, 2] * p[2]
        y = turn[1, 0] * p[0] + turn[1, 1] * p[1] + turn[1, 2] * p[2]
        z = turn[2, 0] * p[0] + turn[2, 1] * p[1] + turn[2, 2] * p[2]
        nearer = place[2] * distance / (distance + z)
        out[i, 0] = place[0] + x * nearer
        out[i, 1] = place[1] + y * nearer
        out[i, 2] = z


@compiled
def _draw(
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    depth: NDArray[np.float64],
    number: NDArray[np.int32],
) -> None:
    """The nearest face in each pixel of the square, or -1."""
    side = len(depth)
    depth[:] = np.inf
    number[:] = -1
    for k in range(len(faces)):
        i, j, m = faces[k, 0], faces[k, 1], faces[k, 2]
        ax, ay, bx, by = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
        cx, cy = points[m, 0], points[m, 1]
        double = (by - cy) * (ax - cx) + (cx - bx) * (ay - cy)
        if abs(double) < 1e-9:
            continue
        x0 = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        x1 = min(side - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        y0 = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        y1 = min(side - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        # Barycentric coordinates of corners a and b change linearly from pixel to pixel.
        a_right, a_down = (by - cy) / double, (cx - bx) / double
        b_right, b_down = (cy - ay) / double, (ax - cx) / double
        za, zb, zc = points[i, 2], points[j, 2], points[m, 2]
        for y in range(y0, y1 + 1):
            of_a = a_right * (x0 + 0.5 - cx) + a_down * (y + 0.5 - cy)
            of_b = b_right * (x0 + 0.5 - cx) + b_down * (y + 0.5 - cy)
            for x in range(x0, x1 + 1):
                if of_a >= -1e-6 and of_b >= -1e-6 and of_a + of_b <= 1.0 + 1e-6:
                    z = zc + of_a * (za - zc) + of_b * (zb - zc)
                    if z < depth[y, x]:
                        depth[y, x] = z
                        number[y, x] = k
                of_a += a_right
                of_b += b_right


@compiled
def _moments(cover: NDArray[np.float64]) -> tuple[float, float, float]:
    """Area and centroid of the covered part, pixels of the square."""
    area, across, down = 0.0, 0.0, 0.0
    for y in range(cover.shape[0]):
        for x in range(cover.shape[1]):
            area += cover[y, x]
            across += cover[y, x] * (x + 0.5)
            down += cover[y, x] * (y + 0.5)
    return area, across / max(area, 1e-9), down / max(area, 1e-9)


@compiled
def _drawn_moments(number: NDArray[np.int32]) -> tuple[float, float, float]:
    area, across, down = 0.0, 0.0, 0.0
    for y in range(number.shape[0]):
        for x in range(number.shape[1]):
            if number[y, x] >= 0:
                area += 1.0
                across += x + 0.5
                down += y + 0.5
    return area, across / max(area, 1e-9), down / max(area, 1e-9)


@compiled
def _explained(total: float, products: NDArray[np.float64], along: NDArray[np.float64]) -> float:
    """Share of the variance that a ridge regression explains."""
    for i in range(HARMONICS):
        for j in range(i):
            products[j, i] = products[i, j]
    weights = np.linalg.solve(products, along)
    return float((weights * along).sum() / total)


@compiled
def _shading(
    turn: NDArray[np.float64],
    normals: NDArray[np.float64],
    number: NDArray[np.int32],
    cover: NDArray[np.float64],
    tone: NDArray[np.float64],
) -> float:
    """Share of the grey values' variance that the rendered normals explain, 0 to 1."""
    products = np.zeros((HARMONICS, HARMONICS))
    along, sums, h = np.zeros(HARMONICS), np.zeros(HARMONICS), np.empty(HARMONICS)
    count, grey, squares = 0.0, 0.0, 0.0
    for row in range(number.shape[0]):
        for column in range(number.shape[1]):
            k = number[row, column]
            if k < 0 or cover[row, column] < 0.99:
                continue
            n = normals[k]
            x = turn[0, 0] * n[0] + turn[0, 1] * n[1] + turn[0, 2] * n[2]
            y = turn[1, 0] * n[0] + turn[1, 1] * n[1] + turn[1, 2] * n[2]
            z = turn[2, 0] * n[0] + turn[2, 1] * n[1] + turn[2, 2] * n[2]
            if z > 0.0:
                x, y, z = -x, -y, -z
            h[0], h[1], h[2], h[3], h[4], h[5] = x, y, z, x * y, x * z, y * z
            h[6], h[7] = x * x - y * y, 3.0 * z * z - 1.0
            value = tone[row, column]
            count += 1.0
            grey += value
            squares += value * value
            for i in range(HARMONICS):
                sums[i] += h[i]
                along[i] += h[i] * value
                for j in range(i + 1):
                    products[i, j] += h[i] * h[j]
    total = squares - grey * grey / max(count, 1.0)
    if count < _FEWEST or total < count:  # tones within one grey level: nothing to explain
        return 0.0
    for i in range(HARMONICS):
        along[i] -= sums[i] * grey / count
        for j in range(i + 1):
            products[i, j] -= sums[i] * sums[j] / count
        products[i, i] += _RIDGE * count
    return _explained(total, products, along)


@compiled
def _overlap(cover: NDArray[np.float64], number: NDArray[np.int32]) -> float:
    """Intersection over union of the covered and the rendered part."""
    both, either = 0.0, 0.0
    for row in range(cover.shape[0]):
        for column in range(cover.shape[1]):
            drawn = 1.0 if number[row, column] >= 0 else 0.0
            both += min(drawn, cover[row, column])
            either += max(drawn, cover[row, column])
    return both / max(either, 1e-9)


@compiled
def start_place(cover: NDArray[np.float64]) -> NDArray[np.float64]:
    """Initial placement of a rendering: x, y and the radius in pixels."""
    area, x, y = _moments(cover)
    return np.array([x, y, area**0.5])


@compiled
def fit_of(
    mesh: tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float64]],
    seen: tuple[NDArray[np.float64], NDArray[np.float64]],
    turn: NDArray[np.float64],
    distance: float,
    place: NDArray[np.float64],
    scratch: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]],
) -> tuple[float, float]:
    """The fit of a rendered mesh: overlap of the outlines (IoU), and share of the tone explained.

    `place` (x, y and radius in pixels) is updated so that centroid and area approach the observed ones.
    """
    vertices, faces, normals = mesh
    cover, tone = seen
    points, depth, number = scratch
    _project(vertices, turn, distance, place, points)
    _draw(points, faces, depth, number)
    area, x, y = _moments(cover)
    drawn, left, top = _drawn_moments(number)
    if drawn < 4.0:
        return 0.0, 0.0
    grown = (area / drawn) ** 0.5
    place[0] = x - (left - place[0]) * grown
    place[1] = y - (top - place[1]) * grown
    place[2] *= grown
    _project(vertices, turn, distance, place, points)
    _draw(points, faces, depth, number)
    return _overlap(cover, number), _shading(turn, normals, number, cover, tone)


@compiled
def surface_depth(
    mesh: tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float64]],
    seen: tuple[NDArray[np.float64], NDArray[np.float64]],
    turn: NDArray[np.float64],
    distance: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Depth of the rendered surface behind the mesh's centre in each pixel, and its placement.

    Args:
        mesh: Vertices (V, 3), faces (F, 3), normals (F, 3).
        seen: `cover` and `tone` of a `RegionImage`.
        turn: (3, 3) orientation, model to camera.
        distance: From the viewer to the mesh's centre, in units of its radius.

    Returns:
        (side, side) depths in units of the radius, infinite where nothing is drawn; and x, y and radius of
        the mesh, pixels of the square.
    """
    side = len(seen[0])
    scratch = (
        np.empty((len(mesh[0]), 3)),
        np.empty((side, side)),
        np.empty((side, side), np.int32),
    )
    place = start_place(seen[0])
    fit_of(mesh, seen, turn, distance, place, scratch)
    fit_of(mesh, seen, turn, distance, place, scratch)
    return scratch[1], place


@compiled
def _about(axis: int, angle: float) -> NDArray[np.float64]:
    """Rotation about a camera axis."""
    turn = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[j, i] = np.sin(angle)
    turn[i, j] = -turn[j, i]
    return turn


@compiled
def climb(
    mesh: tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float64]],
    seen: tuple[NDArray[np.float64], NDArray[np.float64]],
    start: NDArray[np.float64],
    distance: float,
    steps: NDArray[np.float64],
    shading: float,
) -> tuple[NDArray[np.float64], float, float, float]:
    """Hill climbing to an orientation that no rotation by the last step improves.

    Args:
        mesh: Vertices (V, 3), faces (F, 3), normals (F, 3).
        seen: `cover` and `tone` of a `RegionImage`.
        start: (3, 3) orientation, model to camera.
        distance: From the viewer to the mesh's centre, in units of its radius.
        steps: Rotations to try, radians, largest first; each for up to three rounds.
        shading: Weight of the explained tone relative to the overlap.

    Returns:
        Orientation (3, 3), its overlap, the share of tone explained, and the mesh's radius at its
        centre, pixels of the square.
    """
    side = len(seen[0])
    scratch = (
        np.empty((len(mesh[0]), 3)),
        np.empty((side, side)),
        np.empty((side, side), np.int32),
    )
    turn, place = start.copy(), start_place(seen[0])
    fit_of(mesh, seen, turn, distance, place, scratch)
    overlap, explained = fit_of(mesh, seen, turn, distance, place, scratch)
    for step in steps:
        for _ in range(3):
            moved = False
            for axis in range(3):
                for sign in (1.0, -1.0):
                    other, there = _about(axis, sign * step) @ turn, place.copy()
                    o, e = fit_of(mesh, seen, other, distance, there, scratch)
                    if o + shading * e > overlap + shading * explained + 1e-6:
                        turn, place, overlap, explained, moved = other, there, o, e, True
                        break
            if not moved:
                break
    return turn, overlap, explained, place[2]
