"""Rotation of a rigid body since an earlier image, from points on its surface.

An outline determines the orientation of a body to a few degrees, and its errors persist as long as the
outline. Points on the surface are tracked to a fraction of a pixel, so they show how far the body has
rotated: the points lie on the mesh as it was fitted to the earlier image, and the mesh is rotated, moved
and scaled until they project to where they were tracked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from visup.agent.model.records import Frame, Region
from visup.percepts.shape.refinement.mesh_model import MeshModel
from visup.percepts.shape.refinement.pose_fit import SurfacePoints, surface_points
from visup.percepts.shape.refinement.region_image import RegionImage

Floats = NDArray[np.float64]

MAX_POINTS = 80
"""Points followed at most."""

MIN_POINTS = 10
"""Least number of points from which a rotation is estimated."""

MIN_INLIER_SHARE = 0.5
"""Least share of the tracked points that one rotation must explain; else the image shows something else."""

INLIER_PX = 1.0
"""Distance within which a rotation explains a point, pixels."""

LARGEST_ROTATION_COS = np.cos(np.radians(12.0))
"""Cosine of the rotation after which a new reference image is needed, since the surface looks different."""

_MARGIN = 0.25
_QUALITY, _APART_PX = 0.02, 4
_RING = 5, 13
"""Pixels: sides of the squares by which a body grows to where its surroundings begin and end."""
_PLAIN_TONE_RANGE = 12
"""Range of tones, from the 5th to the 95th percentile, up to which surroundings are plain."""
_RETURNS_PX = 0.3
_WINDOW = (15, 15)
_ROUNDS = 8
_STEP = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceImage:
    """An image of a body with trackable points on it.

    Attributes:
        grey: (h, w) uint8, the surroundings of its region.
        points: (N, 2) float32, (x, y) in `grey`.
    """

    grey: NDArray[np.uint8]
    points: NDArray[np.float32]

    def found_in(self, frame: Frame, region: Region) -> tuple[Floats, NDArray[np.bool_]]:
        """The points in a later frame.

        Args:
            frame: The frame.
            region: The region of the body in it.

        Returns:
            (N, 2) positions (x, y) relative to the region's centre as `points` are to that of `grey`, and
            (N,) which were found: those that track back to where they were.
        """
        now = _surroundings(frame, region, (self.grey.shape[1], self.grey.shape[0]))
        positions, forward_status, _ = cv2.calcOpticalFlowPyrLK(
            self.grey, now, self.points, self.points.copy(), winSize=_WINDOW
        )
        tracked_back, backward_status, _ = cv2.calcOpticalFlowPyrLK(
            now, self.grey, positions, positions.copy(), winSize=_WINDOW
        )
        round_trip = np.hypot(*(tracked_back - self.points).T)
        found = (
            (forward_status[:, 0] > 0) & (backward_status[:, 0] > 0) & (round_trip < _RETURNS_PX)
        )
        return np.asarray(positions, np.float64), np.asarray(found, np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class FollowedSurface:
    """The surface of a body, followed from an earlier image.

    Attributes:
        image: The image.
        orientations: (K, 3, 3) possible orientations in it.
        points: Where its points lie on the mesh, for each of them.
    """

    image: SurfaceImage
    orientations: Floats
    points: tuple[SurfacePoints, ...]

    def current_orientations(self, frame: Frame, region: Region) -> tuple[NDArray[np.intp], Floats]:
        """The orientations in a later frame.

        Returns:
            (M,) numbers of those consistent with the motion of the surface, and (M, 3, 3) the current ones.
        """
        positions, found = self.image.found_in(frame, region)
        height, width = self.image.grey.shape
        positions -= (np.array([width, height]) - 1) / 2
        numbers, rotated = [], []
        for k, on_mesh in enumerate(self.points):
            usable = found & ~np.isnan(on_mesh.positions[:, 2])
            rotation = rotation_since(
                on_mesh.positions[usable], positions[usable], on_mesh.distance
            )
            if rotation is not None:
                numbers.append(k)
                rotated.append(rotation @ self.orientations[k])
        return np.array(numbers, np.intp), np.array(rotated).reshape(-1, 3, 3)

    def needs_new_image(self, numbers: NDArray[np.intp], current: Floats) -> bool:
        """Whether the body has rotated so far since the image that a new one is needed."""
        if len(numbers) < len(self.orientations):
            return True
        cosine = (np.einsum("kij,kij->k", current, self.orientations[numbers]) - 1) / 2
        return bool((cosine < LARGEST_ROTATION_COS).any())

    def ordered(self, numbers: Sequence[int]) -> FollowedSurface:
        """The same surface with its orientations in another order."""
        points = tuple(self.points[k] for k in numbers)
        return FollowedSurface(self.image, self.orientations[list(numbers)], points)


def followed_surface(
    frame: Frame,
    region: Region,
    model: MeshModel,
    image: RegionImage,
    orientations: Floats,
    focal_px: float,
) -> FollowedSurface | None:
    """Begin to follow the surface of a body; None if it has too few trackable points.

    Args:
        frame: The frame that shows it.
        region: Its region.
        model: Its mesh.
        image: The region as poses are fitted to it.
        orientations: (K, 3, 3) those fitted.
        focal_px: Focal length, pixels.
    """
    surface = surface_image(frame, region)
    if surface is None:
        return None
    height, width = surface.grey.shape
    centred = surface.points.astype(np.float64) - (np.array([width, height]) - 1) / 2
    points = (surface_points(model, image, o, centred, focal_px) for o in orientations)
    return FollowedSurface(surface, orientations, tuple(points))


def surface_image(frame: Frame, region: Region) -> SurfaceImage | None:
    """The image of a region; None if it has too few trackable points.

    Args:
        frame: The frame that shows it.
        region: The region.
    """
    _, _, w, h = region.bbox
    size = (round(w * (1 + 2 * _MARGIN)), round(h * (1 + 2 * _MARGIN)))
    grey = _surroundings(frame, region, size)
    mask = np.zeros(grey.shape, np.uint8)
    left, top = round((size[0] - w) / 2), round((size[1] - h) / 2)
    mask[top : top + h, left : left + w] = region.mask
    # On a plain background there is nothing else to track, and corners of the outline are most informative.
    inside = mask if _is_plain_around(mask, grey) else cv2.erode(mask, np.ones((5, 5), np.uint8))
    points = cv2.goodFeaturesToTrack(grey, MAX_POINTS, _QUALITY, _APART_PX, mask=inside)
    if points is None or len(points) < MIN_POINTS:
        return None
    return SurfaceImage(grey, np.asarray(points[:, 0], np.float32))


def _is_plain_around(mask: NDArray[np.uint8], grey: NDArray[np.uint8]) -> bool:
    """Whether the background around a body has one tone.

    Args:
        mask: (h, w) not 0 on the body.
        grey: (h, w).
    """
    inner, outer = (cv2.dilate(mask, np.ones((k, k), np.uint8)) for k in _RING)
    around = grey[(outer > 0) & (inner == 0)]
    if not around.size:
        return False
    low, high = np.percentile(around, (5, 95))
    return bool(high - low <= _PLAIN_TONE_RANGE)


def _surroundings(frame: Frame, region: Region, size: tuple[int, int]) -> NDArray[np.uint8]:
    """The grey image of a size (width, height) about the centre of a region's box."""
    x, y, w, h = region.bbox
    crop = cv2.getRectSubPix(frame.image, size, (x + (w - 1) / 2, y + (h - 1) / 2))
    return np.asarray(cv2.cvtColor(crop, cv2.COLOR_BGR2GRAY), np.uint8)


def rotation_since(positions: Floats, image_points: Floats, distance: float) -> Floats | None:
    """The rotation of a body, as seen from a camera that looks at it.

    Args:
        positions: (N, 3) points of the body as it was: x and y relative to its centre and towards the
            viewer's
            far side z, pixels.
        image_points: (N, 2) where they are seen now, pixels.
        distance: From the viewer to the body's centre, pixels at the body.

    Returns:
        (3, 3), or None where no rotation explains enough of the points.

    Example:
        >>> rng = np.random.default_rng(0)
        >>> body = rng.uniform(-30, 30, (40, 3))
        >>> turned = Rotation.from_rotvec([0.02, -0.03, 0.01])
        >>> p = turned.apply(body)
        >>> seen = 1.1 * p[:, :2] / (1 + p[:, 2:] / 200) + (3, -2)
        >>> found = rotation_since(body, seen, 200.0)
        >>> Rotation.from_matrix(found).as_rotvec().round(3).tolist()
        [0.02, -0.03, 0.01]
    """
    if len(positions) < MIN_POINTS:
        return None
    motion = np.zeros(6)
    motion[3:5] = np.median(image_points - _projected(positions, motion, distance), axis=0)
    for _ in range(_ROUNDS):
        residuals = image_points - _projected(positions, motion, distance)
        slopes = np.stack(
            [
                (_projected(positions, motion + _STEP * e, distance) - image_points + residuals)
                / _STEP
                for e in np.eye(6)
            ],
            axis=-1,
        )
        weight = 1 / (1 + (residuals**2).sum(axis=1) / (0.5 * INLIER_PX) ** 2) ** 2
        flat, each = slopes.reshape(-1, 6), np.repeat(weight, 2)
        normal = (flat * each[:, None]).T @ flat
        normal[np.diag_indices(6)] *= 1 + 1e-6
        motion = motion + np.linalg.solve(
            normal + 1e-9 * np.eye(6), flat.T @ (each * residuals.ravel())
        )
    explained = np.hypot(*(image_points - _projected(positions, motion, distance)).T) < INLIER_PX
    if np.count_nonzero(explained) < max(MIN_POINTS, MIN_INLIER_SHARE * len(positions)):
        return None
    return np.asarray(Rotation.from_rotvec(motion[:3]).as_matrix(), np.float64)


def _projected(positions: Floats, motion: Floats, distance: float) -> Floats:
    """(N, 2) projections of points of a body after a rotation (3), a shift (2) and a change of scale (1)."""
    rotated = Rotation.from_rotvec(motion[:3]).apply(positions)
    scale = np.exp(motion[5]) / (1 + rotated[:, 2:] / distance)
    return np.asarray(rotated[:, :2] * scale + motion[3:5], np.float64)
