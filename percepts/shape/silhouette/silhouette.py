"""Silhouettes in normal form: one outline of unit area, smoothed, and a map of the area itself.

The normal form makes a rendered model and an image region comparable. Its unit of length is the square root
of the silhouette's area; its origin is the centroid; x points right and y down, as in the image. Gaussian
smoothing removes fine detail that a model shows and an image does not (paper, section 7.2).

Read next: `skeleton.py`.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.percepts.shape.silhouette.area_overlap import area_map
from visup.percepts.shape.silhouette.fragments import join_fragments

SMOOTHING = 0.015
"""Standard deviation of the Gaussian, as a share of the square root of the area."""

RESOLUTION = 80
"""Pixels of the working raster per unit of length."""

SPACING = 0.04
"""Distance between neighbouring points of the outline, units."""

MIN_AREA = 24
"""Fewest pixels of a mask with a meaningful shape."""

SIDES = ("right", "bottom", "left", "top")
"""Sides of an image."""

_BEARINGS = {"right": 0.0, "bottom": 0.5 * np.pi, "left": np.pi, "top": -0.5 * np.pi}
_MAX_PIXELS = 1 << 21
_MAX_EXTENT = 1400


@dataclass(frozen=True, slots=True, eq=False)
class Silhouette:
    """An outline in normal form.

    Attributes:
        contour: (N, 2) float64, closed outline without repeated end point, evenly spaced, clockwise
            as seen in the image (y down), in units of the square root of the area.
        origin: (x, y) of the centroid in the source image, pixels.
        unit: Pixels of the source image per unit of length; the square root of `area`.
        area: Area in the source image, holes filled, pixels squared.
        areas: (RINGS, ANGLES) uint8, the mask's own area by ring and angle, with its holes and islands;
            see `area_overlap.area_map`.
        cut: Whether the border of the source image cuts the silhouette.
        border: Bearing of the cutting border from the silhouette: 0 right, pi/2 below, pi
            left, -pi/2 above, radians; None when nothing is cut.
    """

    contour: NDArray[np.float64]
    origin: tuple[float, float]
    unit: float
    area: float
    areas: NDArray[np.uint8]
    cut: bool = False
    border: float | None = None


def normalise(
    mask: NDArray[np.bool_],
    *,
    cut: bool = False,
    sides: Collection[str] = SIDES,
    smoothing: float = SMOOTHING,
) -> Silhouette | None:
    """Bring a mask to normal form.

    Args:
        mask: (H, W) bool, the object.
        cut: Whether the image border cuts the object.
        sides: Sides of the mask's array that are the image border, of `SIDES`; the one that most of a
            cut object touches is taken as the border that cuts it. An object cut by two sides, in a
            corner, is therefore assumed to end at the other.
        smoothing: Standard deviation of the Gaussian in units of the square root of the area.

    Returns:
        The silhouette of the largest part with the islands near it (`fragments.py`), holes filled, or
        None when it has fewer than `MIN_AREA` pixels.

    Raises:
        SettingsError: The mask is not a binary image.

    Example:
        >>> disc = np.hypot(*np.mgrid[-30:31, -30:31]) <= 25
        >>> s = normalise(disc)
        >>> round(s.unit), np.round(np.hypot(*s.contour.T).mean(), 2) == round(np.pi ** -0.5, 2)
        (44, np.True_)
    """
    cropped = _crop(_as_bytes(mask))
    if cropped is None:
        return None
    part, corner, shrink = cropped
    solid, inset = _solid(part)
    area = float(np.count_nonzero(solid))
    if area < MIN_AREA:
        return None
    field, zoom, pad = _smooth_field(solid, area, smoothing)
    outline = _longest_outline(field)
    if outline is None:
        return None
    unscaled = (outline + 0.5) / zoom - 0.5 - pad + np.asarray(inset)
    placed = _in_units((unscaled + 0.5) / shrink - 0.5 + np.asarray(corner))
    if placed is None:
        return None
    contour, origin = placed
    area /= shrink**2
    border = _border(mask, sides) if cut else None
    areas = area_map(part > 0)
    return Silhouette(contour, origin, area**0.5, area, areas, cut, border)


def _border(mask: NDArray[np.generic], sides: Collection[str]) -> float | None:
    """Bearing of the side that most of a mask touches, radians; None when it touches none."""
    along = {"right": mask[:, -1], "bottom": mask[-1], "left": mask[:, 0], "top": mask[0]}
    touched = {side: int(np.count_nonzero(along[side])) for side in SIDES if side in sides}
    longest = max(touched, key=lambda side: touched[side], default=None)
    return _BEARINGS[longest] if longest is not None and touched[longest] > 0 else None


def _as_bytes(mask: NDArray[np.generic]) -> NDArray[np.uint8]:
    """A mask as bytes that are zero outside; nonzero integers are inside."""
    given = np.asarray(mask)
    if given.ndim != 2 or given.dtype.kind not in "biu":
        raise SettingsError(
            f"a mask of {given.ndim} dimensions and type {given.dtype} has no shape",
            expected="a mask (H, W) of bool",
        )
    if given.dtype.itemsize > 1:
        given = given != 0
    return np.ascontiguousarray(given).view(np.uint8)


def _crop(mask: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], tuple[int, int], float] | None:
    """The mask's bounding crop, its corner, and the factor by which it was reduced."""
    columns = np.asarray(mask.any(axis=0))
    rows = np.asarray(mask.any(axis=1))
    if not columns.any():
        return None
    x0, x1 = int(columns.argmax()), mask.shape[1] - int(columns[::-1].argmax())
    y0, y1 = int(rows.argmax()), mask.shape[0] - int(rows[::-1].argmax())
    part = (mask[y0:y1, x0:x1] != 0).astype(np.uint8)
    shrink = min(1.0, (_MAX_PIXELS / part.size) ** 0.5)
    if shrink < 1.0:
        size = (max(1, int(part.shape[1] * shrink)), max(1, int(part.shape[0] * shrink)))
        part = (cv2.resize(part * np.uint8(255), size, interpolation=cv2.INTER_AREA) > 127).astype(
            np.uint8
        )
    return part, (x0, y0), shrink


def _solid(part: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    """The joined parts, holes filled, and the corner."""
    joined = join_fragments(part)
    x, y, w, h = cv2.boundingRect(joined.astype(np.uint8))
    inside = joined[y : y + h, x : x + w]
    around = np.pad((~inside).astype(np.uint8), 1, constant_values=1)
    _, outside = cv2.connectedComponents(around, connectivity=4)
    return np.asarray(outside[1:-1, 1:-1] != outside[0, 0], dtype=np.uint8), (x, y)


def _smooth_field(
    solid: NDArray[np.uint8], area: float, smoothing: float
) -> tuple[NDArray[np.float32], float, int]:
    """The silhouette at working resolution, blurred: the outline is where the field is one half."""
    zoom = min(RESOLUTION / area**0.5, _MAX_EXTENT / max(solid.shape))
    sigma = smoothing * zoom * area**0.5
    margin = int(np.ceil(3 * sigma / zoom)) + 2
    padded = np.pad(solid, margin).astype(np.float32)
    size = (max(3, round(padded.shape[1] * zoom)), max(3, round(padded.shape[0] * zoom)))
    method = cv2.INTER_AREA if zoom < 1 else cv2.INTER_LINEAR
    field = cv2.resize(padded, size, interpolation=method)
    if sigma > 0.2:
        field = cv2.GaussianBlur(field, (0, 0), sigma)
    return np.asarray(field, dtype=np.float32), zoom, margin


def _longest_outline(field: NDArray[np.float32]) -> NDArray[np.float64] | None:
    """The sub-pixel outline of the largest part, (N, 2) as (x, y); None when the blur leaves nothing."""
    level = 0.5 if field.max() > 0.55 else 0.5 * float(field.max())
    solid = (field > level).astype(np.uint8)
    found, _ = cv2.findContours(solid, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not found:
        return None
    longest = np.asarray(max(found, key=len)[:, 0], dtype=np.intp)
    return _moved_to_level(field, longest, level) if len(longest) > 8 else None


def _moved_to_level(
    field: NDArray[np.float32], pixels: NDArray[np.intp], level: float
) -> NDArray[np.float64]:
    """Pixels moved along the gradient to a level of a smooth field: one step of Newton's method."""
    x, y = pixels.T
    across = 0.5 * (
        field[y, np.minimum(x + 1, field.shape[1] - 1)] - field[y, np.maximum(x - 1, 0)]
    )
    down = 0.5 * (field[np.minimum(y + 1, field.shape[0] - 1), x] - field[np.maximum(y - 1, 0), x])
    slope = np.maximum(across**2 + down**2, 1e-6)
    step = (level - field[y, x]) / slope
    # On a ridge the gradient vanishes, but the outline is within a pixel of the inner pixel.
    step *= np.minimum(1.0, 1.0 / np.maximum(np.abs(step) * np.sqrt(slope), 1e-6))
    moved = np.stack([x + step * across, y + step * down], axis=1)
    return np.asarray(moved, dtype=np.float64)


def _in_units(
    outline: NDArray[np.float64],
) -> tuple[NDArray[np.float64], tuple[float, float]] | None:
    """An outline in pixels scaled to unit area around its centroid, and the centroid.

    None for an outline that encloses almost nothing, such as a line one pixel wide.
    """
    outer, centroid = polygon_moments(outline)
    if outer < 0:
        outline, outer = outline[::-1], -outer
    if outer < 1.0:
        return None
    contour = resample_closed((outline - centroid) / outer**0.5)
    return contour, (float(centroid[0]), float(centroid[1]))


def polygon_moments(polygon: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Signed area and centroid of a closed polygon.

    Args:
        polygon: (N, 2) points (x, y).

    Returns:
        Area, positive when the polygon runs clockwise with y down, and the (x, y) of its centroid.
    """
    x, y = polygon.T
    u, v = np.roll(x, -1), np.roll(y, -1)
    cross = x * v - u * y
    area = float(cross.sum()) / 2
    if abs(area) < 1e-12:
        return area, np.asarray(polygon.mean(axis=0), dtype=np.float64)
    return area, np.array([((x + u) * cross).sum(), ((y + v) * cross).sum()]) / (6 * area)


def resample_closed(
    polygon: NDArray[np.float64], spacing: float = SPACING, *, count: int | None = None
) -> NDArray[np.float64]:
    """Points evenly spaced along a closed polygon.

    Args:
        polygon: (N, 2) points (x, y).
        spacing: Desired distance between neighbours; the number of points is limited to 48 to 640.
        count: Number of points, instead of a spacing.

    Returns:
        (M, 2) float64.
    """
    closed = np.vstack([polygon, polygon[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    points = count or int(np.clip(along[-1] / spacing, 48, 640))
    at = np.arange(points) * (along[-1] / points)
    return np.stack(
        [np.interp(at, along, closed[:, 0]), np.interp(at, along, closed[:, 1])], axis=1
    )


def looks_cut(mask: NDArray[np.bool_]) -> bool:
    """Whether an image's border seems to cut its silhouette.

    A tightly cropped image touches all four sides and does not count as cut; one that touches some sides
    along at least 3 pixels does.

    Args:
        mask: (H, W) bool, the whole image.
    """
    touches = [int(np.count_nonzero(side)) for side in (mask[0], mask[-1], mask[:, 0], mask[:, -1])]
    return any(t >= 3 for t in touches) and not all(t >= 1 for t in touches)


def binary_image(image: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """A silhouette image as a mask, whether object or background is brighter.

    Args:
        image: (H, W) uint8.

    Returns:
        (H, W) bool. The background is what most of the image's border shows; when the border is
        undecided, the brighter part is the object.
    """
    bright = image > 127
    border = np.concatenate([bright[0], bright[-1], bright[1:-1, 0], bright[1:-1, -1]])
    corners = bright[[0, 0, -1, -1], [0, -1, 0, -1]]
    share = float(border.mean()) if border.size else 0.0
    if 0.35 < share < 0.65:
        return np.asarray(~bright if corners.sum() >= 3 else bright)
    return np.asarray(~bright if share >= 0.65 else bright)
