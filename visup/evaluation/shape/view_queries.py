"""Queries for the recognition of views: silhouettes of meshes, rotated, scaled, damaged, cut.

Four conditions, named as in the data's README: `clean`; `noise`, the outline displaced along its normal
by 2 px (standard deviation) at a size of 200 px; `cut`, 15 % of the area beyond the image border; `both`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from visup.percepts.shape.building.mesh_views import render_views

CONDITIONS = ("clean", "noise", "cut", "both")
"""Names of the conditions."""

SIZES = (60.0, 300.0)
"""Range of the longer side of a query, pixels."""

NOISE = 0.01
"""Standard deviation of the outline's displacement, as a share of the longer side: 2 px at 200 px."""

NOISE_LENGTH = 0.015
"""Correlation length of the displacement, as a share of the longer side: 3 px at 200 px."""

CUT_SHARE = 0.15
"""Share of the area that lies beyond the border."""

_RENDER_PX = 400
_MARGIN = 6


@dataclass(frozen=True, slots=True, eq=False)
class Query:
    """A silhouette with known object and direction.

    Attributes:
        name: The object.
        direction: (3,) unit vector from the object to the viewer, mesh frame.
        masks: Condition -> (H, W) bool. For cut ones, one side of the array is the image border.
    """

    name: str
    direction: NDArray[np.float64]
    masks: dict[str, NDArray[np.bool_]]


def draw_queries(name: str, mesh: Any, count: int, seed: int) -> list[Query]:
    """Silhouettes from random directions over the whole sphere, with random roll and size.

    Args:
        name: The object.
        mesh: A ``trimesh.Trimesh``.
        count: Number of queries.
        seed: Random seed, combined with the name.

    Raises:
        ExtraMissingError: The mesh renderer is not installed.
    """
    rng = np.random.default_rng([seed, *name.encode()])
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    views = render_views(mesh, directions, _RENDER_PX)
    return [Query(name, v.direction, _conditions(v.mask, rng)) for v in views]


def _conditions(mask: NDArray[np.bool_], rng: np.random.Generator) -> dict[str, NDArray[np.bool_]]:
    size, roll = rng.uniform(*SIZES), rng.uniform(0.0, 2 * np.pi)
    side = int(rng.integers(4))
    clean = rotated_and_scaled(mask, roll, size)
    noisy = with_contour_noise(clean, NOISE * size, NOISE_LENGTH * size, rng)
    return {
        "clean": clean,
        "noise": noisy,
        "cut": cut_by_border(clean, CUT_SHARE, side),
        "both": cut_by_border(noisy, CUT_SHARE, side),
    }


def rotated_and_scaled(mask: NDArray[np.bool_], roll: float, size: float) -> NDArray[np.bool_]:
    """A silhouette rotated in the image plane and scaled to a size.

    Args:
        mask: (H, W) bool.
        roll: Radians from x towards y (clockwise in the image).
        size: Longer side of its box afterwards, pixels.

    Returns:
        (N, N) bool with a margin on all sides.
    """
    rows, columns = np.nonzero(mask)
    rotation = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])
    points = np.stack([columns, rows], axis=1) @ rotation.T
    low, high = points.min(axis=0), points.max(axis=0)
    scale = size / (float((high - low).max()) + 1.0)
    side = int(np.ceil(size)) + 2 * _MARGIN
    shift = side / 2 - scale * (low + high) / 2
    grey = mask.astype(np.float32)
    smooth = cv2.GaussianBlur(grey, (0, 0), 0.5 / scale) if scale < 1 else grey
    warp = np.hstack([scale * rotation, shift[:, None]])
    return np.asarray(cv2.warpAffine(smooth, warp, (side, side), flags=cv2.INTER_LINEAR) > 0.5)


def with_contour_noise(
    mask: NDArray[np.bool_], sigma: float, length: float, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """A silhouette with its outline randomly displaced along its normal.

    The signed distance to the outline is thresholded at a smooth random field: outlines may merge, parts
    thinner than the noise may break off or vanish, as in segmentation.

    Args:
        mask: (H, W) bool.
        sigma: Standard deviation of the displacement, pixels.
        length: Standard deviation of the Gaussian that smooths the field, pixels.
        rng: Source of the noise.

    Returns:
        Bool of the mask's size plus a margin; the mask itself if noise would leave nothing.
    """
    margin = int(np.ceil(4 * sigma)) + 2
    padded = np.pad(mask, margin)
    solid = padded.astype(np.uint8)
    inside = cv2.distanceTransform(solid, cv2.DIST_L2, 5) - 0.5
    outside = cv2.distanceTransform(1 - solid, cv2.DIST_L2, 5) - 0.5
    signed_distance = np.where(padded, inside, -outside)
    field = gaussian_filter(rng.normal(size=padded.shape), length, mode="wrap")
    noisy = signed_distance > field * (2 * np.sqrt(np.pi) * length * sigma)
    return np.asarray(noisy if noisy.any() else padded)


def cut_by_border(mask: NDArray[np.bool_], share: float, side: int) -> NDArray[np.bool_]:
    """A silhouette cut by the image border.

    Args:
        mask: (H, W) bool.
        share: Share of its area that is cut off.
        side: 0 to 3: quarter turns that bring the cut side to the left.

    Returns:
        The remaining mask; one side of the array is the border.
    """
    rotated = np.rot90(mask, side)
    sums = np.cumsum(np.count_nonzero(rotated, axis=0))
    first = int(np.searchsorted(sums, share * sums[-1]))
    return np.rot90(rotated[:, first:], -side).copy()
